"""The last good poses, with running sums: straight lines through any stretch of them in constant work.

``held`` is (c + 1, 12), a row for each sample: its t (in s since an anchor), x, y and yaw; then Σt, Σt², Σz
(3) and Σtz (3) over the samples before it, z counted from the first sample held. The anchor moves on by half
of the capacity whenever ``held`` is full, so that sums stay small, and at counts of rows alone.
"""

import math

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.clipping import clipped_update
from wmr_schemas.compiled.lean import lean

CAPACITY = 2048
NOISE_ROWS = 500.0
REGULAR = 0.2


def fresh_track() -> F64:
    """An empty track, (CAPACITY + 1, 12)."""
    return np.zeros((CAPACITY + 1, 12))


@lean
def put(held: F64, n: int, t_s: float, x_m: float, y_m: float, yaw_rad: float) -> None:
    """Write sample n and the sums up to it."""
    held[n, 0], held[n, 1], held[n, 2], held[n, 3] = t_s, x_m, y_m, yaw_rad
    x, y, yaw = x_m - held[0, 1], y_m - held[0, 2], yaw_rad - held[0, 3]
    held[n + 1, 4], held[n + 1, 5] = held[n, 4] + t_s, held[n, 5] + t_s * t_s
    held[n + 1, 6], held[n + 1, 7], held[n + 1, 8] = held[n, 6] + x, held[n, 7] + y, held[n, 8] + yaw
    held[n + 1, 9], held[n + 1, 10] = held[n, 9] + t_s * x, held[n, 10] + t_s * y
    held[n + 1, 11] = held[n, 11] + t_s * yaw


@lean
def make_room(held: F64) -> float:
    """Drop the older half of a full track; the new anchor, in s since the old one."""
    half = CAPACITY // 2
    start: float = held[half, 0]
    for row in range(half):
        old = row + half
        put(held, row, held[old, 0] - start, held[old, 1], held[old, 2], held[old, 3])
    return start


@lean
def is_regular(held: F64, n: int, step_s: float) -> bool:
    """Whether the last three steps are the nominal one."""
    most = REGULAR * step_s
    return bool(
        n >= 4
        and abs(held[n - 1, 0] - held[n - 2, 0] - step_s) <= most
        and abs(held[n - 2, 0] - held[n - 3, 0] - step_s) <= most
        and abs(held[n - 3, 0] - held[n - 4, 0] - step_s) <= most
    )


@lean
def followed(held: F64, n: int, k: int, variance: float, gain: float) -> float:
    """s² ← s² + (min(d², 9 s²)/b − s²) g/500 with the newest third difference d = (…)/√20 of column k."""
    difference = held[n - 1, k] - held[n - 4, k] + 3.0 * (held[n - 3, k] - held[n - 2, k])
    return clipped_update(variance, difference * difference * 0.05, gain / NOISE_ROWS)


@lean
def follow_noise(held: F64, n: int, step_s: float, variances: F64) -> None:
    """The ``variances`` (2,) of position and yaw after the newest of n samples held, over regular steps."""
    if is_regular(held, n, step_s):
        variances[0] = followed(held, n, 1, variances[0], 0.5)
        variances[0] = followed(held, n, 2, variances[0], 0.5)
        variances[1] = followed(held, n, 3, variances[1], 1.0)


@lean
def line(held: F64, start: int, stop: int, at_s: float, out: F64) -> float:
    """Least-squares lines through the samples start … stop − 1: value and slope at ``at_s``, ``out`` (2, 3).

    Returns v in var = σ² v of the value, for white noise of variance σ²: 1/n + (t − t̄)²/Σ(t_k − t̄)².
    """
    low, high, origin = held[start], held[stop], held[0]
    share = 1.0 / (stop - start)
    mean = (high[4] - low[4]) * share
    per_spread = 1.0 / (high[5] - low[5] - (high[4] - low[4]) * mean)
    ahead = at_s - mean
    for k in range(3):
        total = high[6 + k] - low[6 + k]
        slope = (high[9 + k] - low[9 + k] - mean * total) * per_spread
        out[0, k] = total * share + slope * ahead + origin[1 + k]
        out[1, k] = slope
    v: float = share + ahead * ahead * per_spread
    return v


@lean
def rate(lines: F64, turning: int) -> float:
    """Speed of a line in m/s, or its yaw rate in rad/s."""
    return abs(lines[1, 2]) if turning else math.sqrt(lines[1, 0] ** 2 + lines[1, 1] ** 2)
