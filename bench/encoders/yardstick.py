"""A yardstick of modes from wheel speeds: an interacting multiple model filter that is told the robot.

Four extended Kalman filters, one a mode, with the states x, y, ψ, s_sum, s_diff, s_lat; they are mixed at
every step (Blom and Bar-Shalom 1988). It knows wheel scale, effective half track, centre of rotation, lateral
slip and the noise of the pose. Nothing of it is shared with the analysis.
"""

import numpy as np

from wmr_schemas.arrays import F64

STEP_ROWS = 2
SLIP_MPS, SLIP_SHARE, SKID_MPS = 0.05, 0.03, 0.03
SWITCHES_PER_S = 0.15
CALM_SD, SLIP_SD, SKID_SD = 0.006, 0.5, 0.3
CALM_S, ACTIVE_S = 1.0, 0.4
SKIDS, SLIPS = np.array([False, True, False, True]), np.array([False, False, True, True])


def modes_told(wheels_mps: F64, pose: F64, noise_sd: tuple[float, float], step_s: float, robot: F64) -> F64:
    """The posterior (4, n) at every row.

    ``wheels_mps`` (2, n) true rolling speeds of left and right wheel by the encoders, ``pose`` (3, n);
    ``noise_sd`` of position in m and yaw in rad; ``robot`` (3,): effective half track in m, x_icr in m,
    lateral slip in s.
    """
    half_track, icr, lateral = robot
    n = pose.shape[1] // STEP_ROWS * STEP_ROWS
    blocks = pose[:, :n].reshape(3, -1, STEP_ROWS).mean(axis=2)
    speeds = wheels_mps[:, :n].reshape(2, -1, STEP_ROWS).mean(axis=2)
    older = np.concatenate([speeds[:, :1], speeds[:, :-1]], axis=1)
    speeds = 0.75 * speeds + 0.25 * older
    dt = step_s * STEP_ROWS
    measured = np.array([noise_sd[0], noise_sd[0], noise_sd[1]]) ** 2 / STEP_ROWS
    stay = np.exp(-SWITCHES_PER_S * dt)
    turn = np.full((4, 4), (1 - stay) / 3) + np.eye(4) * (stay - (1 - stay) / 3)
    fade, fresh = dynamics(dt)
    mean = np.tile(np.concatenate([blocks[:, 0], np.zeros(3)]), (4, 1))
    covariance = np.tile(np.diag(np.concatenate([measured, np.full(3, CALM_SD**2)])), (4, 1, 1))
    weight, found = np.array([0.97, 0.01, 0.01, 0.01]), np.empty((4, blocks.shape[1]))
    for k in range(blocks.shape[1]):
        if k:
            weight, mean, covariance = mixed(weight, mean, covariance, turn)
            mean, jacobian = moved(mean, speeds[:, k], dt, (half_track, icr, lateral), fade)
            covariance = jacobian @ covariance @ jacobian.transpose(0, 2, 1) + fresh
        weight, mean, covariance = updated(weight, mean, covariance, blocks[:, k], measured)
        found[:, k] = told(weight, mean, covariance, abs(speeds[:, k].mean()))
    rows = np.repeat(found, STEP_ROWS, axis=1)
    shifted = np.concatenate([rows[:, :1], rows[:, :-1]], axis=1)
    return np.concatenate([shifted, np.repeat(rows[:, -1:], pose.shape[1] - n, axis=1)], axis=1)


def dynamics(dt: float) -> tuple[F64, F64]:
    """By mode: what is left of the slips after a step (4, 3), and process noise (4, 6, 6)."""
    active = np.stack([SLIPS, SLIPS, SKIDS], axis=1)
    wide = np.array([SLIP_SD, SLIP_SD, SKID_SD]) ** 2
    fade = np.exp(-dt / np.where(active, ACTIVE_S, CALM_S))
    fresh = np.zeros((4, 6, 6))
    for c in range(3):
        fresh[:, 3 + c, 3 + c] = np.where(active[:, c], wide[c], CALM_SD**2) * (1 - fade[:, c] ** 2)
    fresh[:, [0, 1, 2], [0, 1, 2]] = 1e-8
    return fade, fresh


def mixed(weight: F64, mean: F64, covariance: F64, turn: F64) -> tuple[F64, F64, F64]:
    """The interaction step: what each filter starts from, given that its mode is entered."""
    joint = weight[:, None] * turn
    prior = joint.sum(axis=0)
    share = joint / prior
    start = share.T @ mean
    off = mean[:, None] - start[None]
    spread = covariance[:, None] + off[..., :, None] * off[..., None, :]
    return prior, start, np.einsum("ij,ijkl->jkl", share, spread)


def moved(mean: F64, speeds: F64, dt: float, robot: tuple[float, float, float], fade: F64) -> tuple[F64, F64]:
    """Means (4, 6) after a step of wheel speeds (2,), with Jacobians (4, 6, 6)."""
    half_track, icr, lateral = robot
    v = speeds.mean() - mean[:, 3]
    omega = (0.5 * (speeds[1] - speeds[0]) - mean[:, 4]) / half_track
    v_lat = mean[:, 5] - (icr + lateral * v) * omega
    heading = mean[:, 2] + 0.5 * omega * dt
    cos, sin = np.cos(heading), np.sin(heading)
    jacobian = np.tile(np.eye(6), (4, 1, 1))
    lat_by_v, lat_by_omega = -lateral * omega, -(icr + lateral * v)
    for row, (ahead, aside, off) in enumerate(
        ((cos, -sin, -(v * sin + v_lat * cos)), (sin, cos, v * cos - v_lat * sin))
    ):
        jacobian[:, row, 2] = dt * off
        jacobian[:, row, 3] = -dt * (ahead + aside * lat_by_v)
        jacobian[:, row, 4] = -dt / half_track * (aside * lat_by_omega + 0.5 * dt * off)
        jacobian[:, row, 5] = dt * aside
    jacobian[:, 2, 4] = -dt / half_track
    for c in range(3):
        jacobian[:, 3 + c, 3 + c] = fade[:, c]
    after = mean.copy()
    after[:, 0] += dt * (v * cos - v_lat * sin)
    after[:, 1] += dt * (v * sin + v_lat * cos)
    after[:, 2] += dt * omega
    after[:, 3:] *= fade
    return after, jacobian


def updated(weight: F64, mean: F64, covariance: F64, pose: F64, variance: F64) -> tuple[F64, F64, F64]:
    """Weights, means and covariances after a pose."""
    error = pose - mean[:, :3]
    inside = covariance[:, :3, :3] + np.diag(variance)
    gain = covariance[:, :, :3] @ np.linalg.inv(inside)
    solved = np.linalg.solve(inside, error[..., None])[..., 0]
    log_weight = np.log(weight) - 0.5 * ((error * solved).sum(axis=1) + np.linalg.slogdet(inside)[1])
    weight = np.exp(log_weight - log_weight.max())
    mean = mean + (gain @ error[..., None])[..., 0]
    return weight / weight.sum(), mean, covariance - gain @ covariance[:, :3, :]


def told(weight: F64, mean: F64, covariance: F64, speed_mps: float) -> F64:
    """The modes' probabilities (4,) with the thresholds that define them, sampled from each filter."""
    limit = max(SLIP_MPS, SLIP_SHARE * speed_mps)
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)[:, 3:])
    drawn = mean[:, 3:, None] + sd[..., None] * NODES
    wheel = np.maximum(abs(drawn[:, 0] + drawn[:, 1]), abs(drawn[:, 0] - drawn[:, 1]))
    slips, skids = (wheel > limit) & SLIPS[:, None], (abs(drawn[:, 2]) > SKID_MPS) & SKIDS[:, None]
    out = [(~slips & ~skids), (~slips & skids), (slips & ~skids), (slips & skids)]
    return np.array([weight @ case.mean(axis=1) for case in out])


NODES = np.random.default_rng(0).normal(size=(3, 64))
