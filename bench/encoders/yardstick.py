"""Two yardsticks of modes from wheel speeds, both told the robot: what a filter and what a smoother can know.

The robot's effective half track, centre of rotation and lateral slip, the noise of its pose, the size of a
tick and the rates at which this very log changes its mode are given. The state is x, y, ψ and the slip
velocities s_sum, s_diff, s_lat; a regime says which of them are active, and a slip velocity is a random
process of first order in either case. The mode follows from the slip velocities by the thresholds that
define it, whatever the regime.

*Filter*: a Gaussian sum of extended Kalman filters over the histories of regimes. After every step each
regime keeps its ``room`` − 1 heaviest histories, and one with the moments of all others (Barber 2006).
*Smoother*: forward filtering, backward simulation (Godsill, Doucet and West 2004): drawn trajectories of
regime and state given the whole log, each step from the filter's Gaussians times the transition to the step
behind it. Nothing is shared with the analysis.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64, I64

STEP_ROWS, BRANCH_STEPS = 2, 2
SLIP_MPS, SLIP_SHARE, SKID_MPS = 0.05, 0.03, 0.03
CALM_MPS, CALM_SHARE, CALM_S = 0.003, 0.006, 0.5
"""Elastic slip: its standard deviation at standstill, its growth with the speed, its correlation time."""
ACTIVE_SD, ACTIVE_S = np.array([0.3, 0.3, 0.15]), 1.0
PATH_SD = np.array([1e-4, 1e-4, 2e-4])
LEAST_SWITCHES = 0.5
"""Of each kind that a log may have had: an unseen kind of switch stays possible."""
LEAST_LOG_WEIGHT = -20.0
N_NODES, N_DRAWN, ROOM = 64, 96, 6
SLIPS, SKIDS = np.array([False, False, True, True]), np.array([False, True, False, True])


class Told(NamedTuple):
    """What the yardsticks are told besides the rows.

    ``robot`` (3,): effective half track in m, x_icr in m, lateral slip in s. ``noise_sd``: of position in m
    and yaw in rad. ``tick_m``: of a wheel's path. ``rates_per_s`` (4, 4): from mode to mode.
    """

    robot: F64
    noise_sd: tuple[float, float]
    tick_m: float
    rates_per_s: F64


Row = tuple[F64, F64, F64, I64]
"""Means, covariances, log weights and regimes."""


class Filtered(NamedTuple):
    """Every step's Gaussians: means (m, N, 6), covariances (m, N, 6, 6), log weights and regimes (m, N)."""

    mean: F64
    covariance: F64
    log_weight: F64
    regime: I64


def rates_of(mode: I64, step_s: float) -> F64:
    """The rates (4, 4) per second at which rows (n,) change from mode to mode."""
    counts = np.full((4, 4), LEAST_SWITCHES)
    np.add.at(counts, (mode[:-1], mode[1:]), 1.0)
    stays = np.maximum(np.bincount(mode, minlength=4), 1.0) * step_s
    np.fill_diagonal(counts, 0.0)
    rates = counts / np.maximum(stays, 1.0)[:, None]
    np.fill_diagonal(rates, -rates.sum(axis=1))
    return rates


def modes_told(
    wheels_mps: F64, pose: F64, step_s: float, told: Told, *, room: int = ROOM, drawn: int = N_DRAWN
) -> tuple[F64, F64]:
    """Posteriors (4, n) at every row: of the filter at that row, and of the smoother.

    ``wheels_mps`` (2, n) are speeds of left and right wheel over the interval that ends at the row, by the
    true radius; ``pose`` (3, n). ``room`` and ``drawn`` are the histories of a regime and the trajectories.
    """
    blocks, speeds = into_steps(wheels_mps, pose)
    dt = step_s * STEP_ROWS
    rounding = told.tick_m**2 / 12.0
    half_track, icr, lateral = told.robot
    variance = np.array([told.noise_sd[0], told.noise_sd[0], told.noise_sd[1]]) ** 2 / STEP_ROWS
    variance += 0.5 * rounding * np.array([1.0, 1.0, 1.0 / half_track**2])
    turn = transition(told.rates_per_s, dt * BRANCH_STEPS)
    robot = np.array([half_track, icr, lateral])
    rng = np.random.default_rng(0)
    nodes = rng.normal(size=(N_NODES, 3))
    nodes = np.concatenate([nodes, -nodes])
    filtered, causal = run_filter(blocks, speeds, dt, robot, variance, turn, room, nodes)
    smoothed = draw_backward(Filtered(*filtered), speeds, dt, robot, turn, drawn, rng)
    n = pose.shape[1]
    causal_rows, rows = (np.repeat(found, STEP_ROWS, axis=1) for found in (causal, smoothed))
    held = np.concatenate([np.repeat(causal_rows[:, :1], STEP_ROWS - 1, axis=1), causal_rows], axis=1)
    held_at, at = np.minimum(np.arange(n), held.shape[1] - 1), np.minimum(np.arange(n), rows.shape[1] - 1)
    return held[:, held_at], rows[:, at]


def into_steps(wheels_mps: F64, pose: F64) -> tuple[F64, F64]:
    """Mean poses (m, 3) of blocks of two rows, and speeds (m, 2) over the time from block to block."""
    n = pose.shape[1] // STEP_ROWS * STEP_ROWS
    blocks = pose[:, :n].reshape(3, -1, STEP_ROWS).mean(axis=2)
    ahead, around = wheels_mps.mean(axis=0), 0.5 * (wheels_mps[1] - wheels_mps[0])
    both = np.stack([ahead, around])
    before = np.concatenate([both[:, :1], both[:, : n - 1]], axis=1)[:, ::STEP_ROWS]
    speeds = 0.25 * before + 0.5 * both[:, :n:STEP_ROWS] + 0.25 * both[:, 1:n:STEP_ROWS]
    return np.ascontiguousarray(blocks.T), np.ascontiguousarray(speeds.T)


def transition(rates: F64, dt: float) -> F64:
    """Probabilities (4, 4) of the mode ``dt`` later, to second order."""
    turn = np.eye(4) + rates * dt + 0.5 * (rates * dt) @ (rates * dt)
    turn = np.maximum(turn, 1e-9)
    shares: F64 = turn / turn.sum(axis=1, keepdims=True)
    return shares


@njit(cache=True)
def factor(matrix: F64, out: F64) -> float:
    """The lower Cholesky factor of a matrix (n, n) into ``out``; the logarithm of the determinant."""
    n, log_det = matrix.shape[0], 0.0
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= out[i, k] * out[j, k]
            if i == j:
                out[i, i] = np.sqrt(max(total, 1e-30))
                log_det += 2.0 * np.log(out[i, i])
            else:
                out[i, j] = total / out[j, j]
    return log_det


@njit(cache=True)
def solve_lower(lower: F64, right: F64, out: F64) -> None:
    """``out`` (n,) with lower · out = right."""
    for i in range(lower.shape[0]):
        total = right[i]
        for k in range(i):
            total -= lower[i, k] * out[k]
        out[i] = total / lower[i, i]


@njit(cache=True)
def distance(lower: F64, end: F64, begin: F64, out: F64) -> float:
    """The squared length of ``out`` (n,), with lower · out = end − begin."""
    squares = 0.0
    for i in range(lower.shape[0]):
        total = end[i] - begin[i]
        for k in range(i):
            total -= lower[i, k] * out[k]
        out[i] = total / lower[i, i]
        squares += out[i] * out[i]
    return squares


@njit(cache=True)
def solve_upper(lower: F64, right: F64, out: F64) -> None:
    """``out`` (n,) with lowerᵀ · out = right."""
    n = lower.shape[0]
    for i in range(n - 1, -1, -1):
        total = right[i]
        for k in range(i + 1, n):
            total -= lower[k, i] * out[k]
        out[i] = total / lower[i, i]


@njit(cache=True)
def step_of(
    mean: F64, speeds: F64, dt: float, robot: F64, change: tuple[int, int], after: F64, slope: F64, noise: F64
) -> None:
    """The mean after a step in which the regime changes from one to another, its Jacobian (6, 6) and the
    variances (6,) of what is added.
    """
    half_track, icr, lateral = robot[0], robot[1], robot[2]
    v = speeds[0] - mean[3]
    omega = (speeds[1] - mean[4]) / half_track
    v_lat = mean[5] - (icr + lateral * v) * omega
    heading = mean[2] + 0.5 * omega * dt
    cos, sin = np.cos(heading), np.sin(heading)
    for i in range(6):
        for j in range(6):
            slope[i, j] = 1.0 if i == j else 0.0
    lat_by_v, lat_by_omega = -lateral * omega, -(icr + lateral * v)
    for row in range(2):
        ahead, aside = (cos, -sin) if row == 0 else (sin, cos)
        off = -(v * sin + v_lat * cos) if row == 0 else v * cos - v_lat * sin
        slope[row, 2] = dt * off
        slope[row, 3] = -dt * (ahead + aside * lat_by_v)
        slope[row, 4] = -dt / half_track * (aside * lat_by_omega + 0.5 * dt * off)
        slope[row, 5] = dt * aside
    slope[2, 4] = -dt / half_track
    after[0] = mean[0] + dt * (v * cos - v_lat * sin)
    after[1] = mean[1] + dt * (v * sin + v_lat * cos)
    after[2] = mean[2] + dt * omega
    calm = CALM_MPS + CALM_SHARE * abs(speeds[0])
    for c in range(3):
        noise[c] = PATH_SD[c] ** 2
        was = SLIPS[change[0]] if c < 2 else SKIDS[change[0]]
        now = SLIPS[change[1]] if c < 2 else SKIDS[change[1]]
        sd = ACTIVE_SD[c] if now else calm
        left = np.exp(-dt / (ACTIVE_S if now else CALM_S))
        if was and not now:
            left = 0.0
        slope[3 + c, 3 + c] = left
        after[3 + c] = left * mean[3 + c]
        noise[3 + c] = sd * sd * (1.0 - left * left)


@njit(cache=True)
def spread_of(covariance: F64, slope: F64, noise: F64, out: F64) -> None:
    """Slope · covariance · slopeᵀ + noise into ``out`` (6, 6)."""
    half = slope @ covariance
    out[:] = half @ slope.T
    for i in range(6):
        out[i, i] += noise[i]


@njit(cache=True)
def update(mean: F64, covariance: F64, pose: F64, variance: F64) -> float:
    """A mean and a covariance after a pose, in place; the logarithm of its likelihood."""
    inside, lower = np.empty((3, 3)), np.zeros((3, 3))
    error, whitened, gain = np.empty(3), np.empty(3), np.empty((3, 6))
    for i in range(3):
        error[i] = pose[i] - mean[i]
        for j in range(3):
            inside[i, j] = covariance[i, j] + (variance[i] if i == j else 0.0)
    log_det = factor(inside, lower)
    solve_lower(lower, error, whitened)
    column = np.empty(3)
    for j in range(6):
        solve_lower(lower, covariance[:3, j].copy(), column)
        gain[:, j] = column
    for i in range(6):
        for k in range(3):
            mean[i] += gain[k, i] * whitened[k]
        for j in range(6):
            for k in range(3):
                covariance[i, j] -= gain[k, i] * gain[k, j]
    return float(-0.5 * (log_det + (whitened**2).sum()))


@njit(cache=True)
def mode_of(s_sum: float, s_diff: float, s_lat: float, speed: float) -> int:
    """The mode as it is defined."""
    limit = max(SLIP_MPS, SLIP_SHARE * abs(speed - s_sum))
    slips = max(abs(s_sum + s_diff), abs(s_sum - s_diff)) > limit
    return 2 * int(slips) + int(abs(s_lat) > SKID_MPS)


@njit(cache=True)
def count(mean: F64, covariance: F64, share: float, speed: float, nodes: F64, out: F64) -> None:
    """The modes' probabilities in a Gaussian, times ``share``, added to ``out`` (4,)."""
    lower = np.zeros((3, 3))
    factor(covariance[3:, 3:], lower)
    each = share / nodes.shape[0]
    for k in range(nodes.shape[0]):
        z = nodes[k]
        s_sum = mean[3] + lower[0, 0] * z[0]
        s_diff = mean[4] + lower[1, 0] * z[0] + lower[1, 1] * z[1]
        s_lat = mean[5] + lower[2, 0] * z[0] + lower[2, 1] * z[1] + lower[2, 2] * z[2]
        out[mode_of(s_sum, s_diff, s_lat, speed)] += each


@njit(cache=True)
def reduce(mean: F64, covariance: F64, log_weight: F64, regime: I64, room: int, out: Row) -> None:
    """Of each regime the ``room`` − 1 heaviest Gaussians, and one with the moments of all others, into the
    row of ``out``.
    """
    means, covariances, log_weights, regimes = out
    log_weights[:] = -np.inf
    for r in range(4):
        order = np.argsort(-np.where(regime == r, log_weight, -np.inf))
        own = int((regime == r).sum())
        first = r * room
        for place in range(room):
            regimes[first + place] = r
        for place in range(min(own, room - 1)):
            h = order[place]
            means[first + place], covariances[first + place] = mean[h], covariance[h]
            log_weights[first + place] = log_weight[h]
        if own < room:
            continue
        rest, last = order[room - 1 : own], first + room - 1
        top = log_weight[rest[0]]
        if top == -np.inf:
            continue
        share = np.exp(log_weight[rest] - top)
        total = share.sum()
        means[last], covariances[last] = 0.0, 0.0
        for k in range(len(rest)):
            means[last] += share[k] / total * mean[rest[k]]
        for k in range(len(rest)):
            off = mean[rest[k]] - means[last]
            covariances[last] += share[k] / total * (covariance[rest[k]] + np.outer(off, off))
        log_weights[last] = top + np.log(total)


@njit(cache=True)
def run_filter(
    blocks: F64, speeds: F64, dt: float, robot: F64, variance: F64, turn: F64, room: int, nodes: F64
) -> tuple[Row, F64]:
    """All steps forward: the Gaussians after each, and the modes' probabilities (4, m)."""
    m, n = blocks.shape[0], 4 * room
    means, covariances = np.zeros((m, n, 6)), np.zeros((m, n, 6, 6))
    log_weights, regimes = np.full((m, n), -np.inf), np.zeros((m, n), np.int64)
    found = np.zeros((4, m))
    for r in range(4):
        regimes[0, r * room : (r + 1) * room] = r
        h = r * room
        means[0, h, :3] = blocks[0]
        log_weights[0, h] = np.log(0.97 if r == 0 else 0.01)
        for i in range(3):
            active = SLIPS[r] if i < 2 else SKIDS[r]
            covariances[0, h, i, i] = variance[i]
            covariances[0, h, 3 + i, 3 + i] = ACTIVE_SD[i] ** 2 if active else CALM_MPS**2
    found[0, 0] = 1.0
    mean, covariance = np.zeros((4 * n, 6)), np.zeros((4 * n, 6, 6))
    log_weight, regime = np.zeros(4 * n), np.zeros(4 * n, np.int64)
    slope, noise = np.zeros((6, 6)), np.zeros(6)
    for k in range(1, m):
        size = 0
        branches = k % BRANCH_STEPS == 0
        for h in range(n):
            if log_weights[k - 1, h] < LEAST_LOG_WEIGHT:
                continue
            was = regimes[k - 1, h]
            for r in range(4):
                if r != was and not branches:
                    continue
                step_of(means[k - 1, h], speeds[k], dt, robot, (was, r), mean[size], slope, noise)
                spread_of(covariances[k - 1, h], slope, noise, covariance[size])
                log_weight[size] = log_weights[k - 1, h] + update(
                    mean[size], covariance[size], blocks[k], variance
                )
                log_weight[size] += np.log(turn[was, r]) if branches else 0.0
                regime[size] = r
                size += 1
        out = (means[k], covariances[k], log_weights[k], regimes[k])
        reduce(mean[:size], covariance[:size], log_weight[:size], regime[:size], room, out)
        top = log_weights[k].max()
        log_weights[k] -= top + np.log(np.exp(log_weights[k] - top).sum())
        for h in range(n):
            if log_weights[k, h] > -12.0:
                share = np.exp(log_weights[k, h])
                count(means[k, h], covariances[k, h], share, speeds[k, 0], nodes, found[:, k])
    return (means, covariances, log_weights, regimes), found


@njit(cache=True)
def draw_backward(
    filtered: Filtered, speeds: F64, dt: float, robot: F64, turn: F64, drawn: int, rng: np.random.Generator
) -> F64:
    """The share (4, m) of drawn trajectories in each mode at every step."""
    means, covariances, log_weights, regimes = filtered
    m, n = log_weights.shape
    found = np.zeros((4, m))
    state, regime = np.empty((drawn, 6)), np.empty(drawn, np.int64)
    lower = np.zeros((6, 6))
    total = np.cumsum(np.exp(log_weights[m - 1]))
    for d in range(drawn):
        h = min(np.searchsorted(total, rng.random() * total[-1]), n - 1)
        factor(covariances[m - 1, h], lower)
        state[d], regime[d] = means[m - 1, h] + lower @ rng.standard_normal(6), regimes[m - 1, h]
        found[mode_of(state[d, 3], state[d, 4], state[d, 5], speeds[m - 1, 0]), m - 1] += 1.0 / drawn
    after, slope, noise = np.zeros((4, n, 6)), np.zeros((4, n, 6, 6)), np.zeros((4, n, 6))
    factors, log_det, own = np.zeros((4, n, 6, 6)), np.zeros((4, n)), np.zeros((n, 6, 6))
    spread, weight, white, further = np.zeros((6, 6)), np.empty(n), np.empty(6), np.empty(6)
    for k in range(m - 2, -1, -1):
        branches = (k + 1) % BRANCH_STEPS == 0
        for h in range(n):
            if log_weights[k, h] < LEAST_LOG_WEIGHT:
                continue
            factor(covariances[k, h], own[h])
            for r in range(4):
                was = regimes[k, h]
                if r != was and not branches:
                    continue
                step_of(
                    means[k, h], speeds[k + 1], dt, robot, (was, r), after[r, h], slope[r, h], noise[r, h]
                )
                spread_of(covariances[k, h], slope[r, h], noise[r, h], spread)
                log_det[r, h] = factor(spread, factors[r, h])
        for d in range(drawn):
            r, top = regime[d], -np.inf
            for h in range(n):
                was = regimes[k, h]
                weight[h] = -np.inf
                if log_weights[k, h] < LEAST_LOG_WEIGHT or (was != r and not branches):
                    continue
                far = distance(factors[r, h], state[d], after[r, h], white)
                weight[h] = log_weights[k, h] - 0.5 * (log_det[r, h] + far)
                weight[h] += np.log(turn[was, r]) if branches else 0.0
                top = max(top, weight[h])
            total = np.cumsum(np.exp(weight - top))
            h = min(np.searchsorted(total, rng.random() * total[-1]), n - 1)
            fresh = own[h] @ rng.standard_normal(6)
            ahead = after[r, h] + slope[r, h] @ fresh + np.sqrt(noise[r, h]) * rng.standard_normal(6)
            distance(factors[r, h], state[d], ahead, white)
            solve_upper(factors[r, h], white, further)
            state[d] = means[k, h] + fresh + covariances[k, h] @ (slope[r, h].T @ further)
            regime[d] = regimes[k, h]
            found[mode_of(state[d, 3], state[d, 4], state[d, 5], speeds[k, 0]), k] += 1.0 / drawn
    return found
