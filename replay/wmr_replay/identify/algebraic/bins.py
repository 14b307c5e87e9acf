"""Rows to bins: means over short intervals on a fixed grid in time, without outliers.

The mean over an interval is the first iterated integral of the algebraic kernels; it loses nothing that
matters when the interval is short against the motion, and makes 40 rows at 1 kHz one equation.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64, I64, Bool

BIN_NS = 40_000_000
COUNT, T, POSE, IMPULSE, VARIANCES, N_SUMS = 0, 1, 2, 5, 8, 11
OUTLIER_SD, MAX_OUTLIERS = 6.0, 5
MARGIN_MPS, MARGIN_RADPS = 1.0, 1.0
NONE_NS = 2**62
MIN_SD = 1e-4
"""No pose is trusted beyond .1 mm and .1 mrad."""


class Bins(NamedTuple):
    """The open bin, and what leads up to it.

    ``sums`` (11,) of rows, stamp in s since the first row, pose (3), impulse (3), variances (3).
    ``impulse`` (3,) is ∫ left + right dt, ∫ right − left dt and the seconds without a torque, since the first
    row; its mean over a bin is the torque's share in the bin's mean velocity, exactly. ``accepted`` (3,) is
    the last pose that was no outlier; ``stamps_ns`` (5,) are the first row, the last, the open bin's end, the
    last accepted, and the length of the last step; ``outliers`` (1,) how many came in a row.
    """

    sums: F64
    impulse: F64
    accepted: F64
    stamps_ns: I64
    outliers: I64


class Measured(NamedTuple):
    """Rows: stamps (n,), pose (3, n), efforts left and right (2, n), variances of position and yaw (2, n),
    and where the pose has jumped (n,).
    """

    t_ns: I64
    pose: F64
    efforts: F64
    variances: F64
    restarts: Bool


def no_bins() -> Bins:
    """Nothing seen yet."""
    return Bins(
        np.zeros(N_SUMS), np.zeros(3), np.zeros(3), np.full(5, NONE_NS, np.int64), np.zeros(1, np.int64)
    )


@njit(cache=True)
def drive(bins: Bins, rows: Measured, i: int) -> None:
    """The impulse up to a row, from the efforts' mean over the interval that ends with it."""
    t_ns = rows.t_ns[i]
    if bins.stamps_ns[0] == NONE_NS:
        bins.stamps_ns[:] = t_ns
        bins.accepted[:] = rows.pose[:, i]
        reopen(bins, t_ns)
    step_s, left, right = (t_ns - bins.stamps_ns[1]) * 1e-9, rows.efforts[0, i], rows.efforts[1, i]
    if np.isnan(left + right):
        bins.impulse[2] += step_s
    else:
        bins.impulse[0] += (right + left) * step_s
        bins.impulse[1] += (right - left) * step_s


@njit(cache=True)
def outlying(bins: Bins, rows: Measured, i: int, speed_mps: float, turn_radps: float) -> bool:
    """Whether a row is further from the last accepted one than noise (6 sd) and twice the present motion
    explain.

    After five such rows in a row the pose has jumped: the row is accepted, the open bin forgotten.
    """
    dt_s, pose, variances = (rows.t_ns[i] - bins.stamps_ns[3]) * 1e-9, rows.pose, rows.variances
    reach_m = OUTLIER_SD * np.sqrt(2.0 * variances[0, i]) + (2.0 * abs(speed_mps) + MARGIN_MPS) * dt_s
    reach_rad = OUTLIER_SD * np.sqrt(2.0 * variances[1, i]) + (2.0 * abs(turn_radps) + MARGIN_RADPS) * dt_s
    far = bool(
        abs(pose[0, i] - bins.accepted[0]) > reach_m
        or abs(pose[1, i] - bins.accepted[1]) > reach_m
        or abs(pose[2, i] - bins.accepted[2]) > reach_rad
    )
    bins.outliers[0] = bins.outliers[0] + 1 if far else 0
    if bins.outliers[0] > MAX_OUTLIERS:
        bins.outliers[0] = 0
        bins.sums[:] = 0.0
        return False
    return far


@njit(cache=True)
def forget(bins: Bins, rows: Measured, i: int) -> None:
    """The pose has jumped before row i: what the open bin holds of it is worth nothing."""
    bins.sums[:] = 0.0
    bins.accepted[:] = rows.pose[:, i]


@njit(cache=True)
def add(bins: Bins, rows: Measured, i: int) -> None:
    """One row into the open bin."""
    sums, impulse, accepted, pose = bins.sums, bins.impulse, bins.accepted, rows.pose
    position, yaw = rows.variances[0, i], rows.variances[1, i]
    sums[COUNT] += 1.0
    sums[T] += (rows.t_ns[i] - bins.stamps_ns[0]) * 1e-9
    for c in range(3):
        sums[POSE + c] += pose[c, i]
        sums[IMPULSE + c] += impulse[c]
        accepted[c] = pose[c, i]
    sums[VARIANCES] += position
    sums[VARIANCES + 1] += position
    sums[VARIANCES + 2] += yaw
    bins.stamps_ns[3] = rows.t_ns[i]


@njit(cache=True)
def opens_after(bins: Bins, t_ns: int) -> bool:
    """Whether a row belongs to a later bin than the open one."""
    return bool(t_ns >= bins.stamps_ns[2])


@njit(cache=True)
def foreseen(bins: Bins, t_ns: int) -> int:
    """The next row's stamp, if its step is as long as the shorter of the last two; remembers this row."""
    step_ns = t_ns - bins.stamps_ns[1]
    next_ns = int(t_ns + min(step_ns, bins.stamps_ns[4]))
    bins.stamps_ns[1], bins.stamps_ns[4] = t_ns, step_ns
    return next_ns


@njit(cache=True)
def reopen(bins: Bins, t_ns: int) -> None:
    """The bin in which ``t_ns`` lies is the open one, and empty."""
    start_ns = bins.stamps_ns[0]
    bins.stamps_ns[2] = start_ns + ((t_ns - start_ns) // BIN_NS + 1) * BIN_NS
    bins.sums[:] = 0.0


@njit(cache=True)
def means(bins: Bins) -> F64:
    """The open bin's means, (11,); in the place of the rows' variances, those of the mean pose."""
    out = np.empty(N_SUMS)
    for c in range(N_SUMS):
        out[c] = bins.sums[c] / bins.sums[COUNT]
        if c >= VARIANCES:
            out[c] = out[c] / bins.sums[COUNT] + MIN_SD**2
    return out
