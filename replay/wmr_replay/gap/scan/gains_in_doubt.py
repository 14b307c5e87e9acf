"""What a calibration leaves of a gain, of a payload and of a yaw inertia on another drive.

Casters that drag more the quicker a robot turns, or a wheel that lifts, let a calibration find terms such as
c·effort_sum·|v|: the robot answers its torques otherwise from one speed to the next. How much of that belongs
to α, and how much to the term, one drive hardly shows. And a friction that the calibration leaves takes
torques as long as the robot moves: on a slow and steady drive it looks like a gain. So α is known on another
drive to the share k of least squares, in the torques, of the held terms and of that friction together, h:

    h = k α (u_right + u_left)

and α_yaw in the same way, by the held terms in yaw and right minus left.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.other_forms import least_squares, unit_mps2
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import COEFFICIENT, Term, TermChannel, parse_term

GAINS: dict[TermChannel, tuple[str, tuple[str, ...]]] = {
    "longitudinal": ("effort_sum", ("payload", "drive_gain")),
    "yaw": ("effort_diff", ("yaw_inertia",)),
}
"""By channel, the torques that act on it, and what changes how the robot answers them."""
FRICTION = Term("longitudinal", ("sgn(v)",))


def with_gains_in_doubt(extension: Extension, binned: BinnedLog) -> Extension:
    """The extension, its misfit of gains widened by what looks like a gain on the log.

    Unchanged where the base model has no misfit: a model that was not calibrated on a log.
    """
    if not extension.misfit:
        return extension
    columns = columns_of(binned)
    left = [*held_terms(extension), (FRICTION, friction_mps2(extension, binned.settings.misfit))]
    alphas = {"longitudinal": extension.base.alpha, "yaw": extension.base.alpha_yaw}
    wider = dict(extension.misfit)
    for channel, (torques, names) in GAINS.items():
        looks = [size * term.evaluate(columns) for term, size in left if term.channel == channel]
        asked = alphas[channel] * columns[torques]
        share = abs(least_squares(asked, np.sum([np.zeros_like(asked), *looks], axis=0)))
        wider |= {name: wider[name] + share for name in names if name in wider}
    return replace(extension, misfit=wider)


def friction_mps2(extension: Extension, own: MisfitSettings) -> float:
    """The dry friction that the calibration leaves, on another drive: twice what it measured, up to half of
    the least rest of a resistance.
    """
    measured = extension.misfit.get("wheel_coulomb", 0.0) * unit_mps2("wheel_coulomb", extension)
    return min(own.other_drives * measured, own.least_share * own.negligible_mps2 / own.other_drives)


def held_terms(extension: Extension) -> Iterator[tuple[Term, float]]:
    """The terms that the base model holds in which the torques of their channel act, with coefficients."""
    for name, sizes in extension.known:
        term = parse_term(name) if name.startswith(UNNAMED_PREFIX) else None
        if term and term.channel in GAINS and GAINS[term.channel][0] in term.columns:
            yield term, sizes[COEFFICIENT]
