"""The error of the true model: the hidden plant over each held-out window, without its disturbance.

The initial motion of each window is fitted to its poses, as ``wmr_replay.gap.estimation.path_error`` does for
a model. The other states of the plant (σ, actuators, wheel angles) start at their true values.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, NS_PER_S
from wmr_schemas.compiled import compiled
from wmr_schemas.model_file import Effect
from wmr_schemas.signals import ModeTrack
from wmr_synth import SimulatedLog
from wmr_synth.hidden import Disturbance, plant
from wmr_synth.hidden.measurement import as_seen
from wmr_synth.hidden.parameters import Hidden, hidden_of
from wmr_synth.hidden.simulate import grid
from wmr_synth.plants.two_wheeled import Coefficients, coefficients, jump
from wmr_synth.synthesis import START_NS

MOTION = (plant.X, plant.Y, plant.YAW, plant.V_LONG, plant.TURN, plant.V_LAT)
ROUNDS = 4
DAMPINGS = (1.0, 0.3, 0.1)
SLOPE_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class TruePlant:
    """What determines the motion except the disturbance: instants, modes, logged torques, effects."""

    t_ns: I64
    mode: I8
    torque_ns: I64
    sent: F64
    c: tuple[Coefficients, Coefficients]
    hidden: Hidden
    effects: tuple[Effect, ...]

    @classmethod
    def of(cls, simulated: SimulatedLog) -> "TruePlant":
        """From a simulated log and its facts."""
        log, facts = simulated.log, simulated.facts
        effects = effects_of(facts)
        hidden = hidden_of(effects, log.robot, plain=False)
        modes = schedule_of(facts)
        c = coefficients(log.robot, {0, 1, 2} if hidden.undeclared_stiffness else set(modes.mode.tolist()))
        declared = c._replace(skid_decay_mps2=c.skid_decay_mps2 * hidden.stiffness)
        silent = c._replace(skid_decay_mps2=c.skid_decay_mps2 * hidden.undeclared_stiffness)
        pose_ns, torque_ns = log.pose.t_ns - START_NS, log.torque.t_ns - START_NS
        t_ns = grid(modes, torque_ns, pose_ns, hidden, Disturbance())
        mode = modes.mode[np.searchsorted(modes.t_ns, t_ns, side="right") - 1]
        sent = np.column_stack([log.torque.left_nm, log.torque.right_nm])
        return cls(t_ns, mode, torque_ns, sent, (declared, silent), hidden, effects)

    def states(self, start: F64, first: int, last: int) -> F64:
        """Plant states (last − first, 14) from ``start`` at instant ``first`` on."""
        span = slice(first, last)
        return coast(
            self.t_ns[span], self.mode[span], self.torque_ns, self.sent, self.c, self.hidden, start.copy()
        )


def effects_of(facts: dict[str, Any]) -> tuple[Effect, ...]:
    """The hidden effects with all parameters drawn."""
    return tuple(Effect(e["name"], e["parameters"]) for e in facts["effects"])


def schedule_of(facts: dict[str, Any]) -> ModeTrack:
    """The true modes from the start of the simulation."""
    stamps = [round(row["t_s"] * NS_PER_S) for row in facts["modes"]]
    return ModeTrack(np.array(stamps, np.int64), np.array([row["mode"] for row in facts["modes"]], np.int8))


@compiled
def coast(
    t_ns: I64,
    mode: I8,
    torque_ns: I64,
    sent: F64,
    c: tuple[Coefficients, Coefficients],
    h: Hidden,
    state: F64,
) -> F64:
    """The plant under the torques of the log, from the first instant's ``state`` on."""
    record, work = np.empty((len(t_ns), plant.N_EXTENDED)), np.empty((5, plant.N_EXTENDED))
    acts, undeclared = -1, h.undeclared_stiffness > 0.0
    for i in range(len(t_ns)):
        q = plant.acting(mode[i], undeclared)
        if i > 0 and mode[i] != mode[i - 1]:
            jump(q, state)
        while acts + 1 < len(torque_ns) and torque_ns[acts + 1] + h.delay_ns <= t_ns[i]:
            acts += 1
        left = sent[acts, 0] if acts >= 0 else 0.0
        right = sent[acts, 1] if acts >= 0 else 0.0
        u_left = plant.shaped(left, h.left_gain, h.bias_left_nm, h)
        u_right = plant.shaped(right, h.right_gain, h.bias_right_nm, h)
        record[i] = state
        if i + 1 < len(t_ns):
            dt = (t_ns[i + 1] - t_ns[i]) / NS_PER_S
            own = c[0] if q == mode[i] else c[1]
            plant.advance(q, t_ns[i] / NS_PER_S, state, (u_left, u_right, 0.0, 0.0, 0.0), dt, own, h, work)
    return record


def true_states(simulated: SimulatedLog, true: TruePlant) -> F64:
    """The plant's states (n, 14) at the logged poses: the true motion, actuators from the logged torques."""
    m = simulated.truth
    out = np.zeros((len(m.t_ns), plant.N_EXTENDED))
    out[:, plant.X], out[:, plant.Y], out[:, plant.YAW] = m.x_m, m.y_m, m.yaw_rad
    out[:, plant.V_LAT], out[:, plant.V_LONG] = m.v_lat_mps, m.v_long_mps
    out[:, plant.TURN] = m.yaw_rate_radps * true.c[0].half_track_m
    out[:, plant.SIGMA_SUM], out[:, plant.SIGMA_DIFF] = m.sigma_sum_mps, m.sigma_diff_mps
    out[:, plant.PHI_LEFT], out[:, plant.PHI_RIGHT] = m.left_rad, m.right_rad
    if true.hidden.lag_s > 0:
        coasted = true.states(out[0], 0, len(true.t_ns))
        rows = np.searchsorted(true.t_ns, m.t_ns)
        out[:, plant.RIGHT_1 :] = coasted[rows, plant.RIGHT_1 :]
    return out


def true_errors(simulated: SimulatedLog, windows_s: list[tuple[float, float]], bin_s: float) -> F64:
    """Root mean squares (n, 2) of position [m] and yaw [rad] over each window [start, end] in s.

    Poses are averaged over bins of ``bin_s``, as in the analysis.
    """
    true = TruePlant.of(simulated)
    states = true_states(simulated, true)
    pose = simulated.log.pose
    t_s = (pose.t_ns - pose.t_ns[0]) / NS_PER_S
    measured = np.column_stack([pose.x_m, pose.y_m, np.unwrap(pose.yaw_rad)])
    sensors = simulated.facts["sensors"]
    sd = np.array([sensors["noise_xy_sd_m"]] * 2 + [sensors["noise_yaw_sd_rad"]])
    errors = []
    for start_s, end_s in windows_s:
        rows = np.flatnonzero((t_s >= start_s) & (t_s <= end_s))
        bins = bin_starts(t_s[rows], bin_s)
        left = fitted_residuals(true, simulated, states[rows[0]], rows, measured[rows], sd, bins)
        errors.append(np.sqrt([np.mean(left[:, 0] ** 2 + left[:, 1] ** 2), np.mean(left[:, 2] ** 2)]))
    return np.array(errors).reshape(-1, 2)


def bin_starts(t_s: F64, bin_s: float) -> I64:
    """Index of the first pose of each bin of a window."""
    return np.flatnonzero(np.diff(np.floor((t_s - t_s[0]) / bin_s + 1e-6), prepend=-1.0) > 0)


def fitted_residuals(
    true: TruePlant, simulated: SimulatedLog, start: F64, rows: I64, measured: F64, sd: F64, bins: I64
) -> F64:
    """Measured − simulated pose, averaged over each bin, from the best initial motion."""
    stamps = simulated.log.pose.t_ns[rows] - START_NS
    first, last = np.searchsorted(true.t_ns, [stamps[0], stamps[-1] + 1])
    kept = np.searchsorted(true.t_ns, stamps) - first
    count = np.diff(np.append(bins, len(rows)))[:, None]

    def residuals(state: F64) -> F64:
        path = true.states(state, int(first), int(last))[kept]
        return np.add.reduceat(measured - seen(simulated, rows, path, true.effects), bins) / count

    free = list(MOTION if abs(start[plant.V_LAT]) > 0 else MOTION[:-1])
    state, at = start.copy(), residuals(start)
    for _ in range(ROUNDS):
        A = np.stack([((at - residuals(moved(state, j))) / SLOPE_STEP / sd).ravel() for j in free], axis=1)
        step = np.linalg.lstsq(A, (at / sd).ravel(), rcond=1e-9)[0]
        for damping in DAMPINGS:
            tried = state.copy()
            tried[free] += damping * step
            left = residuals(tried)
            if np.sum((left / sd) ** 2) < np.sum((at / sd) ** 2):
                state, at = tried, left
                break
        else:
            break
    return at


def moved(state: F64, place: int) -> F64:
    """The state with one component slightly increased."""
    other = state.copy()
    other[place] += SLOPE_STEP
    return other


def seen(simulated: SimulatedLog, rows: I64, path: F64, effects: tuple[Effect, ...]) -> F64:
    """The poses (n, 3) that the sensor measures of the plant's states, yaw unwrapped as in the log."""
    part = simulated.truth.take(rows)
    motion = replace(part, x_m=path[:, plant.X], y_m=path[:, plant.Y], yaw_rad=path[:, plant.YAW])
    motion = as_seen(motion, effects)
    return np.column_stack([motion.x_m, motion.y_m, motion.yaw_rad])
