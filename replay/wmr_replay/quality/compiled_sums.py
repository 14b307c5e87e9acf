"""The monitors' sums, compiled: the bits of :mod:`wmr_replay.quality.plain_sums` in a third of the time."""

import math

import numpy as np

from wmr_replay.quality.sum_rules import (
    HUGE,
    LEAST_SPEED_MPS,
    LEAST_SPEED_SD,
    N_SUMS,
    REST_MPS,
    REST_SD,
    STEP_M,
    STEP_NUMBER,
    STEP_S,
    UNEVEN,
)
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.compiled.lean import lean


@lean
def add_up(values: F64, begins: I64, total: F64, edges: F64) -> None:
    """Carry the totals and counts (2 fields,) on over ``values`` (fields, n); to ``edges`` (2 fields, 1 + m)
    what they are before each of the rows ``begins`` (m,).
    """
    n_fields, n = values.shape
    n_cells = begins.shape[0]
    for field in range(n_fields):
        at, count, cell = total[field], total[n_fields + field], 0
        for row in range(n):
            if cell < n_cells and begins[cell] == row:
                cell += 1
                edges[field, cell], edges[n_fields + field, cell] = at, count
            if abs(values[field, row]) < HUGE:  # false for NaN
                at, count = at + values[field, row], count + 1.0
        total[field], total[n_fields + field] = at, count


@lean
def add_rows(measured: F64, wheels: F64, sums: F64, ends: I64, found: F64) -> int:
    """Add n rows to the ``sums`` (N_SUMS,): of a moving robot lengths, what is averaged over lengths, and the
    number of steps; turns; time at rest. Of each of the k steps that they complete: its last row to ``ends``
    (n,), the sums there to ``found`` (n, N_SUMS). Gives k.
    """
    n_found, before = 0, math.floor(sums[STEP_NUMBER])
    for i in range(measured.shape[1]):
        step_s, speed, v_long, v_lat = measured[0, i], measured[1, i], measured[2, i], measured[3, i]
        rate, sd_long, sd_lat, yaw = measured[4, i], measured[5, i], measured[6, i], measured[7, i]
        if not (math.isfinite(speed) and math.isfinite(rate)):
            continue
        sums[9] += rate * step_s
        if speed < REST_MPS or speed < REST_SD * sd_long:
            sums[10] += 0.0 if math.isnan(sd_long) else step_s
        if not (speed >= LEAST_SPEED_MPS and speed >= LEAST_SPEED_SD * sd_long):
            continue
        length_m, square = speed * step_s, speed * speed
        both = wheels[0, i] + wheels[1, i]
        both = 0.0 if math.isnan(both) else both
        sums[0] += length_m
        sums[1] += length_m if v_long < 0 else 0.0
        sums[2] += length_m if v_long * both < 0 else 0.0
        sums[3] += length_m if both != 0 else 0.0
        sums[4] += (v_long * v_long - v_lat * v_lat) / square * length_m
        sums[5] += 2 * v_long * v_lat / square * length_m
        sums[6] += yaw * length_m
        sums[7] += (sd_lat / speed) * (sd_lat / speed) * length_m
        sums[8] += rate * speed * length_m
        sums[STEP_NUMBER] += length_m / (STEP_M + STEP_S * speed)
        if math.floor(sums[STEP_NUMBER]) > before:
            before = math.floor(sums[STEP_NUMBER])
            ends[n_found] = i
            for k in range(N_SUMS):
                found[n_found, k] = sums[k]
            n_found += 1
    return n_found


@lean
def add_differences(
    columns: F64, usable_s: F64, rows: tuple[int, int, int], step_ns: float, sums: F64
) -> None:
    """To number and squares (3,) what rows t, x, y, yaw (4, n) add: those from a first one on, by a stride,
    each with the three before it at steps of m rows.
    """
    begin, stride, m = rows
    t, x, y, yaw = columns[0], columns[1], columns[2], columns[3]
    most_ns = UNEVEN * step_ns
    for d in range(begin, columns.shape[1], stride):
        a, b, c = d - 3 * m, d - 2 * m, d - m
        even = abs(t[b] - t[a] - step_ns) <= most_ns and abs(t[c] - t[b] - step_ns) <= most_ns
        if even and abs(t[d] - t[c] - step_ns) <= most_ns and usable_s[d] * NS_PER_S >= 3 * step_ns:
            across = x[d] - 3 * x[c] + 3 * x[b] - x[a]
            along = y[d] - 3 * y[c] + 3 * y[b] - y[a]
            turned = yaw[d] - 3 * yaw[c] + 3 * yaw[b] - yaw[a]
            sums[0] += 1.0
            sums[1] += (across * across / 20 + along * along / 20) / 2
            sums[2] += turned * turned / 20


@lean
def count_votes(bins: I64, below: I64, shares: F64, centres: F64, n: F64, quantiles: F64) -> None:
    """After each of the votes ``bins`` (m,): how many there are, (m,), and the ``quantiles`` (m, shares) of
    the histogram with the cumulative counts ``below`` (bins,), which is carried on; NaN without votes.
    """
    n_bins = below.shape[0]
    for cell in range(bins.shape[0]):
        if bins[cell] >= 0:
            for k in range(bins[cell], n_bins):
                below[k] += 1
        n[cell] = below[n_bins - 1]
        k = 0
        for q in range(shares.shape[0]):  # ascending
            while below[k] < shares[q] * n[cell]:
                k += 1
            quantiles[cell, q] = centres[k] if n[cell] > 0 else np.nan
