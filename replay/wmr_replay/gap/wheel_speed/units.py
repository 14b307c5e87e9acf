"""Units of the hold-out: pieces of driving of a few seconds, every third of which is held out in turn."""

import numpy as np

from wmr_replay.gap.settings.wheel_speed import WheelSpeedSettings
from wmr_replay.gap.wheel_speed.bins import Bins
from wmr_schemas.arrays import F64, I64, Bool

FOLDS = 3


def unit_of_blocks(bins: Bins, settings: WheelSpeedSettings) -> I64:
    """Unit of each block (K,): neighbouring blocks until they last ``unit_s`` together."""
    seconds = bins.inside.sum(axis=1) * bins.step_s
    unit, number, sum_s = np.zeros(len(seconds), np.int64), 0, 0.0
    for k, length_s in enumerate(seconds):
        if sum_s >= settings.gates.unit_s - bins.step_s / 2:
            number, sum_s = number + 1, 0.0
        unit[k], sum_s = number, sum_s + float(length_s)
    return unit


def held_out_bins(bins: Bins, unit: I64, fold: int) -> Bool:
    """Bins (n,) of the units that ``fold`` (0, 1 or 2) holds out."""
    return np.where(bins.block_of >= 0, unit[np.maximum(bins.block_of, 0)] % FOLDS == fold, False)


def sums(values: F64, unit: I64) -> F64:
    """Sums (u,) over units of values by block (K,)."""
    return np.asarray(np.bincount(unit, values), np.float64)
