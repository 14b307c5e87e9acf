"""Each mode's motion as a linear model of deviations from the true path: what the mode yardstick is told.

State: deviations of x, y, yaw, v, w, q from the truth; the disturbances of dv/dt, dw/dt (while skidding) and
l·dq/dt; on plant one the slip velocities σ of the sum and the difference; with wobble, the marker's three. Of
a bin from its mean time to the next one: x⁺ = F x + f + noise, F and f by mode; f is what the mode moves the
true state by, less what the truth moved by. Written from the equations of the plants alone.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from worlds.case import Truth, World
from worlds.oracle_filter import exponential
from worlds.plant_three.equations import SLIDE_RAD
from worlds.plant_two.world import plant_robot

X, Y, YAW, V, W, Q = range(6)
DISTURBANCE, SLIP, N_MODES = 6, 9, 3
IDEAL, SKIDDING, SLIPPING = range(N_MODES)
SPEED_FLOOR_MPS, SIDESLIP_S = 0.3, 0.02
LEAST_LEVEL_MPS2 = 1e-4
COMPENSATES_SD = 2.0
"""Efforts that ask for less than so many standard deviations of the disturbance are the controller's answer
to it: it sees the true speed, and without this factor they would be taken for an independent input."""
BIN_ROWS = {"mocap": 2, "rtk": 4, "poor": 6}
"""Poses in a bin by noise: as fine as a switch can be dated."""


@dataclass(frozen=True, eq=False)
class Linear:
    """n bins: transitions (n − 1, 3, d, d) and offsets (n − 1, 3, d) by mode, noise (n − 1, d, d), what a
    switch within a bin adds (n − 1, 5) – to x and y together, v, w and q –, poses as deviations (n, 3), their
    variances (3,), first covariance (d, d); ``wobbles``: the last three states add to the pose.
    """

    flow: F64
    offset: F64
    noise: F64
    at_switch: F64
    pose: F64
    variances: F64
    start: F64
    rows: int
    wobbles: bool


def coefficients(world: World) -> dict[str, float]:
    """The robot's true coefficients; slip velocities as states on plant one alone."""
    p: Any = plant_robot(world.robot)
    known: Any = world.robot.known()
    mass, inertia, l = known["mass_kg"], known["yaw_inertia_kgm2"], p.half_track_m
    grip = known["longitudinal_stiffness_over_epsilon"]
    wheel = p.wheel_radius_m**2 / known["wheel_inertia_kgm2"]
    return {
        **p._asdict(),
        "compliance_s": p.compliance_s if world.case.plant != 1 else 0.0,
        "slides_at_rad": 3 * SLIDE_RAD if world.case.plant == 3 else np.inf,
        "ahead_by_slip": 3 / mass * grip,
        "turn_by_slip": 3 * l**2 / inertia * grip,
        "pole_sum": (wheel + 2 / mass) * grip,
        "pole_difference": (wheel + 2 * l**2 / inertia) * grip,
    }


def grip_left(w: F64, speed: F64, c: dict[str, float]) -> tuple[F64, F64]:
    """Side force of a tyre that slides at last, over the linear one's: the ratio, and that of its slope."""
    z = np.minimum(np.abs(w) / speed / c["slides_at_rad"], 1.0)
    return 1 - z + z**2 / 3, (1 - z) ** 2


def rates(state: F64, mode: int, drive: F64, spin: F64, c: dict[str, float]) -> F64:
    """Time derivative (6, n) of x, y, yaw, v, w, q without disturbances; slipping has no traction here.

    Where a mode has no free w, it is −κ v q, and its derivative 0.
    """
    _, _, yaw, v, w, q = state
    free = mode == SKIDDING
    w = w if free else -c["compliance_s"] * v * q
    speed = np.maximum(np.sqrt(v**2 + w**2 + (c["half_track_m"] * q) ** 2), SPEED_FLOOR_MPS)
    share = 0.0 if mode == SLIPPING else 1.0
    decay = c["skid_decay_mps2"] / speed * grip_left(w, speed, c)[0]
    return np.stack(
        [
            v * np.cos(yaw) - w * np.sin(yaw),
            v * np.sin(yaw) + w * np.cos(yaw),
            q,
            share * drive + (w * q / 3 if free else 0.0),
            -decay * w - v * q if free else 0.0 * v,
            share * spin / c["half_track_m"],
        ]
    )


def moved(state: F64, dt: F64, mode: int, drive: F64, spin: F64, c: dict[str, float]) -> F64:
    """The state after a step of Runge and Kutta; w where the mode has it free, else −κ v q."""
    k1 = rates(state, mode, drive, spin, c)
    k2 = rates(state + 0.5 * dt * k1, mode, drive, spin, c)
    k3 = rates(state + 0.5 * dt * k2, mode, drive, spin, c)
    k4 = rates(state + dt * k3, mode, drive, spin, c)
    after = state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    if mode != SKIDDING:
        after[W] = -c["compliance_s"] * after[V] * after[Q]
    return after


def jacobian(state: F64, mode: int, d: int, c: dict[str, float]) -> F64:
    """d/dt of the deviations by the deviations, (n, d, d), at the truth."""
    _, _, yaw, v, w, q = state
    cos, sin, l = np.cos(yaw), np.sin(yaw), c["half_track_m"]
    free, found = mode == SKIDDING, np.zeros((len(v), d, d))
    w = w if free else 0.0 * w
    found[:, X, V], found[:, Y, V], found[:, YAW, Q] = cos, sin, 1.0
    found[:, X, YAW], found[:, Y, YAW] = -v * sin - w * cos, v * cos - w * sin
    found[:, V, DISTURBANCE], found[:, Q, DISTURBANCE + 2] = 1.0, 1 / l
    speed = np.maximum(np.sqrt(v**2 + w**2 + (l * q) ** 2), SPEED_FLOOR_MPS)
    if free:
        found[:, X, W], found[:, Y, W] = -sin, cos
        found[:, V, W], found[:, V, Q] = q / 3, w / 3
        decay = c["skid_decay_mps2"] / speed * grip_left(w, speed, c)[1]
        found[:, W, W], found[:, W, V], found[:, W, Q] = -decay, -q, -v
        found[:, W, DISTURBANCE + 1] = 1.0
    if mode == SLIPPING and d > SLIP + 1 and c["slips"]:
        found[:, V, SLIP], found[:, Q, SLIP + 1] = c["ahead_by_slip"] / speed, c["turn_by_slip"] / speed / l
        found[:, SLIP, SLIP] = -c["pole_sum"] / speed
        found[:, SLIP + 1, SLIP + 1] = -c["pole_difference"] / speed
    return found


def independent(demand: F64, level: float) -> F64:
    """The part of a demand (n,) in m/s² that does not answer a disturbance of this level."""
    share = (demand / (COMPENSATES_SD * level)) ** 4
    return demand * share / (1 + share)


def mean_torques(world: World) -> tuple[F64, F64]:
    """Mean torques (n − 1,), left and right, between the truth's instants; those of plants two and three are
    held from one command to the next, and a pose's stamp lies anywhere between.
    """
    truth, log = world.truth, world.log
    if world.case.plant == 1 or log.torque is None:
        return truth.left_nm[:-1], truth.right_nm[:-1]
    at_s = (log.torque.t_ns - log.pose.t_ns[0]) / NS_PER_S + truth.t_s[0]
    steps = np.diff(at_s, append=2 * at_s[-1] - at_s[-2])
    ends = np.append(at_s, at_s[-1] + steps[-1])
    sums = (np.append(0.0, np.cumsum(held * steps)) for held in (log.torque.left_nm, log.torque.right_nm))
    left, right = (np.diff(np.interp(truth.t_s, ends, total)) / np.diff(truth.t_s) for total in sums)
    return left, right


def substeps(
    truth: Truth, torques: tuple[F64, F64], mode: int, d: int, c: dict[str, float]
) -> tuple[F64, F64]:
    """Transitions (n − 1, d, d) and offsets (n − 1, d) of a mode between the truth's instants."""
    state = np.stack([getattr(truth, name) for name in ("x_m", "y_m", "yaw_rad", "v_long_mps", "v_lat_mps")])
    state = np.concatenate([state, truth.yaw_rate_radps[None]])
    dt = np.diff(truth.t_s)
    left, right = torques
    drive = independent(c["alpha"] * (left + right), c["level"])
    spin = independent(c["alpha_yaw"] * (right - left), c["level"])
    before = state[:, :-1].copy()
    shares = (c["share_long"], c["share_yaw"]) if mode == SLIPPING and not c["slips"] else (1.0, 1.0)
    as_told = IDEAL if mode == SLIPPING and not c["slips"] else mode
    after = moved(before, dt, as_told, shares[0] * drive, shares[1] * spin, c)
    parts = np.zeros((len(dt), d + 1, d + 1))
    parts[:, :d, :d] = jacobian(before, mode, d, c)
    if mode == SLIPPING and c["slips"]:
        parts[:, SLIP, d], parts[:, SLIP + 1, d] = drive, spin
    whole = exponential(parts * dt[:, None, None])
    flow, offset = whole[:, :d, :d].copy(), whole[:, :d, d].copy()
    offset[:, :6] += (after - state[:, 1:]).T
    if mode != SKIDDING:
        flow[:, W, :] = 0.0
        flow[:, :, W] = 0.0
    if mode != SLIPPING and c["slips"]:
        flow[:, SLIP : SLIP + 2, :] = flow[:, :, SLIP : SLIP + 2] = 0.0
    return flow, offset


def linear_model(world: World, rows: int | None = None) -> Linear:
    """The model of a world without hidden effect, ``rows`` poses a bin."""
    truth, around, c = world.truth, world.conditions, coefficients(world)
    c["slips"] = float(world.case.plant == 1)
    c["level"] = max(around.disturbance_mps2, LEAST_LEVEL_MPS2)
    wobbles = around.wobble_share > 0
    d = (SLIP + 2 if c["slips"] else SLIP) + 3 * wobbles
    per = rows or BIN_ROWS[world.case.noise]
    n = len(truth.t_s) // per
    middle = np.arange(n) * per + (per - 1) // 2
    flows, offsets = np.empty((n - 1, N_MODES, d, d)), np.zeros((n - 1, N_MODES, d))
    torques = mean_torques(world)
    for mode in range(N_MODES):
        flow, offset = substeps(truth, torques, mode, d, c)
        total = np.broadcast_to(np.eye(d), (n - 1, d, d)).copy()
        for j in range(per):
            at = middle[:-1] + j
            total = flow[at] @ total
            offsets[:, mode] = np.einsum("nij,nj->ni", flow[at], offsets[:, mode]) + offset[at]
        flows[:, mode] = total
    seconds = np.diff(truth.t_s[middle])
    level = c["level"]
    sd = np.array([world.case.noise_sd[0], world.case.noise_sd[0], world.case.noise_sd[1]])
    noise = np.zeros((n - 1, d, d))
    slow = [(k, around.disturbance_s, level**2) for k in range(DISTURBANCE, DISTURBANCE + 3)]
    slow += [(d - 3 + k, around.wobble_s, around.wobble_share * sd[k] ** 2) for k in range(3 * wobbles)]
    start = np.diag(np.concatenate([100 * sd**2, [0.1**2, 0.05**2, 0.1**2], np.zeros(d - 6)]))
    for k, tau_s, variance in slow:
        kept = np.exp(-seconds / tau_s)
        flows[:, :, k, :], flows[:, :, k, k] = 0.0, kept[:, None]
        noise[:, k, k], start[k, k] = variance * (1 - kept**2), variance
    for k in (V, W, Q):
        noise[:, k, k] += 1e-8 * seconds
    pose = np.stack([world.log.pose.x_m, world.log.pose.y_m, np.unwrap(world.log.pose.yaw_rad)])
    true = np.stack([truth.x_m, truth.y_m, truth.yaw_rad])
    off = pose - true
    off[2] = (off[2] + np.pi) % (2 * np.pi) - np.pi
    off = means(off, n, per)
    variances = (1 - around.wobble_share) * sd**2 / per
    return Linear(
        flows,
        offsets,
        noise,
        switch_spread(truth, middle, seconds, c),
        off.T.copy(),
        variances,
        start,
        per,
        wobbles,
    )


def means(columns: F64, n: int, per: int) -> F64:
    """Means over bins (3, n)."""
    return columns[:, : n * per].reshape(3, n, per).mean(axis=2)


def switch_spread(truth: Truth, middle: I64, seconds: F64, c: dict[str, float]) -> F64:
    """What a switch at a uniform instant of a bin adds to x and y (aside), v, w and q: sd, (n − 1, 5)."""
    at = middle[1:]
    when = seconds / np.sqrt(12.0)
    v, q, yaw = truth.v_long_mps[at], truth.yaw_rate_radps[at], truth.yaw_rad[at]
    speed = np.maximum(np.hypot(v, c["half_track_m"] * q), SPEED_FLOOR_MPS)
    aside = np.maximum(np.abs(truth.v_lat_mps[at]), np.abs(v * q) * speed / c["skid_decay_mps2"])
    drive = c["alpha"] * (truth.left_nm + truth.right_nm)[at] * (1 - c["share_long"])
    spin = c["alpha_yaw"] * (truth.right_nm - truth.left_nm)[at] * (1 - c["share_yaw"]) / c["half_track_m"]
    across = aside * when
    return np.stack(
        [-across * np.sin(yaw), across * np.cos(yaw), drive * when, np.abs(v * q) * when, spin * when], 1
    )


def to_rows(posterior: F64, t_ns: I64, rows: int, *, behind: bool) -> F64:
    """Posterior (3, n) of bins at every pose; ``behind``: the last complete bin's. In hindsight a bin's mode
    is that of the rows between the last bin's middle and its own.
    """
    row = np.arange(len(t_ns))
    at = (row + 1) // rows - 1 if behind else (row - (rows - 1) // 2) // rows + 1
    return posterior[:, np.clip(at, 0, posterior.shape[1] - 1)]
