"""Proof on what was not fitted: the gap of the held-out windows with and without an effect, in pairs."""

from typing import NamedTuple

import numpy as np
from scipy.stats import wilcoxon

from wmr_replay.gap.estimation.path_error import WindowErrors, simulated_path, window_errors, windows_of
from wmr_replay.gap.estimation.problem import HELD_OUT_S, Problem
from wmr_replay.gap.estimation.refit import Fit, gauss_newton
from wmr_schemas.arrays import F64, Bool

LEAST_REDUCTION, LEVEL = 0.10, 0.05
LEAST_ABOVE_FLOOR, LEAST_EXCESS = 0.30, 0.05
CLEAR, LEAST_OF_THE_CLEAR = 1e-4, 0.03
BLOCK_S = 2.0
MOST_SLIP = 0.05
LEAST_CHANGE = 0.02
LEAST_MOVED = 0.5
FEW_WINDOWS = 4


class Proof(NamedTuple):
    """Root mean square gap before and after, over the windows in which the effect shows; whether it holds."""

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


def windows_within(problem: Problem, chosen: Bool) -> list[tuple[int, int]]:
    """Whole windows of the rows ``chosen`` (n,). Where an identifier said the modes, windows that it calls
    slipping are left out: to simulate them would take its word for the loss of traction.
    """
    windows = windows_of(problem.drive, chosen)
    if not problem.drive.identified:
        return windows
    slips = problem.drive.mode >= 2
    return [(a, b) for a, b in windows if np.mean(slips[a:b]) < MOST_SLIP] or windows


def prove(problem: Problem, without: Fit, with_it: Fit) -> Proof:
    """Compare two models on what was held out, each 4 s of every 12 s in its turn, both fitted to the rest.

    The effect holds where blocks of 2 s are predicted better (deviance, Wilcoxon's signed ranks, p < .05) and
    the gap is smaller in the windows where the models differ: by 10 %, or by 30 % of what stands above the
    noise floor, or by 3 % where the prediction leaves no doubt (p < 1e-4), which is also asked where no
    window shows a difference: those that an identifier calls slipping are left out. Position and yaw count
    together, each in units of its typical gap without the effect.
    """
    folds = [Fold(problem, without, with_it)]
    for shift in (HELD_OUT_S, 2 * HELD_OUT_S):
        other = Problem.of(problem.drive, problem.shift_s + shift)
        folds.append(Fold(other, refitted(other, without), refitted(other, with_it)))
    before = joined([errors_of(fold.problem, fold.without) for fold in folds])
    after = joined([errors_of(fold.problem, fold.with_it) for fold in folds])
    a, b = together(before, before), together(after, before)
    shows = np.abs(a - b) > LEAST_CHANGE * np.maximum(a, b)
    p_value = blocks_p(folds)
    if not np.any(shows):
        few = len(a) < FEW_WINDOWS
        return Proof(before, after, 0.0, p_value, p_value < (LEVEL / 5 if few else CLEAR))
    was, now = float(np.mean(a[shows] ** 2)), float(np.mean(b[shows] ** 2))
    floor = float(np.mean(floor_of(before, before)[shows] ** 2))
    reduction = 1.0 - np.sqrt(now / was)
    above = 1.0 - np.sqrt(max(now - floor, 0.0) / max(was - floor, LEAST_EXCESS * floor))
    smaller = reduction >= LEAST_REDUCTION or above >= LEAST_ABOVE_FLOOR
    smaller = smaller or (reduction >= LEAST_OF_THE_CLEAR and p_value < CLEAR)
    return Proof(before, after, float(reduction), p_value, bool(smaller and p_value < LEVEL))


def held_out_errors(problem: Problem, fit: Fit) -> WindowErrors:
    """The gap of every window while it is held out: each third of the log in its turn, the model fitted to
    the rest.
    """
    others = [Problem.of(problem.drive, problem.shift_s + k * HELD_OUT_S) for k in (1, 2)]
    return joined([errors_of(problem, fit), *(errors_of(other, refitted(other, fit)) for other in others)])


def refitted(problem: Problem, fit: Fit) -> Fit:
    """The same effects fitted to another part of the log; when and where one acts stays, since the rows
    that show it may all be held out.
    """
    return gauss_newton(problem, fit.extension, fit.noise, 2, places=False)


def errors_of(problem: Problem, fit: Fit) -> WindowErrors:
    """The gap of the held-out windows."""
    windows = windows_within(problem, ~problem.train)
    return window_errors(problem.drive, fit.extension, windows, problem.variances)


def joined(parts: list[WindowErrors]) -> WindowErrors:
    """The windows of all folds."""
    return WindowErrors(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def blocks_p(folds: list[Fold]) -> float:
    """Wilcoxon's one-sided p that held-out blocks of 2 s, where the models differ, are predicted better."""
    gains = []
    for problem, without, with_it in folds:
        held_out = ~problem.train
        difference = (without.row_deviance - with_it.row_deviance)[held_out]
        block = np.unique(problem.drive.t_s[held_out] // BLOCK_S, return_inverse=True)[1]
        moved = np.abs(without.innovations - with_it.innovations)[held_out].sum(axis=1)
        gains.append(np.bincount(block, difference)[np.bincount(block, moved) > LEAST_MOVED])
    gained = np.concatenate(gains)
    return float(wilcoxon(gained, alternative="greater").pvalue) if len(gained) else 1.0


def moved_by(problem: Problem, without: Fit, with_it: Fit, seconds: float) -> float:
    """How far an effect moves the simulated path, m: root mean square over a window of ``seconds``, both
    paths from their own fitted starts, in the window where it moves it most.
    """
    drive = problem.drive
    windows = windows_of(drive, np.ones(len(drive), bool), seconds)
    paths = [
        simulated_path(drive, m.extension, windows, problem.variances)[:, :2] for m in (without, with_it)
    ]
    apart = ((paths[1] - paths[0]) ** 2).sum(axis=1)
    return max((float(np.sqrt(apart[a:b].mean())) for a, b in windows), default=0.0)


def together(errors: WindowErrors, unit: WindowErrors) -> F64:
    """Position and yaw gap of each window as one number."""
    return combined(errors.position_m, errors.yaw_rad, unit)


def floor_of(errors: WindowErrors, unit: WindowErrors) -> F64:
    """What measurement noise makes of that number."""
    return combined(errors.floor_m, errors.floor_rad, unit)


def combined(position_m: F64, yaw_rad: F64, unit: WindowErrors) -> F64:
    """√((p² + y²)/2), each in units of its typical gap."""
    position = position_m / np.sqrt(np.mean(unit.position_m**2))
    yaw = yaw_rad / np.sqrt(np.mean(unit.yaw_rad**2))
    return np.asarray(np.sqrt((position**2 + yaw**2) / 2))
