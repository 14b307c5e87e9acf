"""The yardstick's model: the true equations in each mode, linearised about the true motion, bin by bin.

A bin leads from one edge to the next. Under mode m an error δ of the state (x, y, yaw, v, w, q) and the
disturbances d at an edge lead to F_m δ + G_m d + o_m at the next, where the offset o_m is what mode m alone
does from the true state on, minus the true state there. The measurement at an edge is the mean error of the
poses within half a bin of it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.modes import ContactMode
from worlds.case import World
from worlds.drivers import FAMILIES
from worlds.plant_two.equations import SIDESLIP_S, SLIP_ONSET_S
from worlds.plant_two.world import COMPLIANCE_S

STATES, DISTURBANCES, POSE = 6, 3, 3
STEPS = 10
N_MODES = 3
SPEED_FLOOR_MPS = 0.3
DIFFERENCES = np.array([1e-4, 1e-4, 1e-5, 1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3])
LEAST_SD = np.array([2e-5, 2e-5, 1e-5, 1e-4, 1e-3, 1e-4])
"""Process noise of a bin that keeps covariances regular; .2 mm/s where the elastic sideslip is not exact."""
START_SD = np.array([0.1, 0.1, 0.05, 0.3, 0.1, 0.3])
SKID_SHARE = 0.55


@dataclass(frozen=True, eq=False)
class Linear:
    """The model of a log with d states: flow (n, 3, d, d) and offset (n, 3, d) of each bin and mode.

    ``measured`` (n, 3) and its variances (n, 3) at the edge behind each bin; ``switching`` (3, 3) the
    probabilities of the next mode; ``mixing`` (3, 3) the share of the new mode in the bin of a change;
    ``edges_s`` (n + 1) the bins' edges.
    """

    flow: F64
    offset: F64
    process: F64
    measured: F64
    variance: F64
    start: F64
    switching: F64
    mixing: F64
    edges_s: F64


Rates = Callable[[F64, F64], F64]


def rates_of(world: World, mode: int) -> Callable[[F64, F64, F64], F64]:
    """Derivative of states (6, n) by torques (2, n) and disturbances (3, n) in a mode."""
    robot, elastic = world.robot, world.case.plant == 2
    shares = robot.slip_shares if mode == ContactMode.SLIPPING else (1.0, 1.0)
    assert shares is not None
    l, decay = float(robot.half_track_m or 0.0), float(robot.skid_decay_mps2 or 0.0)
    long, turn = shares[0] * (robot.alpha or 0.0), shares[1] * (robot.alpha_yaw_or_alpha or 0.0)

    def rates(state: F64, torques: F64, disturbance: F64) -> F64:
        _, _, yaw, v, w, q = state
        out = np.stack([v * np.cos(yaw) - w * np.sin(yaw), v * np.sin(yaw) + w * np.cos(yaw), q, v, w, q])
        out[3] = long * torques.sum(axis=0) + disturbance[0]
        out[5] = (turn * (torques[1] - torques[0]) + disturbance[2]) / l
        if mode == ContactMode.SKIDDING:
            speed = np.maximum(np.sqrt(v**2 + w**2 + (l * q) ** 2), SPEED_FLOOR_MPS)
            out[3] += w * q / 3
            out[4] = -decay / speed * w - v * q + disturbance[1]
        else:
            out[4] = -(w + COMPLIANCE_S * v * q) / SIDESLIP_S if elastic else 0.0
        return out

    return rates


def ended(world: World, mode: int, begun: F64, torques: F64, disturbance: F64, bin_s: float) -> F64:
    """States (6, n) a bin later, by Runge-Kutta steps; ``torques`` (steps, 2, n)."""
    rates, h = rates_of(world, mode), bin_s / STEPS
    state = begun.copy()
    if mode != ContactMode.SKIDDING and world.case.plant == 1:
        state[4] = 0.0
    for held in torques:
        k1 = rates(state, held, disturbance)
        k2 = rates(state + 0.5 * h * k1, held, disturbance)
        k3 = rates(state + 0.5 * h * k2, held, disturbance)
        k4 = rates(state + h * k3, held, disturbance)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state


def reference_of(world: World, at_s: F64) -> F64:
    """The true states (6, n) at instants."""
    truth = world.truth
    columns = (truth.x_m, truth.y_m, truth.yaw_rad, truth.v_long_mps, truth.v_lat_mps, truth.yaw_rate_radps)
    return np.stack([np.interp(at_s, truth.t_s, column) for column in columns])


def held_torques(world: World, edges_s: F64, bin_s: float) -> F64:
    """The commanded torques in the steps of each bin, (steps, 2, n)."""
    torque = world.log.torque
    assert torque is not None
    t_s = (torque.t_ns - torque.t_ns[0]) * 1e-9
    middles = edges_s[:-1] + bin_s * (np.arange(STEPS)[:, None] + 0.5) / STEPS
    rows = np.searchsorted(t_s, middles, side="right") - 1
    return np.stack([torque.left_nm[rows], torque.right_nm[rows]], axis=1)


def switching_of(world: World, bin_s: float) -> F64:
    """Probabilities of the next bin's mode by this one's, from the mean lengths of the family."""
    family = FAMILIES[world.case.family]
    ideal_s, lost_s = ((b - a) / np.log(b / a) for a, b in (family.ideal_s, family.lost_s))
    leaving = np.array([bin_s / ideal_s, bin_s / lost_s, bin_s / lost_s])
    direct = 1 / 6 * np.array([SKID_SHARE, 1 - SKID_SHARE])
    out = np.zeros((N_MODES, N_MODES))
    out[0] = [1 - leaving[0], leaving[0] * SKID_SHARE, leaving[0] * (1 - SKID_SHARE)]
    out[1] = [leaving[1] * (1 - direct[1]), 1 - leaving[1], leaving[1] * direct[1]]
    out[2] = [leaving[2] * (1 - direct[0]), leaving[2] * direct[0], 1 - leaving[2]]
    return out


def mixing_of(world: World, bin_s: float) -> F64:
    """Share of the new mode in the bin of a change: a half, less by the onset of slipping on plant two.

    An onset of time constant T moves the change by T, beyond the bin's end where T is long.
    """
    out = np.full((N_MODES, N_MODES), 0.5)
    if world.case.plant == 2:
        out[ContactMode.SLIPPING, :] = out[:, ContactMode.SLIPPING] = 0.5 - SLIP_ONSET_S / bin_s
    return out


def measured_at(world: World, edges_s: F64, bin_s: float) -> tuple[F64, I64]:
    """Mean error (n, 3) of the poses about each edge but the first, and how many they are."""
    pose, t_s = world.log.pose, world.truth.t_s
    seen = np.stack([pose.x_m, pose.y_m, pose.yaw_rad])
    error = seen - reference_of(world, t_s)[:POSE]
    error[2] = (error[2] + np.pi) % (2 * np.pi) - np.pi
    nearest = np.rint((t_s - edges_s[0]) / bin_s).astype(int) - 1
    inside = (nearest >= 0) & (nearest < len(edges_s) - 1)
    n = len(edges_s) - 1
    count = np.bincount(nearest[inside], minlength=n)
    sums = [np.bincount(nearest[inside], error[c, inside], minlength=n) for c in range(POSE)]
    return np.stack(sums, axis=1) / np.maximum(count, 1)[:, None], count


def linear_of(world: World, bin_s: float) -> Linear:
    """The linear model of a world whose log hides nothing."""
    around, sd = world.conditions, np.array([world.case.noise_sd[k] for k in (0, 0, 1)])
    wobbles = around.wobble_share > 0
    d = STATES + DISTURBANCES + POSE * wobbles
    edges_s = np.arange(0.0, world.truth.t_s[-1] - bin_s, bin_s)
    n = len(edges_s) - 1
    true, torques = reference_of(world, edges_s), held_torques(world, edges_s, bin_s)
    flow, offset = np.zeros((n, N_MODES, d, d)), np.zeros((n, N_MODES, d))
    calm = np.zeros((DISTURBANCES, n))
    for mode in range(N_MODES):
        middle = ended(world, mode, true[:, :-1], torques, calm, bin_s)
        offset[:, mode, :STATES] = (middle - true[:, 1:]).T
        for k, size in enumerate(DIFFERENCES):
            state, push = true[:, :-1].copy(), calm.copy()
            (state if k < STATES else push)[k % STATES] += size
            flow[:, mode, :STATES, k] = ((ended(world, mode, state, torques, push, bin_s) - middle) / size).T
    stationary = [np.full(3, around.disturbance_mps2**2), around.wobble_share * sd**2][: 1 + wobbles]
    times_s = np.repeat([around.disturbance_s, around.wobble_s][: 1 + wobbles], 3)
    flow[:, :, range(STATES, d), range(STATES, d)] = np.exp(-bin_s / times_s)
    lasting = np.concatenate(stationary) + 1e-10
    process = np.diag(np.concatenate([LEAST_SD**2, lasting * (1 - np.exp(-2 * bin_s / times_s))]))
    error, count = measured_at(world, edges_s, bin_s)
    white = (1 - around.wobble_share) * sd**2 / np.maximum(count, 1)[:, None]
    variance = np.where(count[:, None] > 0, white + 1e-12, 1e6)
    start = np.diag(np.concatenate([START_SD**2, lasting]))
    return Linear(
        flow,
        offset,
        process,
        error,
        variance,
        start,
        switching_of(world, bin_s),
        mixing_of(world, bin_s),
        edges_s,
    )
