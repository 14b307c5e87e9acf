"""What a calibration that hardly shows α_yaw leaves of the effects in turning.

Swivel casters that swing round, or a wheel that lifts, turn a robot by as much as its torques do. Under a
controller the torques answer them, and the calibration log shows α_yaw to a share s alone: the misfit of
``yaw_inertia``. An error of that share leaves, on another drive,

    s α_yaw (u_right − u_left)

of l·dyaw_rate/dt. In a steady turn the torques hold what brakes it, so that this is like an effect in
proportion to the yaw rate. Such an effect is a rest up to the size at which it turns the robot as much, root
mean square. A scrub, which jumps where the turn reverses, is a rest up to its least squares in the error. So
are torques that turn one way: on a drive that turns both ways as much, that is nothing.

A centre of mass, a yaw damping or a scrub that the base model holds was found beside the same torques, in
units of the same α_yaw. So it is known to that share as well: another drive may ask for s of it more or less.
An imbalance or a bias that turns may be none at all there: a caster that turned the robot one way.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.sticking import SCRUB
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.dry_turning import supports_mps2
from wmr_replay.gap.scan.misfit import ONE_WAY, TURNING, size_of, turning_is_unknown
from wmr_replay.gap.scan.other_forms import least_squares, root_mean_square
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import COEFFICIENT, Term, parse_term

COM = "com_offset"
IN_DOUBT = (
    "the calibration log does not show well how the torques turn the robot, and alpha_yaw may be off by a "
    "factor of {factor:.3g}: it hardly turns, or something else turns it as well, such as swivel casters "
    "that swing round, pads that drag or a wheel that lifts. `gap` names no yaw inertia of less than "
    "{inertia:.0%}, {formulas}, no yaw damping, scrub or moved centre of mass that turns it no more than "
    "this error does, and nothing that is not surely more than negligible. Calibrate on a drive that turns, "
    "and as calmly as the one to be analysed"
)


def doubts(misfit: Mapping[str, float], own: MisfitSettings) -> tuple[str, ...]:
    """What is to be said of a base model with this misfit."""
    if not turning_is_unknown(misfit, own):
        return ()
    share = misfit.get("yaw_inertia", 0.0)
    formulas = "no formula" if share > own.no_formula_share else "no formula in turning"
    inertia = own.unknown_inertia * share
    return (IN_DOUBT.format(factor=1 + share, inertia=inertia, formulas=formulas),)


def with_turning_in_doubt(extension: Extension, binned: BinnedLog) -> Extension:
    """The extension, its misfit widened by what an error of α_yaw leaves on the log.

    Unchanged where the base model has no misfit: a model that was not calibrated on a log.
    """
    share = extension.misfit.get("yaw_inertia", 0.0)
    if share <= 0:
        return extension
    left_mps2 = error_mps2(extension, binned)
    turns = ((name, root_mean_square(unit)) for name, unit in units_of(extension, binned) if name != SCRUB)
    found = {name: left_mps2 / unit_mps2 for name, unit_mps2 in turns if unit_mps2 > 0}
    found[SCRUB] = scrub_in_error_mps2(extension, binned)
    held = held_in_doubt(extension, binned)
    apart = share * extension.base.alpha_yaw * columns_of(binned)["effort_diff"]
    for name, unit in one_way_units(extension, binned):
        held[name] = held.get(name, 0.0) + abs(least_squares(unit, apart))
    wider = {
        name: max(size + held.get(name, 0.0), found.get(name, 0.0)) for name, size in extension.misfit.items()
    }
    return replace(extension, misfit=wider)


def scrub_in_error_mps2(extension: Extension, binned: BinnedLog) -> float:
    """The size of the scrub d sgn(yaw_rate) of least squares in the error s α_yaw (u_right − u_left)."""
    jump, difference = dict(units_of(extension, binned))[SCRUB], columns_of(binned)["effort_diff"]
    share = extension.misfit.get("yaw_inertia", 0.0)
    return share * extension.base.alpha_yaw * abs(least_squares(jump, difference))


def held_in_doubt(extension: Extension, binned: BinnedLog) -> dict[str, float]:
    """What twice the error of α_yaw leaves open of the effects in turning that the base holds: it is another
    one on another drive. Supports that drag may do so in the form of each other effect, and all of what they
    do where α_yaw is not known may be a moved centre of mass or, on a drive that turns one way more than the
    other, torques that turn one way.
    """
    share = binned.settings.misfit.other_drives * extension.misfit.get("yaw_inertia", 0.0)
    shares = dict.fromkeys(TURNING, share) | dict.fromkeys(ONE_WAY, min(share, 1.0))
    dragging = supports_mps2(extension, binned)
    units = dict(units_of(extension, binned))
    found = {name: share * abs(least_squares(unit, dragging)) for name, unit in units.items()}
    if turning_is_unknown(extension.misfit, binned.settings.misfit):
        others = {COM: units[COM], **dict(one_way_units(extension, binned))}
        found |= {name: abs(least_squares(unit, dragging)) for name, unit in others.items()}
    for name, sizes in extension.known:
        if name in shares:
            found[name] = found.get(name, 0.0) + shares[name] * size_of(name, sizes)
    return found


def error_mps2(extension: Extension, binned: BinnedLog) -> float:
    """The error s α_yaw (u_right − u_left) on the log, root mean square; 0 without a misfit."""
    share = extension.misfit.get("yaw_inertia", 0.0)
    return share * extension.base.alpha_yaw * root_mean_square(columns_of(binned)["effort_diff"])


def terms_in_doubt(extension: Extension, binned: BinnedLog, names: Iterable[str]) -> bool:
    """Whether ``names`` are terms that turn the robot no more than the error of α_yaw does, summed."""
    terms = [(parse_term(name), name) for name in names if name.startswith(UNNAMED_PREFIX)]
    columns, total = columns_of(binned), np.zeros(len(binned))
    if not terms or any(term.channel != "yaw" for term, _ in terms):
        return False
    for term, name in terms:
        total += extension.effects[name][COEFFICIENT] * term.evaluate(columns)
    return root_mean_square(total) <= error_mps2(extension, binned)


def units_of(extension: Extension, binned: BinnedLog) -> Iterator[tuple[str, F64]]:
    """The effects that brake or help turns, with l·dyaw_rate/dt (n,) in m/s² per size on the log.

    For a centre of mass it is (l m/I) v·yaw_rate, with l m/I = α_yaw/(α l), which needs no masses.
    """
    columns, base = columns_of(binned), extension.base
    arm_per_m = base.alpha_yaw / (base.alpha * base.half_track_m)
    yield SCRUB, Term("yaw", ("sgn(yaw_rate)",)).evaluate(columns)
    yield "yaw_damping", base.half_track_m * columns["yaw_rate"]
    yield COM, arm_per_m * columns["v"] * columns["yaw_rate"]


def one_way_units(extension: Extension, binned: BinnedLog) -> Iterator[tuple[str, F64]]:
    """The torques that turn one way, with l·dyaw_rate/dt (n,) in m/s² per size on the log."""
    alpha_yaw, together = extension.base.alpha_yaw, columns_of(binned)["effort_sum"]
    for name, unit in zip(ONE_WAY, (together, np.full_like(together, 2.0)), strict=True):
        yield name, alpha_yaw * unit
