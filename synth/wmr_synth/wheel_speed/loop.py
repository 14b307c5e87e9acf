"""The compiled loop of a robot that wheel speeds drive: driver, drive and contact on one grid of instants."""

import math
from dataclasses import dataclass, replace

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.compiled import compiled
from wmr_synth.hidden.rolling import RollingHidden
from wmr_synth.plants.limited_traction import GRAVITY_MPS2
from wmr_synth.plants.motion import Motion, union_of_sorted
from wmr_synth.wheel_speed.chassis import WheelRobot
from wmr_synth.wheel_speed.contact import slide
from wmr_synth.wheel_speed.drive import (
    A_LONG,
    LOST_L,
    LOST_LAT,
    LOST_R,
    N_STATES,
    PHI_L,
    PHI_R,
    PULL_L,
    PULL_R,
    SLIP_L,
    SLIP_R,
    SPIN_L,
    SPIN_R,
    TURN,
    V_LAT,
    W_L,
    W_R,
    YAW,
    YAW_ACC,
    Rig,
    Tracking,
    V,
    X,
    Y,
    commanded,
    shaped,
    turn_wheel,
    turning,
)
from wmr_synth.wheel_speed.ground import Ground
from wmr_synth.wheel_speed.modes import modes_of
from wmr_synth.wheel_speed.torques import Drivetrain, effort_nm

MAX_STEP_S = 0.001
RECORDED = (
    *(X, Y, YAW, V, V_LAT, TURN, A_LONG, YAW_ACC, SLIP_R, SLIP_L),
    *(LOST_R, LOST_L, LOST_LAT, PHI_L, PHI_R, W_L, W_R),
    *(PULL_L, PULL_R, SPIN_L, SPIN_R),
)
"""The states that a record holds at every instant."""


@dataclass(frozen=True, eq=False)
class Reference:
    """What the driver follows at each command stamp: ``wanted`` (n, 5) holds v in m/s, yaw rate in rad/s, and
    x, y in m and yaw in rad of the path that they make.
    """

    t_ns: I64
    wanted: F64
    tracking: Tracking


@dataclass(frozen=True, eq=False)
class Outside:
    """What acts from outside: the ground, unevenness (n, 3) and accelerations (n, 3) held from ``t_ns``
    on.
    """

    ground: Ground
    t_ns: I64
    rough: F64
    push: F64


def rig_of(robot: WheelRobot, h: RollingHidden) -> Rig:
    """The coefficients of a robot with the hidden effects."""
    half_track_m = robot.half_track_m * h.track
    load_mps2 = GRAVITY_MPS2 * robot.carried / 2
    return Rig(
        robot.wheel_radius_m * h.right_scale,
        robot.wheel_radius_m * h.left_scale,
        robot.stated_radius_m,
        half_track_m,
        robot.stated_half_track_m,
        robot.icr_offset_m + h.icr_offset_m,
        robot.lateral_slip_s,
        load_mps2,
        (robot.gyration_m / half_track_m) ** 2,
        0.0 if math.isinf(robot.slip_stiffness) else 1.0 / (robot.slip_stiffness * load_mps2),
        robot.roughness,
        robot.lag_s,
        robot.acceleration_mps2 / robot.stated_radius_m,
    )


def simulate_rolling(
    robot: WheelRobot,
    reference: Reference,
    outside: Outside,
    seen: tuple[I64, ...],
    h: RollingHidden,
    drivetrain: Drivetrain | None = None,
) -> tuple[Motion, F64]:
    """The motion at all instants of ``seen`` (sorted, ns since the start), from standing still at the origin;
    and the commanded wheel speeds (m, 2), left and right in rad/s, at the driver's stamps.

    Without a ``drivetrain`` the motion has no efforts (NaN). Its slips are σ_sum = (s_R + s_L)/3 and
    σ_diff = (s_R − s_L)/3.
    """
    rig, delay_ns = rig_of(robot, h), h.delay_ns + round(robot.delay_s * NS_PER_S)
    end_ns = max(int(track[-1]) for track in (*seen, reference.t_ns))
    tracks = (*seen, reference.t_ns, reference.t_ns + delay_ns, outside.t_ns, outside.ground.t_ns)
    t_ns = union_of_sorted(*tracks)
    t_ns = t_ns[t_ns <= end_ns]
    held = [
        np.searchsorted(track, t_ns, side="right") - 1
        for track in (outside.ground.t_ns, outside.t_ns, reference.t_ns + delay_ns)
    ]
    ground = outside.ground
    mu = np.stack([ground.right, ground.left, ground.sideways], axis=1)[held[0]]
    is_command = np.zeros(len(t_ns), bool)
    is_command[np.searchsorted(t_ns, reference.t_ns)] = True
    sent = np.zeros((len(reference.t_ns) + 1, 2))
    record = np.empty((len(RECORDED), len(t_ns)))
    run(
        (t_ns, is_command, held[2] + 1, held[1]),
        (mu, outside.rough, outside.push, np.ascontiguousarray(reference.wanted)),
        reference.tracking,
        rig,
        h,
        sent,
        np.array(RECORDED),
        record,
    )
    motion = motion_of(t_ns, record, rig)
    return motion if drivetrain is None else driven_by(drivetrain, motion, record, robot), sent[1:]


@compiled
def run(
    schedule: tuple[I64, Bool, I64, I64],
    inputs: tuple[F64, F64, F64, F64],
    tracking: Tracking,
    rig: Rig,
    h: RollingHidden,
    sent: F64,
    recorded: I64,
    record: F64,
) -> None:
    """States ``recorded`` at every instant into ``record``, and commands into the rows of ``sent`` behind 0.

    ``schedule``: instants in ns, whether the driver acts, which row of ``sent`` acts, which rows of what
    comes from outside act. ``inputs``: friction (right, left, share sideways), unevenness, accelerations,
    references.
    """
    t_ns, is_command, acting, outside = schedule
    mu, rough, push, wanted = inputs
    state, work = np.zeros(N_STATES), np.zeros(7)
    k = 0
    for i in range(len(t_ns)):
        if is_command[i]:
            k += 1
            sent[k, 0], sent[k, 1] = commanded(wanted[k - 1], state, tracking, rig)
        for row in range(len(recorded)):
            record[row, i] = state[recorded[row]]
        if i + 1 == len(t_ns):
            break
        left, right = shaped(sent[acting[i], 0], sent[acting[i], 1], rig, h)
        span_s = (t_ns[i + 1] - t_ns[i]) / NS_PER_S
        n_steps = math.ceil(span_s / MAX_STEP_S * (1.0 - 1e-9))
        dt = span_s / n_steps
        for step in range(n_steps):
            to_left, to_right = turning(left, right, dt, state, rig, h)
            turn_wheel(0, to_right, dt, state, rig, h)
            turn_wheel(1, to_left, dt, state, rig, h)
            t = t_ns[i] / NS_PER_S + (step + 1) * dt
            friction, row = (mu[i, 0], mu[i, 1], mu[i, 2]), outside[i]
            slide(t, dt, rough[row], push[row], friction, state, rig, h, work)


def motion_of(t_ns: I64, record: F64, rig: Rig) -> Motion:
    """The record's columns by name, with the true mode."""
    column = dict(zip(RECORDED, record, strict=True))
    unknown = np.full(len(t_ns), np.nan)
    lost = np.stack([column[LOST_R], column[LOST_L]])
    return Motion(
        t_ns=t_ns,
        x_m=column[X],
        y_m=column[Y],
        yaw_rad=column[YAW],
        v_long_mps=column[V],
        v_lat_mps=column[V_LAT],
        yaw_rate_radps=column[TURN] / rig.half_track_m,
        a_long_mps2=column[A_LONG],
        yaw_acc_radps2=column[YAW_ACC],
        sigma_sum_mps=(column[SLIP_R] + column[SLIP_L]) / 3,
        sigma_diff_mps=(column[SLIP_R] - column[SLIP_L]) / 3,
        effort_left_nm=unknown,
        effort_right_nm=unknown,
        left_rad=column[PHI_L],
        right_rad=column[PHI_R],
        left_radps=column[W_L],
        right_radps=column[W_R],
        mode=modes_of(column[LOST_LAT], lost, column[V]),
    )


def driven_by(drivetrain: Drivetrain, motion: Motion, record: F64, robot: WheelRobot) -> Motion:
    """The motion with the torques of its wheels."""
    column = dict(zip(RECORDED, record, strict=True))
    return replace(
        motion,
        effort_left_nm=effort_nm(column[PULL_L], column[SPIN_L], column[W_L], drivetrain, robot),
        effort_right_nm=effort_nm(column[PULL_R], column[SPIN_R], column[W_R], drivetrain, robot),
    )
