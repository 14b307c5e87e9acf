"""Dry friction in turning that a base model holds, and what its form leaves open of α_yaw.

Tyres that scrub and supports that drag turn a robot back. Where the points lie that do so one calibration log
hardly shows, so that the form of

    f = d₀ sgn(yaw_rate) + d w/V,    V² = v² + w²,    w = l·yaw_rate

is known to a share s. What is wrong with it stands beside the torques that work against it. So α_yaw is
known no better than to s·rms(f)/rms(α_yaw (u_right − u_left)) on the calibration log.
"""

import numpy as np

from wmr_replay.gap.estimation.sticking import SCRUB
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.other_forms import SUPPORTS, root_mean_square
from wmr_schemas.arrays import F64
from wmr_schemas.terms import Term


def dry_mps2(extension: Extension, binned: BinnedLog) -> F64:
    """What the held dry friction takes of l·dyaw_rate/dt along a log (n,), in m/s², the sign of the turn."""
    scrub = sum(sizes["d0_mps2"] for name, sizes in extension.known if name == SCRUB)
    jump = Term("yaw", ("sgn(yaw_rate)",)).evaluate(columns_of(binned))
    return np.asarray(scrub * jump + supports_mps2(extension, binned))


def supports_mps2(extension: Extension, binned: BinnedLog) -> F64:
    """The part of it that supports take (n,)."""
    columns = columns_of(binned)
    v, w = columns["v"], extension.base.half_track_m * columns["yaw_rate"]
    speed = np.hypot(v, w)
    size = sum(sizes["d0_mps2"] for name, sizes in extension.known if name == SUPPORTS)
    return np.asarray(size * np.divide(w, speed, out=np.zeros_like(w), where=speed > 0))


def open_by_form(extension: Extension, binned: BinnedLog, known_to: float) -> float:
    """The share of α_yaw that a form of the held dry friction known to the share ``known_to`` leaves open."""
    asked = extension.base.alpha_yaw * columns_of(binned)["effort_diff"]
    return known_to * root_mean_square(dry_mps2(extension, binned)) / max(root_mean_square(asked), 1e-12)
