"""The monitors' sums without a compiler, for a look at a log where nothing is compiled yet.

Every sum runs on from row to row, so that no batch changes a bit of it.
"""

import numpy as np

from wmr_replay.quality.sum_rules import (
    HUGE,
    LEAST_SPEED_MPS,
    LEAST_SPEED_SD,
    REST_MPS,
    REST_SD,
    STEP_M,
    STEP_NUMBER,
    STEP_S,
    UNEVEN,
)
from wmr_schemas.arrays import F64, I64, NS_PER_S


def add_up(values: F64, begins: I64, total: F64, edges: F64) -> None:
    """Carry the totals and counts (2 fields,) on over ``values`` (fields, n); to ``edges`` (2 fields, 1 + m)
    what they are before each of the rows ``begins`` (m,).
    """
    known = np.abs(values) < HUGE  # false for NaN
    totals = run_on(total, np.concatenate([np.where(known, values, 0.0), known]))
    edges[:, 1:], total[:] = totals[:, begins], totals[:, -1]


def add_rows(measured: F64, wheels: F64, sums: F64, ends: I64, found: F64) -> int:
    """Add n rows to the ``sums`` (N_SUMS,): of a moving robot lengths, what is averaged over lengths, and the
    number of steps; turns; time at rest. Of each of the k steps that they complete: its last row to ``ends``
    (n,), the sums there to ``found`` (n, N_SUMS). Gives k.
    """
    step_s, speed, v_long, v_lat, rate, sd_long, sd_lat, yaw = measured
    known = np.isfinite(speed) & np.isfinite(rate)
    moving = known & (speed >= np.maximum(LEAST_SPEED_MPS, LEAST_SPEED_SD * sd_long))
    resting = known & (speed < np.maximum(REST_MPS, REST_SD * sd_long))
    safe, both = np.where(moving, speed, 1.0), np.nan_to_num(wheels[0] + wheels[1])
    per_m = np.stack([
        np.ones_like(speed), v_long < 0, v_long * both < 0, both != 0, (v_long**2 - v_lat**2) / safe**2,
        2 * v_long * v_lat / safe**2, yaw, (sd_lat / safe) ** 2, rate * speed,
    ])  # fmt: skip
    added = np.where(moving, per_m * (speed * step_s), 0.0)
    turned, rest_s = np.where(known, rate * step_s, 0.0), np.where(resting, step_s, 0.0)
    totals = run_on(sums, np.concatenate([added, [turned, rest_s, added[0] / (STEP_M + STEP_S * safe)]]))
    rows = np.flatnonzero(np.diff(np.floor(totals[STEP_NUMBER])) > 0)
    ends[: len(rows)], found[: len(rows)], sums[:] = rows, totals[:, rows + 1].T, totals[:, -1]
    return len(rows)


def add_differences(
    columns: F64, usable_s: F64, rows: tuple[int, int, int], step_ns: float, sums: F64
) -> None:
    """To number and squares (3,) what rows t, x, y, yaw (4, n) add: those from a first one on, by a stride,
    each with the three before it at steps of m rows.
    """
    begin, stride, m = rows
    last = np.arange(begin, columns.shape[1], stride)
    a, b, c, d = (columns[:, last - k * m] for k in (3, 2, 1, 0))
    near = [
        np.abs(late[0] - early[0] - step_ns) <= UNEVEN * step_ns for early, late in ((a, b), (b, c), (c, d))
    ]
    even = near[0] & near[1] & near[2] & (usable_s[last] * NS_PER_S >= 3 * step_ns)
    third = d[1:] - 3 * c[1:] + 3 * b[1:] - a[1:]
    square = np.where(even, third**2 / 20, 0.0)
    sums[:] = run_on(sums, np.stack([even, (square[0] + square[1]) / 2, square[2]]))[:, -1]


def count_votes(bins: I64, below: I64, shares: F64, centres: F64, n: F64, quantiles: F64) -> None:
    """After each of the votes ``bins`` (m,): how many there are, (m,), and the ``quantiles`` (m, shares) of
    the histogram with the cumulative counts ``below`` (bins,), which is carried on; NaN without votes.
    """
    counted = (bins[:, None] <= np.arange(len(below))) & (bins[:, None] >= 0)
    counts = np.cumsum(np.concatenate([below[None], counted]), axis=0)
    below[:], n[:] = counts[-1], counts[1:, -1]
    for k, share in enumerate(shares):
        place = np.argmax(counts[1:] >= share * n[:, None], axis=1)
        quantiles[:, k] = np.where(n > 0, centres[place], np.nan)


def run_on(sums: F64, added: F64) -> F64:
    """The ``sums`` (k,) and what they are behind each of n rows, (k, 1 + n)."""
    return np.cumsum(np.concatenate([sums[:, None], added], axis=1), axis=1)
