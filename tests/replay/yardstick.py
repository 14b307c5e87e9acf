"""The yardstick: a multi-hypothesis filter that is given α, stiffnesses, slip and noise, but not the modes.

It shares no code with the identifiers that it measures, and is written in plain dense matrices. It keeps 80
hypotheses over mode sequences, each with an extended Kalman filter, and adds new ones every .1 s. The pose is
averaged over 20 ms.
"""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.compiled import compiled

X, Y, PSI, V, W, OMEGA = range(6)
IDEAL, SKIDDING, SLIPPING = range(3)
MOST, EVERY_S, RATE = 80, 0.1, 0.15


@dataclass(frozen=True)
class Truth:
    """α, β = α_yaw/l, a skid's decay c (rate c/v), the traction that slipping leaves ahead and in yaw, l."""

    alpha: float
    beta: float
    c: float
    rho: float
    rho_yaw: float
    half_track_m: float


@compiled
def slipped(drive, spin, rho, rho_yaw, l, cap):
    """What slipping leaves of the torques: shares, or, where friction limits them, each wheel's capped."""
    if np.isnan(cap):
        return rho * drive, rho_yaw * spin
    right = min(max(0.5 * (drive + l * spin), -cap), cap)
    left = min(max(0.5 * (drive - l * spin), -cap), cap)
    return right + left, (right - left) / l


@compiled
def predict(m, P, mode, drive, spin, dt, c, l):
    J = np.eye(6)
    v1, om1 = m[V] + drive * dt, m[OMEGA] + spin * dt
    w0 = m[W] if mode == SKIDDING else 0.0
    w1 = 0.0
    om = 0.5 * (m[OMEGA] + om1)
    if mode == SKIDDING:
        speed = max(np.sqrt(m[V] ** 2 + w0**2 + (l * m[OMEGA]) ** 2), 0.3)
        E = np.exp(-c / speed * dt)
        k = (1 - E) * speed / c
        w1 = w0 * E - 0.5 * (m[V] + v1) * om * k
        J[W, W], J[W, V], J[W, OMEGA] = E, -om * k, -m[V] * k
        v1 += 0.5 * (w0 + w1) * om / 3 * dt
        J[V, W], J[V, OMEGA] = om / 3 * dt, 0.5 * (w0 + w1) / 3 * dt
    else:
        J[W, W] = 0.0
    v, w = 0.5 * (m[V] + v1), 0.5 * (w0 + w1)
    heading = m[PSI] + 0.5 * om * dt
    co, si = np.cos(heading), np.sin(heading)
    J[X, V], J[X, PSI] = dt * co, -dt * (v * si + w * co)
    J[Y, V], J[Y, PSI] = dt * si, dt * (v * co - w * si)
    if mode == SKIDDING:
        J[X, W], J[Y, W] = -dt * si, dt * co
    J[X, OMEGA], J[Y, OMEGA], J[PSI, OMEGA] = 0.5 * dt * J[X, PSI], 0.5 * dt * J[Y, PSI], dt
    m[X] += dt * (v * co - w * si)
    m[Y] += dt * (v * si + w * co)
    m[PSI] += om * dt
    m[V], m[W], m[OMEGA] = v1, w1, om1
    P[:] = J @ P @ J.T
    P[V, V] += 1e-5 * dt
    P[OMEGA, OMEGA] += 1e-5 * dt
    if mode == SKIDDING:
        P[W, W] += 1e-5 * dt


@compiled
def correct(m, P, z, R):
    H = np.zeros((3, 6))
    H[0, X] = H[1, Y] = H[2, PSI] = 1.0
    S = H @ P @ H.T + np.diag(R)
    K = P @ H.T @ np.linalg.inv(S)
    e = z - m[:3]
    m += K @ e
    left = np.eye(6) - K @ H
    P[:] = left @ P @ left.T + K @ np.diag(R) @ K.T
    return -0.5 * (e @ np.linalg.solve(S, e) + np.log(np.linalg.det(S)))


@compiled
def multi_hypothesis(z, R, drive, spin, caps, t, m0, P0, told):  # noqa: C901, PLR0912 – one algorithm, one function
    c, rho, rho_yaw, l = told
    room, n = 4 * MOST, z.shape[1]
    means, covariances = np.zeros((room, 6)), np.zeros((room, 6, 6))
    weights, modes = np.zeros(room), np.zeros(room, np.int64)
    alive = 3
    for mode in range(3):
        means[mode], covariances[mode], modes[mode] = m0, P0, mode
        if mode != SKIDDING:
            means[mode, W] = 0.0
            covariances[mode, W, :] = covariances[mode, :, W] = 0.0
    posterior = np.zeros((3, n))
    last = t[0]
    for k in range(1, n):
        dt = t[k] - t[k - 1]
        push, turn = 0.5 * (drive[k] + drive[k - 1]), 0.5 * (spin[k] + spin[k - 1])
        slip_push, slip_turn = slipped(push, turn, rho, rho_yaw, l, caps[k])
        limited = not np.isnan(caps[k]) and 0.5 * (abs(push) + abs(l * turn)) <= caps[k]
        if t[k] - last >= EVERY_S - 1e-9:
            switched = 1 - np.exp(-RATE * (t[k] - last))
            spread = (t[k] - last) / np.sqrt(12)
            last = t[k]
            for h in range(alive):
                if weights[h] < -12:
                    continue
                for mode in range(3):
                    if mode == modes[h] or alive == room:
                        continue
                    means[alive], covariances[alive], modes[alive] = means[h], covariances[h], mode
                    weights[alive] = weights[h] + np.log(switched / 2)
                    if modes[h] == SKIDDING:
                        aside = (
                            np.array([-np.sin(means[h, PSI]), np.cos(means[h, PSI])]) * means[h, W] * spread
                        )
                        covariances[alive, :2, :2] += np.outer(aside, aside)
                    means[alive, W] = 0.0
                    covariances[alive, W, :] = covariances[alive, :, W] = 0.0
                    if mode == SKIDDING:
                        covariances[alive, W, W] = (means[h, V] * means[h, OMEGA] * spread) ** 2
                    if mode == SLIPPING or modes[h] == SLIPPING:
                        covariances[alive, V, V] += ((push - slip_push) * spread) ** 2
                        covariances[alive, OMEGA, OMEGA] += ((turn - slip_turn) * spread) ** 2
                    alive += 1
                weights[h] += np.log(1 - switched)
            best = np.argsort(-weights[:alive])[:MOST]
            means[: len(best)], covariances[: len(best)] = means[best].copy(), covariances[best].copy()
            weights[: len(best)], modes[: len(best)] = weights[best].copy(), modes[best].copy()
            alive = len(best)
        for h in range(alive):
            slips = modes[h] == SLIPPING
            by = (slip_push, slip_turn) if slips else (push, turn)
            predict(means[h], covariances[h], modes[h], by[0], by[1], dt, c, l)
            weights[h] += correct(means[h], covariances[h], z[:, k], R)
        top = np.max(weights[:alive])
        weights[:alive] -= top + np.log(np.sum(np.exp(weights[:alive] - top)))
        for h in range(alive):
            mode = IDEAL if limited and modes[h] == SLIPPING else modes[h]
            posterior[mode, k] += np.exp(weights[h])
    return posterior


def yardstick(log, truth, position_sd_m, yaw_sd_rad, caps=None):
    """Posterior (3, n) at each pose sample of ``log``, NaN for the first second.

    ``caps`` (n,), where traction is limited: what a wheel would add to dv_long/dt at most, on slippery
    ground.
    """
    t = (log.pose.t_ns - log.pose.t_ns[0]) * 1e-9
    per = max(1, round(0.02 / np.median(np.diff(t))))
    n = len(t) // per
    z = np.stack([log.pose.x_m, log.pose.y_m, np.unwrap(log.pose.yaw_rad)])
    held = np.searchsorted(log.torque.t_ns, log.pose.t_ns, side="right") - 1
    drive = truth.alpha * (log.torque.left_nm + log.torque.right_nm)[held]
    spin = truth.beta * (log.torque.right_nm - log.torque.left_nm)[held]

    def mean(column):
        return column[..., : n * per].reshape(*column.shape[:-1], n, per).mean(axis=-1)

    zb, tb = mean(z), mean(t)
    start = int(np.searchsorted(tb, 1.0))
    ages = tb[:start] - tb[start - 1]
    fits = [np.polyfit(ages, zb[c, :start], 2) for c in range(3)]
    psi = fits[2][2]
    co, si = np.cos(psi), np.sin(psi)
    vx, vy = fits[0][1], fits[1][1]
    m0 = np.array([fits[0][2], fits[1][2], psi, vx * co + vy * si, vy * co - vx * si, fits[2][1]])
    R = np.array([position_sd_m**2, position_sd_m**2, yaw_sd_rad**2]) / per + 1e-9
    P0 = np.diag([9 * R[0] / start, 9 * R[1] / start, 9 * R[2] / start, 0.0, 0.0, 192 * R[2] / start])
    P0[V, V] = P0[W, W] = 192 * R[0] / start + 0.05**2
    P0[W, W] += m0[V] ** 2 * P0[PSI, PSI]
    caps = np.full(len(t), np.nan) if caps is None else caps
    told = (truth.c, truth.rho, truth.rho_yaw, truth.half_track_m)
    part = slice(start - 1, None)
    found = multi_hypothesis(
        zb[:, part], R, mean(drive)[part], mean(spin)[part], mean(caps)[part], tb[part], m0, P0, told
    )
    posterior = np.full((3, len(t)), np.nan)
    bins = (np.arange(len(t)) + 1) // per - start
    inside = (bins >= 1) & (bins < found.shape[1])
    posterior[:, inside] = found[:, bins[inside]]
    return posterior
