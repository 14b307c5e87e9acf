"""The compiled loop of the two-wheeled plant: driver and mode switches on one grid of instants."""

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.compiled import compiled
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import Commands, Gains
from wmr_synth.driving.path_tracking import towards_path
from wmr_synth.plants import two_wheeled as plant
from wmr_synth.plants.motion import Motion, union_of_sorted
from wmr_synth.plants.two_wheeled import (
    N_STATES,
    PHI_1,
    PHI_2,
    SIGMA_1,
    SIGMA_2,
    THETA,
    V_THETA,
    V_X,
    V_Y,
    Coefficients,
    X,
    Y,
)

STANDING = 1e-3
"""Speed in m/s plus yaw rate in rad/s below which a reference stands still, and nothing is corrected."""
_LEFT, _RIGHT, _A_LONG, _YAW_ACC = N_STATES, N_STATES + 1, N_STATES + 2, N_STATES + 3
_N_RECORDED = N_STATES + 4


def simulate(
    robot: RobotParameters,
    modes: ModeTrack,
    commands: Commands,
    torque_ns: I64,
    pose_ns: I64,
    start: tuple[float, float],
) -> Motion:
    """The motion at all torque, pose and switch instants, starting at the origin with (v_long, yaw_rate).

    All instants are nanoseconds since the start. A torque holds from its instant to the next one; before the
    first it is 0. Raises InvalidSetting when the robot lacks parameters that the modes need.
    """
    c = plant.coefficients(robot, set(np.unique(modes.mode).tolist()))
    t_ns = union_of_sorted(pose_ns, torque_ns, modes.t_ns)
    mode = modes.mode[np.searchsorted(modes.t_ns, t_ns, side="right") - 1]
    state = np.zeros(N_STATES)
    state[THETA] = -np.pi / 2
    state[V_Y], state[V_THETA] = start[0], start[1] * c.half_track_m
    wanted = commands.rows(-np.pi / 2)
    is_torque = np.zeros(len(t_ns), bool)
    is_torque[np.searchsorted(t_ns, torque_ns)] = True
    record = run(t_ns, mode, is_torque, wanted, commands.gains, c, state)
    return to_robot_conventions(t_ns, mode, record, c)


@compiled
def run(t_ns: I64, mode: I8, is_torque: Bool, wanted: F64, gains: Gains, c: Coefficients, state: F64) -> F64:
    """The state, the efforts (left, right) and v̇_y, θ̈ at every instant: (14, n)."""
    n = len(t_ns)
    record = np.empty((_N_RECORDED, n))
    work = np.empty((5, N_STATES))
    integral = np.zeros(2)
    left = right = 0.0
    k, previous_ns = 0, t_ns[0]
    for i in range(n):
        if i == 0 or mode[i] != mode[i - 1]:
            plant.jump(mode[i], state)
        if is_torque[i]:
            dt = (t_ns[i] - previous_ns) / NS_PER_S
            left, right = efforts(wanted[k], state, gains, c, integral, dt)
            previous_ns = t_ns[i]
            k += 1
        plant.derivative(mode[i], state, -right, -left, c, work[0])
        record[:N_STATES, i] = state
        record[_LEFT, i], record[_RIGHT, i] = left, right
        record[_A_LONG, i], record[_YAW_ACC, i] = work[0, V_Y], work[0, V_THETA] / c.half_track_m
        if i + 1 < n:
            plant.advance(mode[i], state, -right, -left, (t_ns[i + 1] - t_ns[i]) / NS_PER_S, c, work)
    return record


@compiled
def references(wanted: F64, state: F64, gains: Gains) -> tuple[float, float]:
    """Speed and yaw rate to follow: where gains say so, corrected towards the path while it is driven."""
    v, yaw_rate = wanted[2], wanted[3]
    if gains.heading_per_s > 0.0 and abs(v) + abs(yaw_rate) > STANDING:
        off = wanted[4] - state[X], wanted[5] - state[Y], wanted[8] - state[THETA]
        heading = wanted[6], wanted[7]
        return towards_path(
            v, yaw_rate, off, heading, (gains.ahead_per_s, gains.across_per_m2, gains.heading_per_s)
        )
    return v, yaw_rate


@compiled
def efforts(
    wanted: F64, state: F64, gains: Gains, c: Coefficients, integral: F64, dt: float
) -> tuple[float, float]:
    """The efforts (left, right) in N·m: feedforward plus PI, within the limit; updates ``integral``."""
    v, yaw_rate = references(wanted, state, gains)
    error_sum = v - state[V_Y]
    error_diff = yaw_rate * c.half_track_m - state[V_THETA]
    total = (gains.proportional_per_s * error_sum + gains.integral_per_s2 * integral[0]) / c.alpha
    difference = (gains.proportional_per_s * error_diff + gains.integral_per_s2 * integral[1]) / c.alpha_yaw
    left = wanted[0] + 0.5 * (total - difference)
    right = wanted[1] + 0.5 * (total + difference)
    if abs(left) <= gains.limit_nm and abs(right) <= gains.limit_nm:
        integral[0] += error_sum * dt
        integral[1] += error_diff * dt
    return max(-gains.limit_nm, min(gains.limit_nm, left)), max(-gains.limit_nm, min(gains.limit_nm, right))


def to_robot_conventions(t_ns: I64, mode: I8, record: F64, c: Coefficients) -> Motion:
    """REP 103: yaw = θ + π/2, v_lat = −v_x, left positive; efforts and wheel speeds forward positive."""
    v_y, v_theta = record[V_Y], record[V_THETA]
    sigma_1, sigma_2 = record[SIGMA_1], record[SIGMA_2]
    return Motion(
        t_ns=t_ns,
        x_m=record[X],
        y_m=record[Y],
        yaw_rad=record[THETA] + np.pi / 2,
        v_long_mps=v_y,
        v_lat_mps=0.0 - record[V_X],
        yaw_rate_radps=v_theta / c.half_track_m,
        a_long_mps2=record[_A_LONG],
        yaw_acc_radps2=record[_YAW_ACC],
        sigma_sum_mps=0.0 - sigma_2,
        sigma_diff_mps=0.0 - sigma_1,
        effort_left_nm=record[_LEFT],
        effort_right_nm=record[_RIGHT],
        left_rad=0.0 - record[PHI_2],
        right_rad=0.0 - record[PHI_1],
        left_radps=(v_y - v_theta - 1.5 * (sigma_2 - sigma_1)) / c.wheel_radius_m,
        right_radps=(v_y + v_theta - 1.5 * (sigma_1 + sigma_2)) / c.wheel_radius_m,
        mode=mode,
    )
