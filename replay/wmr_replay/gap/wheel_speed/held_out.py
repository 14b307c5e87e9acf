"""Gaps of windows that were held out, and the noise of a pose."""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.path_error import WindowErrors
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_replay.gap.wheel_speed.units import FOLDS, unit_of_blocks
from wmr_replay.gap.wheel_speed.windows import Gaps, Windows, gaps_of
from wmr_schemas.arrays import F64, I64

ONE_SD = 0.6827
"""Share of a normal distribution within one standard deviation."""


class Folds(NamedTuple):
    """A model fitted to two thirds of the record, three times: its values by fold."""

    values: tuple[Values, ...]


def held_out_gaps(problem: Problem, windows: Windows, folds: Folds, pose_sd: tuple[float, float]) -> Gaps:
    """Every window with the values of the fold that held it out."""
    unit = unit_of_blocks(problem)
    fold_of = unit[windows.block] % FOLDS
    parts = [gaps_of(problem, windows, values, pose_sd) for values in folds.values]
    return Gaps(
        WindowErrors(*(picked([getattr(p.errors, f) for p in parts], fold_of) for f in WindowErrors._fields)),
        picked([p.end_m for p in parts], fold_of),
        picked([p.end_rad for p in parts], fold_of),
        picked([p.simulated for p in parts], fold_of),
    )


def averaged(problem: Problem, windows: Windows, gaps: Gaps, pose_sd: tuple[float, float]) -> WindowErrors:
    """The errors of windows, and their floors, with the poses of about a bin averaged: the noise of single
    poses would hide a gap that is smaller.
    """
    size = max(1, round(float(np.median(problem.bins.count))))
    starts = np.arange(0, windows.rows.shape[1], size)
    left = np.where(windows.inside, windows.take(problem.record.pose) - gaps.simulated, 0.0)
    count = np.add.reduceat(windows.inside.astype(np.int64), starts, axis=1)
    square = (np.add.reduceat(left, starts, axis=2) / np.maximum(count, 1)) ** 2
    n = np.maximum((count > 0).sum(axis=1), 2)
    position, yaw = (np.sqrt(part.sum(axis=-1) / n) for part in (square[0] + square[1], square[2]))
    kept = np.sqrt(1 - 1 / n) / np.sqrt(size)
    return WindowErrors(position, yaw, np.sqrt(2) * pose_sd[0] * kept, pose_sd[1] * kept, gaps.errors.start_s)


def picked(parts: list[F64], fold_of: I64) -> F64:
    """By window (…, W, …) the part of its fold; windows are the axis of that length."""
    axis = next(k for k, n in enumerate(parts[0].shape) if n == len(fold_of))
    shape = [1] * parts[0].ndim
    shape[axis] = len(fold_of)
    return np.asarray(np.choose(np.asarray(fold_of).reshape(shape), parts))


def pose_noise(problem: Problem) -> tuple[float, float]:
    """Standard deviation of a single pose, in x and y [m] and in yaw [rad], from third differences.

    White noise of sd s gives third differences of √20 s; motion of a robot gives hardly any. Two thirds of
    them lie within one standard deviation. No model enters.
    """
    record = problem.record
    stretch = record.stretch_of_pose
    inside = stretch[3:] == stretch[:-3]
    third = np.abs(np.diff(record.pose, 3, axis=1)[:, inside]) / np.sqrt(20)
    x, y, yaw = np.quantile(third, ONE_SD, axis=1) if third.size else np.zeros(3)
    return float(np.sqrt((x**2 + y**2) / 2)), float(yaw)
