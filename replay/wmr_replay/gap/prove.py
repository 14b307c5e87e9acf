"""Proof on what was not fitted: the gap of the held-out windows with and without an effect, in pairs."""

from typing import NamedTuple

import numpy as np
from scipy.stats import wilcoxon

from wmr_replay.gap.predict import WindowErrors, window_errors, windows_of
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.refit import Fit
from wmr_schemas.arrays import F64, Bool

LEAST_REDUCTION, LEVEL = 0.10, 0.05
LEAST_ABOVE_FLOOR, LEAST_EXCESS = 0.30, 0.05
BLOCK_S = 2.0
MOST_SLIP = 0.05
LEAST_CHANGE = 0.02


class Proof(NamedTuple):
    """Root mean square gap before and after, over the windows in which the effect shows; whether it holds."""

    before: WindowErrors
    after: WindowErrors
    reduction: float
    p_value: float
    holds: bool
    changed_m: float


def windows_within(problem: Problem, chosen: Bool) -> list[tuple[int, int]]:
    """Whole windows of the rows ``chosen`` (n,). Where an identifier said the modes, windows that it calls
    slipping are left out: to simulate them would take its word for the loss of traction.
    """
    windows = windows_of(problem.drive, chosen)
    if problem.drive.margin <= 1:
        return windows
    slips = problem.drive.mode >= 2
    return [(a, b) for a, b in windows if np.mean(slips[a:b]) < MOST_SLIP] or windows


def prove(problem: Problem, without: Fit, with_it: Fit) -> Proof:
    """Compare two models on what was held out: ≥ 10 % less gap in the windows where they differ (or
    ≥ 30 % less of what stands above the noise floor), and a better prediction of its 2 s blocks (deviance, Wilcoxon's signed ranks, p < .05).

    Position and yaw count together, each in units of its typical gap without the effect.
    """
    windows = windows_within(problem, ~problem.train)
    before, after = (window_errors(problem.drive, m.extension, windows, problem.variances) for m in (without, with_it))
    a, b = together(before, before), together(after, before)
    shows = np.abs(a - b) > LEAST_CHANGE * np.maximum(a, b)
    p_value = blocks_p(problem, without, with_it)
    if not np.any(shows):
        return Proof(before, after, 0.0, p_value, False, 0.0)
    was, now = float(np.mean(a[shows] ** 2)), float(np.mean(b[shows] ** 2))
    floor = float(np.mean(floor_of(before, before)[shows] ** 2))
    reduction = 1.0 - np.sqrt(now / was)
    above = 1.0 - np.sqrt(max(now - floor, 0.0) / max(was - floor, LEAST_EXCESS * floor))
    changed = float(np.sqrt(np.mean(np.abs(before.position_m**2 - after.position_m**2))))
    smaller = reduction >= LEAST_REDUCTION or above >= LEAST_ABOVE_FLOOR
    return Proof(before, after, float(reduction), p_value, bool(smaller and p_value < LEVEL), changed)


def blocks_p(problem: Problem, without: Fit, with_it: Fit) -> float:
    """Wilcoxon's one-sided p that the held-out blocks of 2 s, where the models differ, are predicted better."""
    held_out = ~problem.train
    difference = without.row_deviance[held_out] - with_it.row_deviance[held_out]
    block = np.unique(problem.drive.t_s[held_out] // BLOCK_S, return_inverse=True)[1]
    gained = np.bincount(block, difference)
    differ = np.bincount(block, np.abs(without.innovations - with_it.innovations)[held_out].sum(axis=1)) > 0.5
    if not np.any(differ):
        return 1.0
    return float(wilcoxon(gained[differ], alternative="greater").pvalue)


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
