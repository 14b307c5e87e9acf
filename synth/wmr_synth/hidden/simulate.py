"""The compiled loop of the extended plant: driver, delay, mode switches and disturbance."""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import Commands, Gains
from wmr_synth.hidden import plant
from wmr_synth.hidden.disturbance import GRID_NS, Disturbance
from wmr_synth.hidden.own import OwnAcceleration
from wmr_synth.hidden.parameters import Hidden
from wmr_synth.hidden.plant import (
    N_EXTENDED,
    PHI_LEFT,
    PHI_RIGHT,
    SIGMA_DIFF,
    SIGMA_SUM,
    TURN,
    V_LAT,
    V_LONG,
    YAW,
)
from wmr_synth.plants.motion import Motion, union_of_sorted
from wmr_synth.plants.two_wheeled import Coefficients, X, Y, coefficients, jump
from wmr_synth.plants.two_wheeled_loop import efforts

_LEFT, _RIGHT, _A_LONG, _TURN_ACC, _LEFT_RADPS, _RIGHT_RADPS = range(N_EXTENDED, N_EXTENDED + 6)


def simulate_hidden(
    robot: RobotParameters,
    modes: ModeTrack,
    commands: Commands,
    instants: tuple[I64, I64],
    start: tuple[float, float],
    hidden: Hidden,
    disturbance: tuple[Disturbance, np.random.Generator],
    own: OwnAcceleration | None = None,
) -> Motion:
    """As :func:`wmr_synth.plants.two_wheeled_loop.simulate`, with effects and a disturbance.

    ``instants`` are those of torque and pose. ``own`` gives further accelerations, each held from its instant
    to the next one; it sees the efforts that were sent last. Efforts are those that the driver commands, as a
    log shows them; the mode is the schedule's.
    """
    torque_ns, pose_ns = instants
    undeclared = hidden.undeclared_stiffness > 0.0
    acting = np.where((modes.mode == ContactMode.IDEAL) & undeclared, ContactMode.SKIDDING, modes.mode)
    c = coefficients(robot, set(np.unique(acting).tolist()))
    c = c._replace(skid_decay_mps2=c.skid_decay_mps2 * hidden.stiffness)
    silent = c._replace(skid_decay_mps2=c.skid_decay_mps2 * hidden.undeclared_stiffness)
    t_ns = grid(modes, torque_ns, pose_ns, hidden, disturbance[0])
    mode = modes.mode[np.searchsorted(modes.t_ns, t_ns, side="right") - 1]
    state = np.zeros(N_EXTENDED)
    state[V_LONG], state[TURN] = start[0], start[1] * c.half_track_m
    wanted = commands.rows()
    is_torque = np.zeros(len(t_ns), bool)
    is_torque[np.searchsorted(t_ns, torque_ns)] = True
    push, loop = disturbance[0].held(t_ns, disturbance[1]), empty_loop(len(t_ns), len(wanted))
    schedule = t_ns, mode, is_torque
    if own is None:
        run(schedule, wanted, commands.gains, push, (c, silent), hidden, state, loop, (0, len(t_ns)))
    for i in range(len(t_ns) if own is not None else 0):
        loop.record[:N_EXTENDED, i] = state
        loop.record[[_LEFT, _RIGHT], i] = loop.sent[loop.counts[0]]
        here = slice(i, i + 1)
        push[i] += own(to_motion(t_ns[here], mode[here], loop.record[:, here], c))[0]  # type: ignore[misc]
        run(schedule, wanted, commands.gains, push, (c, silent), hidden, state, loop, (i, i + 1))
    return to_motion(t_ns, mode, loop.record, c)


def grid(modes: ModeTrack, torque_ns: I64, pose_ns: I64, hidden: Hidden, disturbance: Disturbance) -> I64:
    """Every instant at which something changes or is seen, up to the last that is seen."""
    end_ns = max(torque_ns[-1], pose_ns[-1], modes.t_ns[-1])
    switches_s = (hidden.load_s, hidden.slip_start_s, hidden.slip_end_s)
    extra = [np.sort(np.rint(np.array(switches_s) * NS_PER_S).astype(np.int64)), torque_ns + hidden.delay_ns]
    if disturbance.acts:
        extra.append(np.arange(0, end_ns, GRID_NS))
    t_ns = union_of_sorted(pose_ns, torque_ns, modes.t_ns, *extra)
    kept: I64 = t_ns[(t_ns >= 0) & (t_ns <= end_ns)]
    return kept


class Loop(NamedTuple):
    """Arrays that the loop carries from instant to instant: the record (20, n), the driver's integral (2,),
    the efforts sent (m + 1, 2) with their stamps, and how many were sent and act (2,).
    """

    record: F64
    work: F64
    integral: F64
    sent: F64
    sent_ns: I64
    counts: I64


def empty_loop(n: int, n_torque: int) -> Loop:
    """The loop before ``n`` instants, ``n_torque`` of which are the driver's."""
    record, work = np.zeros((N_EXTENDED + 6, n)), np.empty((5, N_EXTENDED))
    sent, sent_ns = np.zeros((n_torque + 1, 2)), np.zeros(n_torque + 1, np.int64)
    return Loop(record, work, np.zeros(2), sent, sent_ns, np.zeros(2, np.int64))


@compiled
def run(  # noqa: PLR0913, PLR0917 – compiled
    schedule: tuple[I64, I8, Bool],
    wanted: F64,
    gains: Gains,
    push: F64,
    c: tuple[Coefficients, Coefficients],
    h: Hidden,
    state: F64,
    loop: Loop,
    span: tuple[int, int],
) -> None:
    """State, efforts (left, right) as sent, v̇, ẇ and wheel speeds (left, right) at the instants of ``span``,
    into the loop's record (20, n).

    ``schedule``: instants in ns, the mode at each, and whether the driver acts at it, (n,) each.
    ``c`` holds the coefficients of declared modes and those of a skid that the schedule calls ideal.
    """
    t_ns, mode, is_torque = schedule
    n, undeclared = len(t_ns), h.undeclared_stiffness > 0.0
    record, work, integral, sent, sent_ns, counts = loop
    k, acts = counts
    for i in range(span[0], span[1]):
        q = plant.acting(mode[i], undeclared)
        if i == 0 or mode[i] != mode[i - 1]:
            jump(q, state)
        if is_torque[i]:
            dt = (t_ns[i] - sent_ns[k]) / NS_PER_S if k > 0 else 0.0
            left, right = efforts(wanted[k], state, gains, c[0], integral, dt)
            k += 1
            sent[k, 0], sent[k, 1], sent_ns[k] = left, right, t_ns[i]
        while acts < k and sent_ns[acts + 1] + h.delay_ns <= t_ns[i]:
            acts += 1
        u_left = plant.shaped(sent[acts, 0], h.left_gain, h.bias_left_nm, h)
        u_right = plant.shaped(sent[acts, 1], h.right_gain, h.bias_right_nm, h)
        held, t = (u_left, u_right, push[i, 0], push[i, 1], push[i, 2]), t_ns[i] / NS_PER_S
        own = c[0] if q == mode[i] else c[1]
        plant.derivative(q, t, state, held, own, h, work[0])
        record[:N_EXTENDED, i] = state
        record[_LEFT, i], record[_RIGHT, i] = sent[k, 0], sent[k, 1]
        record[_A_LONG, i], record[_TURN_ACC, i] = work[0, V_LONG], work[0, TURN]
        record[_LEFT_RADPS, i], record[_RIGHT_RADPS, i] = work[0, PHI_LEFT], work[0, PHI_RIGHT]
        if i + 1 < n:
            dt = (t_ns[i + 1] - t_ns[i]) / NS_PER_S
            plant.advance(q, t, state, held, dt, own, h, work)
    counts[0], counts[1] = k, acts


def to_motion(t_ns: I64, mode: I8, record: F64, c: Coefficients) -> Motion:
    """The record's columns by name; they are in robot conventions already."""
    return Motion(
        t_ns=t_ns,
        x_m=record[X],
        y_m=record[Y],
        yaw_rad=record[YAW],
        v_long_mps=record[V_LONG],
        v_lat_mps=record[V_LAT],
        yaw_rate_radps=record[TURN] / c.half_track_m,
        a_long_mps2=record[_A_LONG],
        yaw_acc_radps2=record[_TURN_ACC] / c.half_track_m,
        sigma_sum_mps=record[SIGMA_SUM],
        sigma_diff_mps=record[SIGMA_DIFF],
        effort_left_nm=record[_LEFT],
        effort_right_nm=record[_RIGHT],
        left_rad=record[PHI_LEFT],
        right_rad=record[PHI_RIGHT],
        left_radps=record[_LEFT_RADPS],
        right_radps=record[_RIGHT_RADPS],
        mode=mode,
    )
