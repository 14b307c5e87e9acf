"""Bins: means over short intervals on a fixed grid in time, without outliers.

The mean over an interval is the first iterated integral of the algebraic kernels. It keeps the information of
the rows where the interval is short against the motion, and makes 40 rows at 1 kHz one equation.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.algebraic.rules import RULES
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.compiled import compiled

COUNT, T, POSE, IMPULSE, VARIANCES, N_SUMS = 0, 1, 2, 5, 8, 11
NONE_NS = 2**62


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


def empty_bins() -> Bins:
    """The state before the first row."""
    return Bins(
        np.zeros(N_SUMS), np.zeros(3), np.zeros(3), np.full(5, NONE_NS, np.int64), np.zeros(1, np.int64)
    )


@compiled
def begin_at(bins: Bins, rows: Measured, i: int) -> None:
    """Start the grid of bins at row i, the log's first."""
    bins.stamps_ns[:] = rows.t_ns[i]
    bins.accepted[:] = rows.pose[:, i]
    reopen(bins, rows.t_ns[i])


@compiled
def discard_open_bin(bins: Bins, rows: Measured, i: int) -> None:
    """Empty the open bin: the pose has jumped before row i."""
    bins.sums[:] = 0.0
    bins.accepted[:] = rows.pose[:, i]


@compiled
def beyond(away: float, moved: float, variance: float) -> bool:
    """Whether a distance is more than noise (6 sd of a difference) and motion explain."""
    rest = away - moved
    return bool(rest > 0.0 and rest * rest > 2.0 * RULES.outlier_sd**2 * variance)


@compiled
def fill_bin(
    bins: Bins, rows: Measured, i: int, speed_mps: float, turn_radps: float, outliers: Bool
) -> tuple[int, int]:
    """Rows from i on into the open bin, until it is full, ends, or the pose jumps; row i does belong there.

    Returns the first row not taken up, and the stamp expected of it: with a step as long as the shorter of
    the last two. A bin in which that does not lie is full. The impulse up to a row comes from the efforts'
    mean over the interval that ends with it. A row is outlying when it is further from the last accepted one
    than noise and twice the present motion explain; after five such rows in a row the pose has jumped: the
    row is accepted, and the bin restarts with it.
    """
    sums, impulse, accepted, stamps = bins.sums, bins.impulse, bins.accepted, bins.stamps_ns
    speed, turn = 2.0 * abs(speed_mps) + RULES.margin_mps, 2.0 * abs(turn_radps) + RULES.margin_radps
    start_ns, last_ns, end_ns, accepted_ns = stamps[0], stamps[1], stamps[2], stamps[3]
    n_far = bins.outliers[0]
    along, around, silent_s = impulse[0], impulse[1], impulse[2]
    x, y, yaw = accepted[0], accepted[1], accepted[2]
    earlier_ns, step_ns, next_ns, first = 0, stamps[4], stamps[2] - 1, i
    while (
        i < len(rows.t_ns)
        and rows.t_ns[i] < end_ns
        and next_ns < end_ns
        and (i == first or not rows.restarts[i])
    ):
        t_ns = rows.t_ns[i]
        earlier_ns, step_ns = step_ns, t_ns - last_ns
        next_ns = t_ns + min(earlier_ns, step_ns)
        step_s, left, right = (t_ns - last_ns) * 1e-9, rows.efforts[0, i], rows.efforts[1, i]
        if np.isnan(left + right):
            silent_s += step_s
        else:
            along += (right + left) * step_s
            around += (right - left) * step_s
        last_ns = t_ns
        dt_s = (t_ns - accepted_ns) * 1e-9
        at_x, at_y, at_yaw = rows.pose[0, i], rows.pose[1, i], rows.pose[2, i]
        position, turning = rows.variances[0, i], rows.variances[1, i]
        far = beyond(max(abs(at_x - x), abs(at_y - y)), speed * dt_s, position)
        far = far or beyond(abs(at_yaw - yaw), turn * dt_s, turning)
        n_far = n_far + 1 if far else 0
        if n_far > RULES.max_outliers:
            sums[:] = 0.0
            n_far, far = 0, False
        outliers[i] = far
        i += 1
        if not far:
            x, y, yaw, accepted_ns = at_x, at_y, at_yaw, t_ns
            sums[COUNT] += 1.0
            sums[T] += (t_ns - start_ns) * 1e-9
            sums[POSE] += x
            sums[POSE + 1] += y
            sums[POSE + 2] += yaw
            sums[IMPULSE] += along
            sums[IMPULSE + 1] += around
            sums[IMPULSE + 2] += silent_s
            sums[VARIANCES] += position
            sums[VARIANCES + 2] += turning
    sums[VARIANCES + 1] = sums[VARIANCES]
    stamps[1], stamps[3], stamps[4], bins.outliers[0] = last_ns, accepted_ns, step_ns, n_far
    impulse[0], impulse[1], impulse[2] = along, around, silent_s
    accepted[0], accepted[1], accepted[2] = x, y, yaw
    return i, next_ns


@compiled
def opens_after(bins: Bins, t_ns: int) -> bool:
    """Whether a row belongs to a later bin than the open one."""
    return bool(t_ns >= bins.stamps_ns[2])


@compiled
def reopen(bins: Bins, t_ns: int) -> None:
    """The bin in which ``t_ns`` lies is the open one, and empty."""
    start_ns = bins.stamps_ns[0]
    bins.stamps_ns[2] = start_ns + ((t_ns - start_ns) // RULES.bin_ns + 1) * RULES.bin_ns
    bins.sums[:] = 0.0


@compiled
def means(bins: Bins) -> F64:
    """The open bin's means, (11,); in the place of the rows' variances, those of the mean pose."""
    out = np.empty(N_SUMS)
    for c in range(N_SUMS):
        out[c] = bins.sums[c] / bins.sums[COUNT]
        if c >= VARIANCES:
            out[c] = out[c] / bins.sums[COUNT] + RULES.min_sd**2
    return out
