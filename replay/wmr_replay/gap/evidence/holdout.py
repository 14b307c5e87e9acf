"""Hold-out gate: the gap of windows that were not fitted, with and without an effect, in pairs."""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.path_error import (
    WindowErrors,
    Windows,
    error_growth,
    moved_path,
    summed,
    window_errors,
    window_residuals,
    windows_of,
)
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, Key, gauss_newton, keys_of
from wmr_replay.gap.estimation.unknown_modes import causal_deviance
from wmr_replay.gap.evidence.paired import signed_rank_p
from wmr_replay.gap.model.candidates import LOCAL, is_place
from wmr_replay.gap.settings.evidence import HoldOutSettings
from wmr_schemas.arrays import F64, Bool

FOLDS = (0, 1, 2)


class Proof(NamedTuple):
    """The windows' gaps before and after, the reduction over those in which the effect shows, p of the
    blocks, and whether the effect holds.
    """

    before: WindowErrors
    after: WindowErrors
    reduction: float
    p_value: float
    holds: bool


class Fold(NamedTuple):
    """A split of the log with both models fitted to its fitted part."""

    problem: Problem
    without: Fit
    with_it: Fit


class GapChange(NamedTuple):
    """Over the windows in which an effect shows: relative reduction of the root mean square gap, and p that
    the gap is larger with the effect; share of the squared gap that is noise of the poses; the least
    reduction that is to be expected if the effect is there; and how many windows these are.
    """

    reduction: float
    larger_p: float
    noise_share: float
    promised: float
    n_windows: int


class Prediction(NamedTuple):
    """How much better held-out blocks are predicted with an effect: p of the blocks, −2 log of the ratio of
    the predictive likelihoods, summed over them, and the same without the block that gains most.
    """

    p_value: float
    gain: float
    beyond_one: float = 0.0

    def is_clear(self, settings: HoldOutSettings) -> bool:
        """Whether it leaves no doubt: by many blocks, or by as much as a formula must explain, in more than
        one of them where they are few.
        """
        by_size = self.p_value < settings.clear_level and self.gain > settings.clear_gain
        by_some = self.p_value < settings.level and self.beyond_one > settings.clear_gain
        return by_size or by_some or self.p_value < settings.clear

    def is_clear_twice(self, settings: HoldOutSettings) -> bool:
        """Whether many blocks say so, and by as much in more than one of them."""
        return self.p_value < settings.clear and self.beyond_one > settings.clear_gain


def windows_within(problem: Problem, chosen: Bool) -> Windows:
    """Whole windows of the rows ``chosen`` (n,).

    Windows that an identifier calls slipping are left out where others remain: to simulate them would take
    its word for the loss of traction. So are those in which it says that a skid begins or ends: the lateral
    speed begins or ends with it, and it knows the time to 0.3 s only.
    """
    binned = problem.binned
    windows = windows_of(binned, chosen)
    if not binned.identified:
        return windows
    slips, most = binned.slips, problem.settings.hold_out.most_slip
    windows = [(a, b) for a, b in windows if np.mean(slips[a:b]) < most] or windows
    return [(a, b) for a, b in windows if np.ptp(binned.skids[a:b].astype(int)) == 0] or windows


def prove(problem: Problem, without: Fit, with_it: Fit) -> Proof:
    """Compare two models on each third of the log while it is held out and both are fitted to the rest.

    The effect holds where :func:`is_proven` by the prediction of blocks of 2 s and the gap of the windows in
    which both simulations are :func:`steady`. Position and yaw count together, each in units of its typical
    gap without the effect.
    """
    own = problem.settings.hold_out
    parts = [problem.fold(k) for k in FOLDS]
    folds = [Fold(part, refitted(part, without), refitted(part, with_it)) for part in parts]
    gaps = [concatenated(list(parts)) for parts in zip(*map(gaps_of, folds), strict=True)]
    counted = np.concatenate([steady(fold) for fold in folds])
    predicted, change = prediction(folds), change_where(counted, gaps, own)
    holds = is_proven(predicted, change, len(counted), own, placed=is_placed(without, with_it))
    before, after, _ = gaps
    return Proof(before, after, 0.0 if change is None else change.reduction, predicted.p_value, holds)


def steady(fold: Fold) -> Bool:
    """The held-out windows (m,) in which a small error of the start grows in neither simulation as in one
    that is unstable, such as that of a robot whose centre of mass lies behind the axle: there the gap is a
    measure of the start, and not of the model.
    """
    problem = fold.problem
    windows, own = windows_within(problem, ~problem.train), problem.settings.hold_out
    grown = [error_growth(problem.binned, fit.extension, windows) for fit in (fold.without, fold.with_it)]
    return np.asarray(np.max(grown, axis=0) <= own.most_growth)


def change_where(counted: Bool, gaps: list[WindowErrors], settings: HoldOutSettings) -> GapChange | None:
    """:func:`gap_change` over the windows that are ``counted`` (n,); None where most are not."""
    if not counted.any() or np.mean(counted) < settings.least_steady:
        return None
    before, after, apart = (WindowErrors(*(column[counted] for column in one)) for one in gaps)
    return gap_change(before, after, apart, settings)


def is_proven(
    predicted: Prediction,
    change: GapChange | None,
    n_windows: int,
    settings: HoldOutSettings,
    *,
    placed: bool,
) -> bool:
    """Whether the prediction and the gap of ``n_windows`` windows prove an effect.

    Blocks are predicted better (p < .05), and the gap of the windows where the models differ shrinks
    (:func:`least_reduction`). Where that gap is mostly pose noise, the prediction decides, unless the gap is
    clearly larger. Where hardly any window shows a difference, since those that an identifier calls slipping
    are left out, the prediction alone decides, where it is clear; so it does where the disturbance makes so
    much of the gap that an effect that is there may not reduce it by as much (:func:`gap_change`). Where the
    prediction is clear twice over, the gap need but shrink.
    """
    if change is None:
        few = n_windows < settings.few_windows
        level = settings.level / settings.few_windows_factor
        return predicted.is_clear(settings) or (few and predicted.p_value < level)
    if clearly_larger(change, settings):
        return False
    if predicted.p_value < settings.clear and change.n_windows < settings.few_windows:
        return True
    least = least_reduction(change, predicted.p_value, settings, placed=placed)
    if predicted.is_clear(settings) and change.promised < least and not placed:
        return True
    shrinks = change.reduction >= least or (change.reduction > 0 and predicted.is_clear_twice(settings))
    return predicted.p_value < settings.level and shrinks


def is_placed(without: Fit, with_it: Fit) -> bool:
    """Whether what the second model has more acts in a time or place."""
    more = with_it.extension.effects.keys() - without.extension.effects.keys()
    return any(is_place(name, key) for name in more for key in with_it.extension.effects[name])


def gap_change(
    before: WindowErrors, after: WindowErrors, apart: WindowErrors, settings: HoldOutSettings
) -> GapChange | None:
    """How the gap changes over the windows in which the models differ; None where they differ in none.

    ``apart``, d, is how far the two simulations lie from each other. If the effect is there, the gap b with
    it is what noise and disturbance leave, independent of d, and the gap a without it has the mean square
    a² = b² + d². Of that reduction, 1.96 standard deviations of mean(a² − b²) over the windows are not sure.
    """
    a, b = combined_gap(before, before), combined_gap(after, before)
    shows = np.abs(a - b) > settings.least_change * np.maximum(a, b)
    if not np.any(shows):
        return None
    was, now = float(np.mean(a[shows] ** 2)), float(np.mean(b[shows] ** 2))
    floor = combined(before.floor_m, before.floor_rad, before)[shows]
    larger_p = signed_rank_p(b[shows] ** 2 - a[shows] ** 2)
    moved = combined(apart.position_m, apart.yaw_rad, before)[shows]
    unsure = settings.sure_sd * float(np.std(a[shows] ** 2 - b[shows] ** 2)) / np.sqrt(np.sum(shows))
    left = max(was - float(np.mean(moved**2)) + unsure, 0.0)
    reduction, promised = (float(1.0 - np.sqrt(square / was)) for square in (now, left))
    return GapChange(reduction, larger_p, float(np.mean(floor**2)) / was, promised, int(np.sum(shows)))


def least_reduction(change: GapChange, p_value: float, settings: HoldOutSettings, *, placed: bool) -> float:
    """What the gap has to shrink by: 10 %, or 3 % where p < 1e-4; nothing where it is mostly pose noise."""
    if change.noise_share > settings.mostly_noise:
        return settings.least_if_clear if placed else -np.inf
    return settings.least_if_clear if p_value < settings.clear else settings.least_reduction


def clearly_larger(change: GapChange, settings: HoldOutSettings) -> bool:
    """Whether an effect makes the gap larger, over all and in most of the windows."""
    return change.reduction < 0 and change.larger_p < settings.larger_level


def held_out_errors(problem: Problem, fit: Fit) -> WindowErrors:
    """The gap of every window while it is held out, the model fitted to the other two thirds of the log."""
    parts = [problem.fold(k) for k in FOLDS]
    return concatenated([errors_of(part, refitted(part, fit)) for part in parts])


def refitted(problem: Problem, fit: Fit) -> Fit:
    """The same effects fitted to another part of the log.

    When and where one acts stays fixed, since the rows that show it may all be held out; so does a loss of
    traction of which the fitted rows show hardly anything.
    """
    steps, unseen = problem.settings.hold_out.refit_steps, unseen_losses(problem, fit)
    keys = tuple(key for key in keys_of(fit.extension, places=False) if key not in unseen)
    return gauss_newton(problem, fit.extension, fit.noise, steps, keys=keys)


def unseen_losses(problem: Problem, fit: Fit) -> list[Key]:
    """The losses of traction in a time or place of which the fitted rows hold less than a tenth of what the
    log says of them.
    """
    losses = [(name, "loss") for name in fit.extension.effects if name in LOCAL]
    if not losses:
        return []
    information = np.square(fit.psi).sum(axis=1)
    shares = information[problem.train].sum(axis=0) / np.maximum(information.sum(axis=0), 1e-12)
    least = problem.settings.hold_out.least_seen
    return [key for key in losses if shares[fit.keys.index(key)] < least]


def gaps_of(fold: Fold) -> tuple[WindowErrors, WindowErrors, WindowErrors]:
    """The gap of the held-out windows without and with the effect, and how far the simulations are apart."""
    binned, windows = fold.problem.binned, windows_within(fold.problem, ~fold.problem.train)
    without, with_it = (
        list(window_residuals(binned, fit.extension, windows)) for fit in (fold.without, fold.with_it)
    )
    apart = [(rows, a - b, sd) for (rows, a, sd), (_, b, _) in zip(without, with_it, strict=True)]
    return summed(binned, without), summed(binned, with_it), summed(binned, apart)


def errors_of(problem: Problem, fit: Fit) -> WindowErrors:
    """The gap of the held-out windows."""
    return window_errors(problem.binned, fit.extension, windows_within(problem, ~problem.train))


def concatenated(parts: list[WindowErrors]) -> WindowErrors:
    """The windows of all folds."""
    return WindowErrors(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def prediction(folds: list[Fold]) -> Prediction:
    """Wilcoxon's one-sided p that held-out blocks of 2 s, where the models differ, are predicted better, and
    by how much they are.
    """
    gains = []
    for problem, without, with_it in folds:
        own, held_out = problem.settings.hold_out, ~problem.train
        difference = (held_out_deviance(problem, without) - held_out_deviance(problem, with_it))[held_out]
        block = np.unique(problem.binned.t_s[held_out] // own.block_s, return_inverse=True)[1]
        moved = np.abs(without.innovations - with_it.innovations)[held_out].sum(axis=1)
        gains.append(np.bincount(block, difference)[np.bincount(block, moved) > own.least_moved])
    gained = np.concatenate(gains).astype(np.float64)
    gain = float(gained.sum())
    return Prediction(signed_rank_p(gained), gain, gain - float(gained.max(initial=0.0)))


def held_out_deviance(problem: Problem, fit: Fit) -> F64:
    """−2 log likelihood of the rows (n,); only those held out are of use.

    Where an identifier says the modes, those of held-out rows are marginalised causally: in hindsight it
    takes for slip or skid what a model lacks.
    """
    if not problem.binned.identified:
        return fit.row_deviance
    return causal_deviance(problem, fit.extension, fit.noise)


def path_change(
    problem: Problem, without: Fit, with_it: Fit, seconds: float, *, same_start: bool = False
) -> float:
    """How far an effect moves the simulated path in windows of ``seconds``, m: each path from its own fitted
    start, or both from the ``same_start``, for tyres: a start that is fitted makes up for what they do in a
    skid.
    """
    binned = problem.binned
    windows = windows_of(binned, np.ones(len(binned), bool), seconds)
    return moved_path(binned, without.extension, with_it.extension, windows, same_start=same_start)


def combined_gap(errors: WindowErrors, unit: WindowErrors) -> F64:
    """Position and yaw gap of each window as one number, in units of the typical gaps in ``unit``."""
    return combined(errors.position_m, errors.yaw_rad, unit)


def combined(position_m: F64, yaw_rad: F64, unit: WindowErrors) -> F64:
    """√((p² + y²)/2), each in units of its typical gap."""
    position = position_m / np.sqrt(np.mean(unit.position_m**2))
    yaw = yaw_rad / np.sqrt(np.mean(unit.yaw_rad**2))
    return np.asarray(np.sqrt((position**2 + yaw**2) / 2))
