"""The gap: how far the simulated path runs from the measured one over windows of 4 s.

Stretches shorter than that are windows of their own length. The start of each window is fitted to its poses;
for the odometry error it is the first measured pose, and the error that at the window's end.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.path_error import WindowErrors
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_schemas.arrays import F64, I64, Bool

SHORT_SHARE = 0.5
"""Where less of the driving lies in stretches of a window's length, each stretch is a window."""
LEAST_SD = (0.002, 0.002)
"""Least weights' standard deviations of a pose in the fit of a start, m and rad."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Poses (W, L) of each window, −1 behind its end; ``seconds`` the windows' length; ``block`` (W,)."""

    rows: I64
    seconds: float
    block: I64

    @property
    def inside(self) -> Bool:
        """Places (W, L) that hold a pose."""
        return self.rows >= 0

    def take(self, values: F64) -> F64:
        """Values by pose (…, N) by window (…, W, L)."""
        return np.asarray(values[..., np.maximum(self.rows, 0)])

    def chosen(self, which: Bool) -> "Windows":
        """Some of the windows."""
        return Windows(self.rows[which], self.seconds, self.block[which])


def windows_of(problem: Problem, window_s: float) -> Windows:
    """Whole windows of ``window_s`` in the blocks; whole blocks where most are shorter."""
    bins = problem.bins
    lengths = bins.inside.sum(axis=1)
    wanted = max(2, round(window_s / bins.step_s))
    whole = problem.with_slip.bins.inside.sum(axis=1)
    short = not (lengths >= wanted).any() or float(whole[whole >= wanted].sum()) < SHORT_SHARE * whole.sum()
    found = []
    for k, length in enumerate(lengths):
        if short:
            found.append((k, 0, int(length)))
        else:
            found += [(k, a, a + wanted) for a in range(0, int(length) - wanted + 1, wanted)]
    ends = [(k, bins.table[k, a], bins.table[k, b - 1]) for k, a, b in found]
    poses = [np.arange(bins.start[a], bins.start[b] + bins.count[b]) for _, a, b in ends]
    rows = np.full((len(poses), max((len(p) for p in poses), default=0)), -1, np.int64)
    for w, own in enumerate(poses):
        rows[w, : len(own)] = own
    spans = [float(problem.record.pose_s[p[-1]] - problem.record.pose_s[p[0]]) for p in poses]
    return Windows(
        rows, float(np.median(spans)) if short and spans else window_s, np.array([k for k, _, _ in ends])
    )


class Simulated(NamedTuple):
    """Paths (3, W, L) x, y, yaw, each from the origin, heading along x."""

    path: F64


def rolled(windows: Windows, unrolled: F64) -> F64:
    """Paths (3, W, L) from the origin, of a predicted unrolled path (3, N)."""
    way = windows.take(unrolled)
    way = way - way[..., :1]
    step, yaw = np.diff(way[:2], axis=-1), way[2]
    step = np.where(windows.inside[:, 1:], step, 0.0)
    middle = (yaw[:, 1:] + yaw[:, :-1]) / 2
    cos, sin = np.cos(middle), np.sin(middle)
    moved = np.stack([cos * step[0] - sin * step[1], sin * step[0] + cos * step[1]])
    path = np.concatenate([np.zeros((2, len(yaw), 1)), np.cumsum(moved, axis=-1)], axis=-1)
    return np.concatenate([path, yaw[None]])


def placed(path: F64, start: F64) -> F64:
    """Paths (3, W, L) from start poses (3, W)."""
    cos, sin = np.cos(start[2])[:, None], np.sin(start[2])[:, None]
    x = start[0][:, None] + cos * path[0] - sin * path[1]
    y = start[1][:, None] + sin * path[0] + cos * path[1]
    return np.stack([x, y, start[2][:, None] + path[2]])


def fitted_start(windows: Windows, path: F64, measured: F64, sd: tuple[float, float]) -> F64:
    """Start poses (3, W) of least squares between the paths and the measured poses (3, W, L)."""
    weight = windows.inside / np.array([sd[0] ** 2, sd[0] ** 2, sd[1] ** 2])[:, None, None]
    start = measured[:, :, 0].copy()
    for _ in range(4):
        at = placed(path, start)
        left = (measured - at) * weight
        turn = np.stack([-(at[1] - start[1][:, None]), at[0] - start[0][:, None], np.ones_like(at[0])])
        g = np.stack([left[0].sum(1), left[1].sum(1), (left * turn).sum(axis=(0, 2))], axis=1)
        A = np.zeros((len(g), 3, 3))
        for c in range(2):
            A[:, c, c] = weight[c].sum(1)
            A[:, c, 2] = A[:, 2, c] = (weight[c] * turn[c]).sum(1)
        A[:, 2, 2] = (weight * turn**2).sum(axis=(0, 2))
        start = start + np.linalg.solve(A, g[..., None])[..., 0].T
    return start


class Gaps(NamedTuple):
    """Errors by window and the odometry error at each window's end; the simulated poses (3, W, L)."""

    errors: WindowErrors
    end_m: F64
    end_rad: F64
    simulated: F64


def gaps_of(problem: Problem, windows: Windows, values: Values, pose_sd: tuple[float, float]) -> Gaps:
    """The gap of every window with effects; ``pose_sd`` [m, rad] is that of a pose, for the floor."""
    record = problem.record
    path = rolled(windows, problem.predicted_at_poses(values))
    measured, inside = windows.take(record.pose), windows.inside
    sd = (max(pose_sd[0], LEAST_SD[0]), max(pose_sd[1], LEAST_SD[1]))
    simulated = placed(path, fitted_start(windows, path, measured, sd))
    left, n = np.where(inside, measured - simulated, 0.0), inside.sum(axis=1)
    kept = np.sqrt(1 - 3 / (3 * n))
    errors = WindowErrors(
        np.sqrt((left[0] ** 2 + left[1] ** 2).sum(axis=1) / n),
        np.sqrt((left[2] ** 2).sum(axis=1) / n),
        np.sqrt(2) * pose_sd[0] * kept,
        pose_sd[1] * kept,
        record.pose_s[windows.rows[:, 0]],
    )
    last = n - 1
    each = np.arange(len(n))
    reckoned = placed(path, measured[:, :, 0])[:, each, last] - measured[:, each, last]
    return Gaps(errors, np.hypot(reckoned[0], reckoned[1]), np.abs(wrapped(reckoned[2])), simulated)


def wrapped(angle_rad: F64) -> F64:
    """Angles in [−π, π)."""
    return np.asarray((angle_rad + np.pi) % (2 * np.pi) - np.pi)
