"""The last good poses, with running sums: straight lines through any stretch of them in constant work.

``held`` is (12, c + 1): rows 0 to 3 are the samples' t (in s since an anchor), x, y and yaw; rows 4 to 11 are
Σt, Σt², Σz (3 rows) and Σtz (3 rows) over the samples before each, z counted from the first sample held. The
anchor moves on by half of the capacity whenever ``held`` is full, so that sums stay small, and at counts of
rows alone.
"""

import math

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64

CAPACITY = 2048
NOISE_ROWS = 500.0
CLIPPED_SQUARE = 0.9950072780344535
"""E[min(z², 9)] of a standard normal z."""


def fresh_track() -> F64:
    """Nothing held."""
    return np.zeros((12, CAPACITY + 1))


@njit(cache=True)
def put(held: F64, row: int, t_s: float, x_m: float, y_m: float, yaw_rad: float) -> None:
    """A sample and the sums behind it."""
    held[0, row], held[1, row], held[2, row], held[3, row] = t_s, x_m, y_m, yaw_rad
    held[4, row + 1], held[5, row + 1] = held[4, row] + t_s, held[5, row] + t_s * t_s
    for k in range(3):
        z = held[1 + k, row] - held[1 + k, 0]
        held[6 + k, row + 1], held[9 + k, row + 1] = held[6 + k, row] + z, held[9 + k, row] + t_s * z


@njit(cache=True)
def make_room(held: F64) -> float:
    """Drop the older half of a full track; the new anchor, in s since the old one."""
    half = CAPACITY // 2
    start: float = held[0, half]
    for row in range(half):
        old = row + half
        put(held, row, held[0, old] - start, held[1, old], held[2, old], held[3, old])
    return start


@njit(cache=True)
def follow_noise(held: F64, n: int, step_s: float, variances: F64) -> None:
    """s² ← s² + (min(d², 9 s²)/b − s²)/500 with the newest third difference d = (…)/√20 over regular steps.

    ``variances`` (2,) of position and yaw; n samples are held.
    """
    if n < 4:
        return
    for j in range(n - 3, n):
        if abs(held[0, j] - held[0, j - 1] - step_s) > 0.2 * step_s:
            return
    for k in range(1, 4):
        square = (held[k, n - 1] - 3.0 * held[k, n - 2] + 3.0 * held[k, n - 3] - held[k, n - 4]) ** 2 / 20.0
        i, gain = k // 3, (0.5 if k < 3 else 1.0) / NOISE_ROWS
        variances[i] += gain * (min(square, 9.0 * variances[i]) / CLIPPED_SQUARE - variances[i])


@njit(cache=True)
def line(held: F64, start: int, stop: int, at_s: float, out: F64) -> float:
    """Least-squares lines through the samples start … stop − 1: value and slope at ``at_s``, ``out`` (2, 3).

    Returns v in var = σ² v of the value, for white noise of variance σ²: 1/n + (t − t̄)²/Σ(t_k − t̄)².
    """
    n = stop - start
    mean = (held[4, stop] - held[4, start]) / n
    per_spread = 1.0 / (held[5, stop] - held[5, start] - n * mean * mean)
    ahead = at_s - mean
    for k in range(3):
        total = held[6 + k, stop] - held[6 + k, start]
        slope = (held[9 + k, stop] - held[9 + k, start] - mean * total) * per_spread
        out[0, k] = total / n + slope * ahead + held[1 + k, 0]
        out[1, k] = slope
    v: float = 1.0 / n + ahead * ahead * per_spread
    return v


@njit(cache=True)
def rate(lines: F64, turning: int) -> float:
    """Speed of a line in m/s, or its yaw rate in rad/s."""
    return abs(lines[1, 2]) if turning else math.sqrt(lines[1, 0] ** 2 + lines[1, 1] ** 2)
