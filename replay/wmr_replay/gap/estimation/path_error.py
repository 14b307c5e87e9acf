"""The gap: how far a simulation runs from the measured path over windows of 4 s.

Each window is simulated without a disturbance from its own initial motion (x, y, yaw, v_long, w, v_lat),
which is fitted to the window's poses by least squares. The residual is the gap.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from wmr_replay.effects.measurement import yaw_error
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dynamics import N_MOTION, N_STATE, V_LAT, Base, Row, V, W, measured, skids, step
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled.lean import lean
from wmr_schemas.lapack import routines
from wmr_schemas.modes import ContactMode

Windows = list[tuple[int, int]]
"""Rows [a, b) of each window."""
WindowResidual = tuple[tuple[int, int], F64, F64]
"""A window's rows, measured − simulated (m, 3) in m and rad, and the poses' sd (m, 3)."""


class WindowErrors(NamedTuple):
    """By window (m,): root mean square gap in position [m] and yaw [rad], the same of measurement noise alone
    (the floor), and the start [s].
    """

    position_m: F64
    yaw_rad: F64
    floor_m: F64
    floor_rad: F64
    start_s: F64


class Window(NamedTuple):
    """A window of m rows: inputs (m, 11), poses (m, 3) and their standard deviations (m, 3); the model."""

    rows: F64
    poses: F64
    scale: F64
    theta: F64
    base: Base


@lean
def residuals(z0: F64, window: Window, z: F64, ahead: F64, out: F64) -> float:
    """``out`` (3m,) ← (measured − simulated)/scale from the motion ``z0`` (9,) on; returns Σ out².

    ``z`` and ``ahead`` (9,) are scratch.
    """
    rows, poses, scale, theta, base = window.rows, window.poses, window.scale, window.theta, window.base
    for i in range(N_STATE):
        z[i] = z0[i]
    total = 0.0
    for k in range(len(rows)):
        if k > 0:
            step(z, rows[k], theta, base, ahead)
            for i in range(N_STATE):
                z[i] = ahead[i]
        at = out[3 * k : 3 * k + 3]
        measured(z, rows[k], theta, at)
        for c in range(3):
            at[c] = (poses[k, c] - at[c]) / scale[k, c]
            total += at[c] * at[c]
    return total


def solved(N: F64, g: F64) -> F64:
    """N⁻¹ g. Raises LinAlgError where N is singular or not finite."""
    _, _, x, failed = routines("_flapack").dgesv(N, g)
    if failed or not np.isfinite(N).all():
        raise np.linalg.LinAlgError("the normal equations of a window are singular or not finite")
    return np.asarray(x)


def fit_window(z0: F64, window: Window, rounds: int, tries: int) -> tuple[F64, F64]:
    """The best initial motion (9,) and the whitened residuals (m, 3) there, by Levenberg–Marquardt from
    ``z0`` (9,).

    v_lat is free only where the window starts in a skid. A simulation that runs away stays far off.
    ``rounds`` bounds the steps, ``tries`` the dampings tried in each. Products and solution come from scipy's
    BLAS and LAPACK; numpy's round differently.
    """
    m, blas = len(window.rows), routines("_fblas")
    free = N_MOTION if skids(window.rows[0, Row.MODE], window.theta) else N_MOTION - 1
    z, damping, scratch = z0.copy(), 1e-6, (np.zeros(N_STATE), np.zeros(N_STATE))
    at, moved, A = np.empty(3 * m), np.empty(3 * m), np.empty((3 * m, free))
    cost = residuals(z, window, *scratch, at)
    for _ in range(rounds):
        for j in range(free):
            other = z.copy()
            other[j] += 1e-6
            residuals(other, window, *scratch, moved)
            A[:, j] = (at - moved) / 1e-6
        N, g = blas.dgemm(1.0, A.T, A.T, trans_b=True), blas.dgemv(1.0, A.T, at)
        tried, lower = z.copy(), False
        for _ in range(tries):
            damped = N.copy()
            for j in range(free):
                damped[j, j] += damping * N[j, j] + 1e-9
            if not np.isfinite(damped).all():
                break
            tried[:free] = z[:free] + solved(damped, g)
            new_cost = residuals(tried, window, *scratch, moved)
            lower = new_cost < cost
            if lower:
                break
            damping = max(damping, 1e-4) * 30
        if not lower:
            break
        converged = new_cost > 0.9999 * cost
        z, at, moved, cost = tried, moved, at, new_cost
        damping /= 10
        if converged:
            break
    return z, at.reshape(m, 3).copy()


def windows_of(binned: BinnedLog, chosen: Bool, seconds: float | None = None) -> Windows:
    """The whole windows of ``seconds`` (default: the settings') in the runs of ``chosen`` (n,) rows."""
    own = binned.settings.windows
    seconds = own.window_s if seconds is None else seconds
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(np.int8), [0]])))
    found = []
    for a, b in edges.reshape(-1, 2):
        start = a
        while start < b:
            end = int(np.searchsorted(binned.t_s, binned.t_s[start] + seconds - own.slack_s))
            if end > b or end == len(binned.t_s):
                break
            found.append((int(start), end))
            start = end
    return [(a, b) for a, b in found if np.max(np.diff(binned.t_s[a:b])) < own.longest_hole_s]


def window_errors(binned: BinnedLog, extension: Extension, windows: Windows) -> WindowErrors:
    """The gap of every window. The scatter of the binned log weighs the poses and gives the floor."""
    return summed(binned, window_residuals(binned, extension, windows))


def summed(binned: BinnedLog, residuals: Iterable[WindowResidual]) -> WindowErrors:
    """Root mean squares of the residuals of each window."""
    position, yaw, floor, floor_yaw, starts = [], [], [], [], []
    for (a, b), left, sd in residuals:
        starts.append(binned.t_s[a])
        position.append(np.sqrt(np.mean(left[:, 0] ** 2 + left[:, 1] ** 2)))
        yaw.append(np.sqrt(np.mean(left[:, 2] ** 2)))
        kept = 1 - 5 / (3 * (b - a))
        floor.append(np.sqrt(kept * np.mean(2 * sd[:, 0] ** 2)))
        floor_yaw.append(np.sqrt(kept * np.mean(sd[:, 2] ** 2)))
    return WindowErrors(*map(np.array, (position, yaw, floor, floor_yaw, starts)))


def simulated_path(binned: BinnedLog, extension: Extension, windows: Windows) -> F64:
    """Poses (n, 3) simulated window by window, NaN between them."""
    path = np.full((len(binned), 3), np.nan)
    for (a, b), left, _ in window_residuals(binned, extension, windows):
        path[a:b] = binned.pose[a:b] - left
    return path


def window_residuals(binned: BinnedLog, extension: Extension, windows: Windows) -> Iterator[WindowResidual]:
    """The residuals of each window, simulated from its own fitted start."""
    own = binned.settings.windows
    for (a, b), window in zip(windows, cut(binned, extension, windows), strict=True):
        start = starting_motion(binned, a, extension.base, turned_rad(window))
        _, whitened = fit_window(start, window, own.rounds, own.tries)
        yield (a, b), near(whitened, own.far_sd) * window.scale, window.scale


def cut(binned: BinnedLog, extension: Extension, windows: Windows) -> Iterator[Window]:
    """What each window is simulated from."""
    rows, theta, base = extension.rows(binned), extension.theta(), extension.base
    poses, sd = extension.poses(binned), np.sqrt(binned.scatter)
    for a, b in windows:
        yield Window(rows[a:b], poses[a:b], sd[a:b], theta, base)


def near(whitened: F64, far_sd: float) -> F64:
    """Whitened residuals, those of a simulation that runs away at ``far_sd``."""
    return np.clip(np.nan_to_num(whitened, nan=far_sd), -far_sd, far_sd)


def moved_path(
    binned: BinnedLog, without: Extension, with_it: Extension, windows: Windows, *, same_start: bool
) -> float:
    """How far an effect moves the simulated path, m: the largest distance of the two paths in a window, each
    from its own fitted start, or both from that of the model with it.
    """
    own, farthest = binned.settings.windows, 0.0
    cuts = (cut(binned, model, windows) for model in (without, with_it))
    for (a, _), before, after in zip(windows, *cuts, strict=True):
        start = starting_motion(binned, a, with_it.base, turned_rad(after))
        z, there = fit_window(start, after, own.rounds, own.tries)
        if same_start:
            other = simulated(z, before)
        else:
            start = starting_motion(binned, a, without.base, turned_rad(before))
            _, other = fit_window(start, before, own.rounds, own.tries)
        apart = (near(other, own.far_sd) - near(there, own.far_sd)) * after.scale
        farthest = max(farthest, float(np.hypot(*apart[:, :2].T).max()))
    return farthest


def simulated(z0: F64, window: Window) -> F64:
    """Whitened residuals (m, 3) of a window simulated from the motion ``z0`` (9,)."""
    left = np.empty(3 * len(window.rows))
    residuals(z0, window, np.zeros(N_STATE), np.zeros(N_STATE), left)
    return left.reshape(-1, 3)


def error_growth(binned: BinnedLog, extension: Extension, windows: Windows) -> F64:
    """How many times as far as a wheel's free roll a small error of the turning speed at its start turns the
    simulation of each window (m,) by its end: Δyaw l/(Δw T), with T the window's length.
    """
    nudge_mps, l = binned.settings.windows.nudge_mps, extension.base.half_track_m
    grown = np.zeros(len(windows))
    for k, ((a, b), window) in enumerate(zip(windows, cut(binned, extension, windows), strict=True)):
        start = starting_motion(binned, a, extension.base, turned_rad(window))
        other = start.copy()
        other[W] += nudge_mps
        apart = (simulated(start, window) - simulated(other, window))[-1, 2] * window.scale[-1, 2]
        grown[k] = abs(apart) * l / (nudge_mps * (binned.t_s[b - 1] - binned.t_s[a]))
    return np.nan_to_num(grown, nan=np.inf)


def turned_rad(window: Window) -> float:
    """By how much the model says that the yaw of a window's first row is off."""
    return sum(yaw_error(window.rows[0, Row.AGE], 1.0, window.theta))


def starting_motion(binned: BinnedLog, a: int, base: Base, off_rad: float) -> F64:
    """Pose and speeds (9,) at row ``a`` by least squares over the next ten rows, of whose yaw so much is an
    error: from the other side of the circle no step leads back.
    """
    head = slice(a, a + binned.settings.windows.start_rows)
    slopes = np.polyfit(binned.t_s[head] - binned.t_s[a], binned.pose[head], 1)
    z = np.zeros(N_STATE)
    z[:3] = slopes[1]
    z[2] -= off_rad
    cos, sin = np.cos(z[2]), np.sin(z[2])
    z[V] = slopes[0, 0] * cos + slopes[0, 1] * sin
    in_skid = binned.mode[a] in (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING)
    z[V_LAT] = -slopes[0, 0] * sin + slopes[0, 1] * cos if in_skid else 0.0
    z[W] = slopes[0, 2] * base.half_track_m
    return z
