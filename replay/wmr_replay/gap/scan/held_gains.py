"""What a held term of the torques leaves of a gain on another drive.

Casters that drag more the quicker a robot turns, or a wheel that lifts, let a calibration find terms such as
c·effort_sum·|v|: the robot answers its torques otherwise from one speed to the next. How much of that belongs
to α, and how much to the term, one drive hardly shows. So α is known on another drive to the share k of least
squares of the held terms h in the torques,

    h = k α (u_right + u_left)

and α_yaw in the same way, by terms in yaw and right minus left.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.other_forms import least_squares
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.signals import Log
from wmr_schemas.terms import COEFFICIENT, Term, TermChannel, parse_term

GAINS: dict[TermChannel, tuple[str, tuple[str, ...]]] = {
    "longitudinal": ("effort_sum", ("payload", "drive_gain")),
    "yaw": ("effort_diff", ("yaw_inertia",)),
}
"""By channel, the torques that act on it, and what changes how the robot answers them."""


def with_held_gains(extension: Extension, log: Log, settings: GateSettings) -> Extension:
    """The extension, its misfit of gains widened by what the held terms of the torques are on the log.

    Unchanged where none is held, or where the base model has no misfit: it was not calibrated on a log. Raises
    InvalidSignal where the log has no torques or is too short.
    """
    held = held_terms(extension)
    if not held or not extension.misfit:
        return extension
    columns, wider = columns_of(bin_log(log, settings)), dict(extension.misfit)
    for channel, (torques, names) in GAINS.items():
        terms = [size * one.evaluate(columns) for one, size in held if one.channel == channel]
        alpha = extension.base.alpha if channel == "longitudinal" else extension.base.alpha_yaw
        share = abs(least_squares(alpha * columns[torques], np.sum(terms, axis=0))) if terms else 0.0
        wider |= {name: wider[name] + share for name in names if name in wider}
    return replace(extension, misfit=wider)


def held_terms(extension: Extension) -> list[tuple[Term, float]]:
    """The terms that the base model holds in which the torques of their channel act, with coefficients."""
    held = (
        (parse_term(name), sizes[COEFFICIENT])
        for name, sizes in extension.known
        if name.startswith(UNNAMED_PREFIX)
    )
    return [(one, size) for one, size in held if one.channel in GAINS and GAINS[one.channel][0] in one.columns]
