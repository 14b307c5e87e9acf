"""Hindsight beside an oracle in plain numpy: every history of modes with at most two switches, one by one.

In a window of 2 s about a true switch, histories switch on a grid of .1 s. Each has an extended Kalman filter
with the true parameters, started at the true state. The posterior of a mode at t is the weight, at the
window's end, of all histories that hold it at t: no pruning, no merging, no lag.
"""

from itertools import product

import numpy as np
import pytest

from wmr_replay.pipeline.memory import hindsight_columns, replay_columns
from wmr_schemas import PAPER_ROBOT
from wmr_synth import Sensors, synthesise

IDEAL, SKIDDING, SLIPPING = range(3)
X, Y, PSI, V, W, OMEGA = range(6)
NOISE = (0.01, 0.01)
RATE_HZ, GRID_S, SWITCHES_PER_S = 50.0, 0.1, 0.15
BEFORE_S, AFTER_S, COMPARED_S, N_WINDOWS = 0.8, 1.2, 0.5, 7
ALPHA, C = PAPER_ROBOT.alpha, 8.0
LEFT = (3 / 1000) / (0.35**2 / 1.6 + 2 / 1000), (3 / 500) / (0.35**2 / 1.6 + 2 / 500)
"""What slipping leaves of the torques, ahead and in yaw, with the published inertias."""


def histories(n_steps: int, first: int) -> np.ndarray:
    """Modes (H, n_steps) of all histories that begin in ``first`` and switch at most twice."""
    rows = [np.full(n_steps, first)]
    for one, mode in product(range(1, n_steps), range(3)):
        if mode == first:
            continue
        row = np.full(n_steps, first)
        row[one:] = mode
        rows.append(row)
        for two, last in product(range(one + 1, n_steps), range(3)):
            if last != mode:
                more = row.copy()
                more[two:] = last
                rows.append(more)
    return np.stack(rows)


def rates(m, mode, drive, spin):
    """d/dt of the states (H, 6)."""
    skids, slips = mode == SKIDDING, mode == SLIPPING
    v, w, omega = m[:, V], np.where(skids, m[:, W], 0.0), m[:, OMEGA]
    speed = np.maximum(np.sqrt(v**2 + w**2 + omega**2), 0.3)  # the half track is 1 m
    cos, sin = np.cos(m[:, PSI]), np.sin(m[:, PSI])
    ahead = np.where(slips, LEFT[0], 1.0) * drive + w * omega / 3
    aside = np.where(skids, -C / speed * w - v * omega, 0.0)
    turning = np.where(slips, LEFT[1], 1.0) * spin
    return np.stack([v * cos - w * sin, v * sin + w * cos, omega, ahead, aside, turning], axis=1)


def stepped(m, mode, drive, spin, dt):
    """States after dt, by the midpoint method."""
    middle = m + dt / 2 * rates(m, mode, drive, spin)
    return m + dt * rates(middle, mode, drive, spin)


def predicted(m, P, mode, drive, spin, dt):
    """Means and covariances after dt, the Jacobian by differences."""
    after, step = stepped(m, mode, drive, spin, dt), 1e-6
    J = np.stack([(stepped(m + step * e, mode, drive, spin, dt) - after) / step for e in np.eye(6)], axis=2)
    P = J @ P @ J.transpose(0, 2, 1)
    for k in (V, OMEGA, W):
        P[:, k, k] += np.where((k != W) | (mode == SKIDDING), 1e-5 * dt, 0.0)
    return after, P


def corrected(m, P, z, R):
    """Means, covariances and log likelihoods (H,) after a measurement of the pose."""
    S = P[:, :3, :3] + np.diag(R)
    K = P[:, :, :3] @ np.linalg.inv(S)
    e = z - m[:, :3]
    fit = -0.5 * (np.einsum("hi,hij,hj->h", e, np.linalg.inv(S), e) + np.log(np.linalg.det(S)))
    return m + np.einsum("hij,hj->hi", K, e), P - K @ P[:, :3, :], fit


def switched(m, P, old, new, drive, spin):
    """A switch somewhere in the last grid interval: v_lat begins or ends, and the spread of the instant."""
    spread = GRID_S / np.sqrt(12)
    change = old != new
    swept = np.where(change & (old == SKIDDING), m[:, W] * spread, 0.0)
    aside = np.stack([-np.sin(m[:, PSI]), np.cos(m[:, PSI])], axis=1) * swept[:, None]
    P[:, :2, :2] += aside[:, :, None] * aside[:, None, :]
    m[:, W] = np.where(change, 0.0, m[:, W])
    P[change, W, :] = P[change, :, W] = 0.0
    into_skid = change & (new == SKIDDING)
    P[:, W, W] += np.where(into_skid, (m[:, V] * m[:, OMEGA] * spread) ** 2, 0.0)
    slip = change & ((new == SLIPPING) | (old == SLIPPING))
    P[:, V, V] += np.where(slip, ((1 - LEFT[0]) * drive * spread) ** 2, 0.0)
    P[:, OMEGA, OMEGA] += np.where(slip, ((1 - LEFT[1]) * spin * spread) ** 2, 0.0)


def posterior(simulated, start: int, stop: int) -> np.ndarray:
    """Posterior (3, stop − start) of the rows from ``start`` on, all in the window known."""
    log, truth = simulated.log, simulated.truth
    t_s = (log.pose.t_ns - log.pose.t_ns[0])[start:stop] * 1e-9
    at = np.minimum(
        np.rint((t_s - t_s[0]) / GRID_S - 0.499).astype(int), round((BEFORE_S + AFTER_S) / GRID_S)
    )
    z = np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad], axis=1)[start:stop]
    held = np.searchsorted(log.torque.t_ns, log.pose.t_ns[start:stop], side="right") - 1
    drive = ALPHA * (log.torque.left_nm + log.torque.right_nm)[held]
    spin = ALPHA * (log.torque.right_nm - log.torque.left_nm)[held]
    modes = histories(int(at[-1]) + 1, int(true_modes(log)[start]))
    names = ("x_m", "y_m", "yaw_rad", "v_long_mps", "v_lat_mps", "yaw_rate_radps")
    m = np.tile([getattr(truth, name)[start] for name in names], (len(modes), 1))
    R = np.array([NOISE[0] ** 2, NOISE[0] ** 2, NOISE[1] ** 2])
    P = np.tile(
        np.diag([*(R / 100), 4e-4, 4e-4 if modes[0, 0] == SKIDDING else 0.0, 4e-4]), (len(modes), 1, 1)
    )
    n_switches = np.count_nonzero(np.diff(modes, axis=1), axis=1)
    rate = SWITCHES_PER_S * GRID_S
    weight = n_switches * np.log(rate / 2) + (modes.shape[1] - 1 - n_switches) * np.log1p(-rate)
    for k in range(1, stop - start):
        push, turn = (drive[k] + drive[k - 1]) / 2, (spin[k] + spin[k - 1]) / 2
        mode = modes[:, at[k]]
        if at[k] != at[k - 1]:
            switched(m, P, modes[:, at[k - 1]], mode, push, turn)
        m, P = predicted(m, P, mode, push, turn, t_s[k] - t_s[k - 1])
        m, P, fit = corrected(m, P, z[k], R)
        weight += fit
    weight = np.exp(weight - weight.max())
    weight /= weight.sum()
    return np.stack([weight @ (modes[:, at] == mode) for mode in range(3)])


def true_modes(log):
    return log.mode.mode[np.searchsorted(log.mode.t_ns, log.pose.t_ns, side="right") - 1]


@pytest.fixture(scope="module")
def compared():
    """Posteriors of oracle, hindsight and causal answer, and the true mode, about some switches."""
    found = {"oracle": [], "hindsight": [], "causal": [], "true": []}
    for seed in (41, 42):
        windows = 0
        sensors = Sensors(RATE_HZ, RATE_HZ, *NOISE)
        simulated = synthesise("random", seed=seed, duration_s=60, sensors=sensors)
        log = simulated.log
        told = {
            "hindsight": stacked(hindsight_columns(log)),
            "causal": stacked(replay_columns(log)),
        }
        true = true_modes(log)
        for row in np.flatnonzero(np.diff(true)) + 1:
            start, stop = row - round(BEFORE_S * RATE_HZ), row + round(AFTER_S * RATE_HZ)
            if start < 5 * RATE_HZ or stop > len(true) or windows == N_WINDOWS // 2 + 1:
                continue
            windows += 1
            about = slice(row - round(COMPARED_S * RATE_HZ), row + round(COMPARED_S * RATE_HZ))
            inside = slice(about.start - start, about.stop - start)
            found["oracle"].append(posterior(simulated, start, stop)[:, inside])
            for name, p in told.items():
                found[name].append(p[:, about])
            found["true"].append(true[about])
    return {name: np.concatenate(parts, axis=-1) for name, parts in found.items()}


def stacked(batches):
    """Posterior (3, n) of a table's batches, NaN in its warm-up."""
    names = ("p_ideal", "p_skidding", "p_slipping")
    return np.concatenate(
        [np.stack([c.get(name, np.full(len(c["t_ns"]), np.nan)) for name in names]) for c in batches], axis=1
    )


def test_the_smoothed_posterior_is_that_of_all_histories(compared):
    off = {name: np.abs(compared[name] - compared["oracle"]).max(0) for name in ("hindsight", "causal")}
    assert len(compared["true"]) > 300
    assert off["hindsight"].mean() < 0.05
    assert off["hindsight"].mean() < 0.4 * off["causal"].mean()


def test_hindsight_is_as_often_right_as_the_oracle(compared):
    right = {
        name: np.mean(np.argmax(compared[name], 0) == compared["true"])
        for name in ("oracle", "hindsight", "causal")
    }
    assert right["hindsight"] > right["oracle"] - 0.02
    assert right["hindsight"] > right["causal"] + 0.05
