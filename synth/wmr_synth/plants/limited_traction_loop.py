"""The compiled loop of the traction-limited plant, and the true mode that comes out of it."""

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import Commands, Gains
from wmr_synth.plants import limited_traction as traction
from wmr_synth.plants import two_wheeled as plant
from wmr_synth.plants.limited_traction import (
    E_L,
    E_R,
    N_LIMITED,
    Q_L,
    Q_R,
    TYRE,
    FrictionTrack,
    Traction,
    Tyre,
)
from wmr_synth.plants.motion import Motion, union_of_sorted
from wmr_synth.plants.two_wheeled import (
    N_STATES,
    SIGMA_1,
    SIGMA_2,
    THETA,
    V_THETA,
    V_X,
    V_Y,
)
from wmr_synth.plants.two_wheeled_loop import efforts, to_robot_conventions

SCHEDULED_SKID = int(ContactMode.SKIDDING)
"""Compiled code takes the mode as a plain integer, of one type with the array's."""
SLIP_HOLD_NS = 20_000_000
"""The mode is slipping while a wheel's force is capped and for this long after: no spell is shorter."""


def simulate_limited(
    robot: RobotParameters,
    schedule: ModeTrack,
    friction: FrictionTrack,
    commands: Commands,
    torque_ns: I64,
    pose_ns: I64,
    start: tuple[float, float],
    tyre: Tyre = TYRE,
) -> Motion:
    """As :func:`.two_wheeled_loop.simulate`, under limited traction; ``schedule`` says where the robot skids
    (1) and where not (0).

    The motion's ``mode`` is skidding as scheduled; elsewhere slipping while the demand on a wheel reaches its
    cap (seen at the instants of the motion) and for 20 ms after, which bridges any chatter; else ideal.
    """
    c = plant.coefficients(robot, set(np.unique(schedule.mode).tolist()))
    p = traction.traction_of(robot, tyre)
    t_ns = union_of_sorted(pose_ns, torque_ns, schedule.t_ns, friction.t_ns)
    skids = schedule.mode[np.searchsorted(schedule.t_ns, t_ns, side="right") - 1] == ContactMode.SKIDDING
    mu = friction.coefficient[np.searchsorted(friction.t_ns, t_ns, side="right") - 1]
    state = np.zeros(N_LIMITED)
    state[THETA] = -np.pi / 2
    state[V_Y], state[V_THETA] = start[0], start[1] * c.half_track_m
    wanted = commands.rows(-np.pi / 2)
    is_torque = np.zeros(len(t_ns), bool)
    is_torque[np.searchsorted(t_ns, torque_ns)] = True
    record, capped = run(t_ns, (skids, mu), is_torque, wanted, commands.gains, c, p, state)
    return to_robot_conventions(t_ns, true_mode(t_ns, skids, capped), record, c)


def true_mode(t_ns: I64, skids: Bool, capped: Bool) -> I8:
    """Skidding as scheduled, slipping where capped within the last 20 ms, else ideal."""
    last_ns = np.maximum.accumulate(np.where(capped, t_ns, t_ns[0] - 2 * SLIP_HOLD_NS))
    slips = t_ns - last_ns < SLIP_HOLD_NS
    return np.where(
        skids, ContactMode.SKIDDING, np.where(slips, ContactMode.SLIPPING, ContactMode.IDEAL)
    ).astype(np.int8)


def switches_of(motion: Motion) -> ModeTrack:
    """The motion's true mode, at its switches only."""
    kept = np.flatnonzero(np.diff(motion.mode, prepend=-1))
    return ModeTrack(motion.t_ns[kept], motion.mode[kept])


@compiled
def switch(
    skids: bool, state: F64, efforts_nm: tuple[float, float], cap: float, c: plant.Coefficients, p: Traction
) -> None:
    """The jump at a switch: skidding wheels do not slip; after a skid v_lat is 0 and tyres carry their
    load.
    """
    if skids:
        state[Q_R] = state[Q_L] = state[E_R] = state[E_L] = 0.0
    else:
        state[V_X] = 0.0
        traction.settle(state, efforts_nm, cap, c, p)


@compiled
def put(record: F64, state: F64, work: F64, half_track_m: float) -> None:
    """State with σ in place of q, and v̇_y, θ̈, into a column of the record."""
    record[:N_STATES] = state[:N_STATES]
    record[SIGMA_1], record[SIGMA_2] = -(state[Q_R] - state[Q_L]) / 3.0, -(state[Q_R] + state[Q_L]) / 3.0
    record[N_STATES + 2], record[N_STATES + 3] = work[V_Y], work[V_THETA] / half_track_m


@compiled
def run(
    t_ns: I64,
    ground: tuple[Bool, F64],
    is_torque: Bool,
    wanted: F64,
    gains: Gains,
    c: plant.Coefficients,
    p: Traction,
    state: F64,
) -> tuple[F64, Bool]:
    """State, efforts and accelerations as in ``two_wheeled_loop.run`` (14, n); whether a force is capped.

    ``ground`` says where the robot skids, and what friction it finds, both (n,).
    """
    skids, mu = ground
    n = len(t_ns)
    record, capped = np.empty((N_STATES + 4, n)), np.zeros(n, np.bool_)
    work, integral = np.empty((5, N_LIMITED)), np.zeros(2)
    left = right = 0.0
    k, previous_ns = 0, t_ns[0]
    for i in range(n):
        if is_torque[i]:
            left, right = efforts(wanted[k], state, gains, c, integral, (t_ns[i] - previous_ns) / NS_PER_S)
            previous_ns = t_ns[i]
            k += 1
        cap = traction.cap_of(mu[i], p)
        traction.hold(state, cap, p)
        if i == 0 or skids[i] != skids[i - 1]:
            switch(skids[i], state, (left, right), cap, c, p)
        if skids[i]:
            plant.derivative(SCHEDULED_SKID, state, -right, -left, c, work[0])
        else:
            capped[i] = traction.is_capped(state, cap, p)
            traction.derivative(state, (left, right), cap, c, p, work[0])
        put(record[:, i], state, work[0], c.half_track_m)
        record[N_STATES, i], record[N_STATES + 1, i] = left, right
        if i + 1 == n:
            break
        dt = (t_ns[i + 1] - t_ns[i]) / NS_PER_S
        if skids[i]:
            plant.advance(SCHEDULED_SKID, state, -right, -left, dt, c, work)
        else:
            traction.advance(state, (left, right), cap, dt, c, p, work)
    return record, capped
