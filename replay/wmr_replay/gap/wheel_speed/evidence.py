"""Whether an effect is there: significance over clusters of errors, and likelihood of what was not fitted."""

import math
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc, fdtrc

from wmr_replay.gap.estimation.path_error import WindowErrors
from wmr_replay.gap.settings.wheel_speed import GateSettingsWheelSpeed
from wmr_replay.gap.wheel_speed.candidates import PLACES
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import Fit, block_deviance, gauss_newton, inverse
from wmr_replay.gap.wheel_speed.held_out import Folds, averaged, held_out_gaps, pose_noise
from wmr_replay.gap.wheel_speed.places import Rates, inside_of
from wmr_replay.gap.wheel_speed.predict import DECLARED, Parameter, Problem
from wmr_replay.gap.wheel_speed.units import FOLDS, held_out_bins, sums, unit_of_blocks
from wmr_replay.gap.wheel_speed.windows import Gaps, Windows, rolled, windows_of
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.slip_terms import is_slip_term, parse_slip_term

TRACK = "effective_track"


def p_value(fit: Fit, name: str, n_scanned: int) -> float:
    """Robust Wald test of an effect's sizes against 0, F over clusters, times what was scanned.

    The test of an effect in a time or a place, which shows in a few clusters, is the likelihood's.
    """
    declared = DECLARED[name]
    which = [
        k
        for k, one in enumerate(fit.parameters)
        if one.effect == name and declared.parameters[one.key].role == "size"
    ]
    if not declared.zero_is_absent:
        return 0.0
    size = fit.sizes[which]
    if name in PLACES:
        plain = inverse(fit.information)[np.ix_(which, which)]
        return min(1.0, float(chdtrc(len(which), size @ inverse(plain) @ size)) * n_scanned)
    wald = float(size @ inverse(fit.spread[np.ix_(which, which)]) @ size) / len(which)
    free = max(fit.n_clusters - len(fit.parameters), 5)
    return min(1.0, float(fdtrc(len(which), free, wald)) * n_scanned)


def folds_of(problem: Problem, fit: Fit) -> Folds:
    """The model of ``fit`` fitted without each third of the record; times and places are kept."""
    free = tuple(one for one in fit.parameters if DECLARED[one.effect].parameters[one.key].role == "size")
    found = []
    for fold in range(FOLDS):
        held = held_out_bins(problem, fold)
        part = replace(problem, fitted=problem.fitted & ~held)
        mine = tuple(one for one in free if one.effect not in PLACES or seen_without(problem, fit, one, held))
        found.append(gauss_newton(part, mine, fit.values, fit.noises, robustly=True)[0])
    return Folds(tuple(found))


def seen_without(problem: Problem, fit: Fit, which: Parameter, held_out: Bool) -> bool:
    """Whether enough of a time or a place remains where some bins (n,) are held out to fit its loss."""
    inside = inside_of(problem, fit.values[which.effect], which.effect)
    remain = float((inside & ~held_out).sum()) / max(int(inside.sum()), 1)
    return remain >= problem.settings.gates.least_remaining


def held_out_deviance(problem: Problem, folds: Folds, like: Fit) -> F64:
    """−log likelihood (u,) of each unit while it was held out, at the noise of ``like``."""
    unit = unit_of_blocks(problem)
    total = np.zeros(int(unit.max()) + 1)
    for fold, values in enumerate(folds.values):
        by_unit = sums(block_deviance(problem, values, like.noises), unit)
        mine = np.arange(len(total)) % FOLDS == fold
        total[mine] = by_unit[mine]
    return total


def showing_units(change: F64, own: GateSettingsWheelSpeed) -> Bool:
    """The units (u,) in which an effect shows by the change of their deviance (u,); in the others noise alone
    decides.
    """
    least = max(own.least_unit_change, own.least_unit_share * float(np.abs(change).max(initial=0.0)))
    return np.asarray(np.abs(change) > least)


def held_out_p(before: F64, after: F64) -> float:
    """One-sided p that held-out units (u,) are no likelier after than before: Wilcoxon's signed ranks."""
    from scipy.stats import wilcoxon  # noqa: PLC0415 – half a second of start-up

    change = before - after
    if not np.any(change):
        return 1.0
    return float(wilcoxon(change, alternative="greater").pvalue)


def matters(fit: Fit, name: str, same: tuple[str, ...], share: float) -> bool:
    """Whether an effect's size reaches a share of what matters in practice, where that is declared of it or
    of the ones that are the ``same`` in any motion.
    """
    declared = DECLARED[name]
    relevant = [DECLARED[one].relevant for one in (name, *same) if one in DECLARED]
    known = [least for least in relevant if least is not None]
    if not known or not declared.zero_is_absent:
        return True
    keys = declared.vector or tuple(declared.parameters)[:1]
    return math.hypot(*(fit.values[name][key] for key in keys)) >= share * known[0]


def within_calibration(base_sd: Values, fit: Fit, name: str, settings: GateSettingsWheelSpeed) -> bool:
    """Whether an effect that the base model has from a calibration differs from it by no more than
    ``calibration_sd`` standard deviations, the calibration's and its own together.
    """
    if name not in base_sd:
        return False
    own = {one.key: sd for one, sd in zip(fit.parameters, fit.sd, strict=True) if one.effect == name}
    both = [math.hypot(settings.between_logs * base_sd[name].get(key, 0.0), sd) for key, sd in own.items()]
    sizes = [fit.values[name][key] / max(sd, 1e-300) for key, sd in zip(own, both, strict=True)]
    return math.hypot(*sizes) < settings.calibration_sd


def hardly_turns(problem: Problem, name: str) -> bool:
    """Whether a track that a calibration gave is doubted by a log on which the heading hardly changes: wheels
    that pull differently creep apart on dry friction before the robot turns. So is how fast it turns for what
    the wheels do, in a term.
    """
    if TRACK not in problem.base_sd or not (name == TRACK or is_of_turning(name)):
        return False
    return float(np.ptp(problem.measured[2])) < problem.settings.gates.least_turning_rad


def is_of_turning(name: str) -> bool:
    """Whether a name is a term of the yaw rate that the wheels' yaw rate is a factor of."""
    if not is_slip_term(name):
        return False
    term = parse_slip_term(name)
    return term.channel == "yaw_rate" and any("yaw_rate" in factor for factor in term.factors)


def narrows_gap(problem: Problem, without: Folds, with_it: Folds) -> bool:
    """Whether the held-out gap in position or in yaw shrinks enough; each window is simulated by the fold
    that did not fit it.
    """
    own = problem.settings.gates
    tried = (windows_of(problem, seconds) for seconds in own.gate_windows_s)
    windows = max(tried, key=lambda one: min(len(one.rows), own.enough_windows))
    pose_sd = pose_noise(problem)
    gaps = [held_out_gaps(problem, windows, folds, pose_sd) for folds in (without, with_it)]
    shows = showing(windows, gaps, own.least_shown)
    errors = (averaged(problem, windows, gap, pose_sd) for gap in gaps)
    before, after = (WindowErrors(*(part[shows] for part in one)) for one in errors)
    return any(
        shrinks(getattr(before, key), getattr(after, key), getattr(before, floor), own)
        for key, floor in (("position_m", "floor_m"), ("yaw_rad", "floor_rad"))
    )


def showing(windows: Windows, gaps: list[Gaps], share: float) -> Bool:
    """The windows (W,) in which an effect shows: it moves or turns the simulated path by at least a share
    of what it does in the window that shows it most.
    """
    change = gaps[1].simulated - gaps[0].simulated
    squares = np.where(windows.inside, change**2, 0.0).sum(axis=-1)
    moved = np.sqrt(np.stack([squares[0] + squares[1], squares[2]]) / windows.inside.sum(axis=1))
    most = moved.max(axis=1, keepdims=True, initial=0.0)
    return np.asarray((moved >= share * np.maximum(most, 1e-12)).any(axis=0))


def shrinks(before: F64, after: F64, floor: F64, own: GateSettingsWheelSpeed) -> bool:
    """By a tenth, or by a third of what stands above the floor, or by less where the test leaves no doubt."""
    square = [float(np.mean(values**2)) for values in (before, after, floor)]
    reduction = 1 - np.sqrt(square[1] / max(square[0], 1e-300))
    above = (square[0] - square[1]) / max(square[0] - square[2], 1e-300) if square[0] > square[2] else 0.0
    p = held_out_p(np.log(before), np.log(after))
    if len(before) >= own.few_windows and p > own.held_out_level:
        return False
    doubtless = reduction > own.least_doubtless and p < own.doubtless
    doubtless = doubtless or (reduction > own.least_clear and p < own.clear)
    return bool(
        reduction > own.least_reduction or (above > own.least_above_floor and reduction > 0) or doubtless
    )


def moves_path(problem: Problem, before: Values, after: Values) -> bool:
    """Whether an effect moves the simulated path by more than the tolerance somewhere: with the moments of
    slip, without which a log may have no window that is long enough.
    """
    own, problem = problem.settings.gates, problem.with_slip
    windows = windows_of(problem, own.tolerance_s)
    paths = [rolled(windows, problem.predicted_at_poses(values)) for values in (before, after)]
    apart = np.where(windows.inside, np.hypot(*(paths[1] - paths[0])[:2]), 0.0)
    return bool(apart.max(initial=0.0) > own.tolerance_m)


def steady_loss(problem: Problem, before: Fit, after: Fit, name: str) -> bool:
    """Whether a loss in a time or a place is certain, and the same all through."""
    loss, place = after.parameters.index(Parameter(name, "loss")), after.values[name]
    if after.sd[loss] > problem.settings.gates.most_loss_sd:
        return False
    rates = Rates(problem, before.values)
    return rates.steady(inside_of(problem, place, name), place["loss"], problem.settings.gates)


def holds_on_held_out(problem: Problem, without: Fit, with_it: Fit, name: str) -> tuple[bool, float]:
    """Whether units that were not fitted are likelier with the effect, and the p of it.

    An effect in a time or a place shows in a few units only, which the sum decides.
    """
    folds = folds_of(problem, without), folds_of(problem, with_it)
    before, after = (held_out_deviance(problem, one, with_it) for one in folds)
    gained = float((before - after).sum())
    if name in PLACES:
        return gained > 0, float(np.exp(-max(gained, 0.0)))
    own, change = problem.settings.gates, before - after
    shown = showing_units(change, own)
    p = held_out_p(before[shown], after[shown])
    if shown.sum() < own.few_units:
        holds = gained > own.few_units_gain and float((change[shown] > 0).mean()) > own.least_agreeing
    else:
        holds = gained > 0 and p < own.held_out_level
    return holds and narrows_gap(problem, *folds), p
