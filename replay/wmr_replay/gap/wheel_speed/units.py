"""Units of the hold-out: pieces of driving of a few seconds, every third of which is held out in turn."""

import numpy as np

from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_schemas.arrays import F64, I64, Bool

FOLDS = 3


def unit_of_bins(problem: Problem) -> I64:
    """Unit of each bin (n,): neighbouring blocks, slip among them, until they last ``unit_s`` together."""
    bins = problem.with_slip.bins
    seconds = bins.inside.sum(axis=1) * bins.step_s
    unit, number, sum_s = np.zeros(len(seconds), np.int64), 0, 0.0
    for k, length_s in enumerate(seconds):
        if sum_s >= problem.settings.gates.unit_s - bins.step_s / 2:
            number, sum_s = number + 1, 0.0
        unit[k], sum_s = number, sum_s + float(length_s)
    return np.where(bins.block_of >= 0, unit[np.maximum(bins.block_of, 0)], 0)


def unit_of_blocks(problem: Problem) -> I64:
    """Unit of each block (K,)."""
    return unit_of_bins(problem)[problem.bins.table[:, 0]]


def held_out_bins(problem: Problem, fold: int) -> Bool:
    """Bins (n,) of the units that ``fold`` (0, 1 or 2) holds out."""
    return np.asarray((unit_of_bins(problem) % FOLDS == fold) & (problem.with_slip.bins.block_of >= 0))


def sums(values: F64, unit: I64) -> F64:
    """Sums (u,) over units of values by block (K,)."""
    return np.asarray(np.bincount(unit, values), np.float64)
