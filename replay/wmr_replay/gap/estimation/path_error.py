"""How far a simulation runs from the measured path over windows of 4 s, its initial state fitted.

Each window is simulated from its own initial motion (x, y, yaw, v_long, w, v_lat), chosen by least squares
against the window's poses, with no disturbance; what is left is the gap.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.binned_log import Drive
from wmr_replay.gap.model.dynamics import N_MOTION, N_STATE, V_LAT, Base, Row, V, W, measured, skids, step
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled import compiled

WINDOW_S = 4.0
ROUNDS, TRIES = 8, 4


class WindowErrors(NamedTuple):
    """By window: root mean squares of position [m] and yaw [rad], and what measurement noise would give."""

    position_m: F64
    yaw_rad: F64
    floor_m: F64
    floor_rad: F64
    start_s: F64


@compiled
def residuals(z0: F64, rows: F64, poses: F64, theta: F64, base: Base, scale: F64, out: F64) -> None:
    """``out`` (3m,) ← (measured − simulated)/scale over a window's rows."""
    z, ahead, at = z0.copy(), np.zeros(N_STATE), np.zeros(3)
    for k in range(len(rows)):
        if k > 0:
            step(z, rows[k], theta, base, ahead)
            z[:] = ahead
        measured(z, rows[k], theta, at)
        for c in range(3):
            out[3 * k + c] = (poses[k, c] - at[c]) / scale[k, c]


@compiled
def fit_window(z0: F64, rows: F64, poses: F64, theta: F64, base: Base, scale: F64) -> F64:
    """Whitened residuals (m, 3) after the best initial motion; v_lat only where it starts in a skid."""
    m = len(rows)
    free = N_MOTION if skids(rows[0, Row.MODE], theta) else N_MOTION - 1
    z, damping = z0.copy(), 1e-6
    at, moved, A = np.empty(3 * m), np.empty(3 * m), np.empty((3 * m, free))
    residuals(z, rows, poses, theta, base, scale, at)
    for _ in range(ROUNDS):
        for j in range(free):
            other = z.copy()
            other[j] += 1e-6
            residuals(other, rows, poses, theta, base, scale, moved)
            A[:, j] = (at - moved) / 1e-6
        N, g, cost = A.T @ A, A.T @ at, np.sum(at**2)
        tried = z.copy()
        for _ in range(TRIES):
            damped = N.copy()
            for j in range(free):
                damped[j, j] += damping * N[j, j] + 1e-9
            tried[:free] = z[:free] + np.linalg.solve(damped, g)
            residuals(tried, rows, poses, theta, base, scale, moved)
            if np.sum(moved**2) < cost:
                break
            damping = max(damping, 1e-4) * 30
        if not np.sum(moved**2) < cost:
            break
        z[:] = tried
        at[:] = moved
        damping /= 10
        if np.sum(at**2) > 0.9999 * cost:
            break
    return at.reshape(m, 3).copy()


def windows_of(drive: Drive, chosen: Bool, seconds: float = WINDOW_S) -> list[tuple[int, int]]:
    """Rows [a, b) of each whole window within the runs of ``chosen`` (n,) rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(np.int8), [0]])))
    found = []
    for a, b in edges.reshape(-1, 2):
        start = a
        while start < b:
            end = int(np.searchsorted(drive.t_s, drive.t_s[start] + seconds - 0.06))
            if end > b or end == len(drive.t_s):
                break
            found.append((int(start), end))
            start = end
    return [(a, b) for a, b in found if np.max(np.diff(drive.t_s[a:b])) < 0.5]


def window_errors(
    drive: Drive, extension: Extension, windows: list[tuple[int, int]], variances: F64
) -> WindowErrors:
    """The gap of every window; ``variances`` (n, 3) weigh the poses and give the floor."""
    rows, theta, base = extension.rows(drive), extension.theta(), extension.base
    poses = extension.poses(drive)
    sd = np.sqrt(variances)
    position, yaw, floor, floor_yaw = [], [], [], []
    for a, b in windows:
        z0 = starting_motion(drive, a, base)
        left = fit_window(z0, rows[a:b], poses[a:b], theta, base, sd[a:b]) * sd[a:b]
        position.append(np.sqrt(np.mean(left[:, 0] ** 2 + left[:, 1] ** 2)))
        yaw.append(np.sqrt(np.mean(left[:, 2] ** 2)))
        kept = 1 - 5 / (3 * (b - a))
        floor.append(np.sqrt(kept * np.mean(2 * sd[a:b, 0] ** 2)))
        floor_yaw.append(np.sqrt(kept * np.mean(sd[a:b, 2] ** 2)))
    starts = np.array([drive.t_s[a] for a, _ in windows])
    return WindowErrors(np.array(position), np.array(yaw), np.array(floor), np.array(floor_yaw), starts)


def simulated_path(drive: Drive, extension: Extension, windows: list[tuple[int, int]], variances: F64) -> F64:
    """Poses (n, 3) simulated window by window, NaN between them."""
    rows, theta, base = extension.rows(drive), extension.theta(), extension.base
    poses = extension.poses(drive)
    sd, path = np.sqrt(variances), np.full((len(drive), 3), np.nan)
    for a, b in windows:
        z0 = starting_motion(drive, a, base)
        left = fit_window(z0, rows[a:b], poses[a:b], theta, base, sd[a:b]) * sd[a:b]
        path[a:b] = drive.pose[a:b] - left
    return path


def starting_motion(drive: Drive, a: int, base: Base) -> F64:
    """Pose and speeds at row ``a`` from the poses of the .4 s after it."""
    head = slice(a, a + 10)
    slopes = np.polyfit(drive.t_s[head] - drive.t_s[a], drive.pose[head], 1)
    z = np.zeros(N_STATE)
    z[:3] = slopes[1]
    cos, sin = np.cos(z[2]), np.sin(z[2])
    z[V] = slopes[0, 0] * cos + slopes[0, 1] * sin
    z[V_LAT] = 0.0 if drive.mode[a] not in (1.0, 3.0) else -slopes[0, 0] * sin + slopes[0, 1] * cos
    z[W] = slopes[0, 2] * base.half_track_m
    return z
