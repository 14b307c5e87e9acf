"""What a base is to the oracle: parameters, how well calibration drives show them, and what they leave.

Channels by torques are dv_long/dt, v_lat and l·dyaw_rate/dt, by wheel speeds v_long, v_lat and the yaw rate.
A base explains them by the columns of ``parts``; what least squares leave of the true motion of the
calibration drives is its disturbance: a level and a time by channel.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from worlds.oracle_filter import (
    BIN_S,
    DISTURBANCE,
    N_STATES,
    PER_BIN,
    START_SD,
    YAW,
    Q,
    Steps,
    V,
    W,
    X,
    Y,
    binned,
    exponential,
    whitened,
)
from worlds.oracle_forms import Trace

from engine.case import Case
from engine.drive import RATE_HZ, Motion
from engine.logs import WHEEL_SPEED_SD_RADPS, Logged, calibration_cases, driven_through
from engine.robot import Robot
from wmr_schemas.arrays import F64

SHORT_S, LONG_S = 0.2, 2.0
"""Means over so long give a rest's level and, by how slowly they fall, its time."""
LEAST_LEVEL, TIMES_S = 1e-4, (0.1, 10.0)


@dataclass(frozen=True, eq=False)
class Base:
    """Parameters (p,) and their information (p, p) at a noise; a rest's level and time by channel (3,)."""

    parameters: F64
    information: F64
    level: F64
    time_s: F64


def axle(found: Logged) -> Motion:
    """The motion with the heading of the robot, not of a turned site."""
    motion = found.motion
    return replace(motion, yaw_rad=motion.yaw_rad - found.hidden.sizes.get("angle_rad", 0.0))


def body_pose(motion: Motion) -> F64:
    """Rates (3, n) of x, y and yaw."""
    cosine, sine = np.cos(motion.yaw_rad), np.sin(motion.yaw_rad)
    v, w = motion.v_long_mps, motion.v_lat_mps
    return np.stack([v * cosine - w * sine, v * sine + w * cosine, motion.yaw_rate_radps])


def parts(motion: Motion, robot: Robot) -> F64:
    """What each parameter of a base adds to the channels, (p, 3, n)."""
    l, v, q = robot.half_track_m, motion.v_long_mps, motion.yaw_rate_radps
    none = np.zeros_like(v)
    if robot.by_wheels:
        half_radius = robot.wheel_radius_m / 2
        v = half_radius * (motion.right_radps + motion.left_radps)
        q = half_radius * (motion.right_radps - motion.left_radps) / l
        rows = [(v, none, none), (l * q, none, v / l), (none, none, q), (none, q, none), (none, v * q, none)]
    else:
        total, apart = motion.right_nm + motion.left_nm, motion.right_nm - motion.left_nm
        rows = [
            (robot.alpha * total, none, none),
            (none, none, robot.alpha_yaw * apart),
            (-v, none, none),
            (none, none, -l * q),
            (q * q, none, none),
            (none, none, v * q),
            (none, v * q, none),
        ]
    return np.stack([np.stack(row) for row in rows])


def channels(motion: Motion, robot: Robot) -> F64:
    """What a base explains, (3, n)."""
    v, w, q = motion.v_long_mps, motion.v_lat_mps, motion.yaw_rate_radps
    if robot.by_wheels:
        return np.stack([v, w, q])
    ahead, turning = (np.diff(one, append=one[-1]) * RATE_HZ for one in (v, robot.half_track_m * q))
    return np.stack([ahead, w, turning])


def left_by_base(motion: Motion, robot: Robot, base: Base) -> F64:
    """What a base does not explain of the channels, (3, n)."""
    return channels(motion, robot) - np.tensordot(base.parameters, parts(motion, robot), axes=1)


def columns_of(motion: Motion, robot: Robot) -> list[Trace]:
    """Traces of the base's parameters; by wheel speeds the pose's delay is one."""
    columns = [Trace(part, np.zeros_like(part)) for part in parts(motion, robot)]
    late = body_pose(motion)
    return [*columns, Trace(np.zeros_like(late), late)] if robot.by_wheels else columns


def base_of(case: Case) -> Base:
    """The base of a case's calibration drives, at the case's noise."""
    return fitted(calibration_cases(case))


@lru_cache
def fitted(cases: tuple[Case, ...]) -> Base:
    """A base of calibration drives."""
    drives = [driven_through(case) for case in cases]
    robot = drives[0].robot
    seen = [binned(channels(drive.motion, robot)) for drive in drives]
    explained = [binned(parts(drive.motion, robot)) for drive in drives]
    target = np.concatenate([one.ravel() for one in seen])
    columns = np.concatenate([part.reshape(len(part), -1) for part in explained], axis=1)
    found = np.linalg.lstsq(columns.T, target, rcond=None)[0]
    rest = [one - np.tensordot(found, part, axes=1) for one, part in zip(seen, explained, strict=True)]
    level, time_s = coloured(np.concatenate(rest, axis=1))
    base = Base(found, np.zeros((0, 0)), level, time_s)
    known = 0.0
    for case, drive in zip(cases, drives, strict=True):
        steps = steps_of(drive.motion, robot, base, case.noise_sd)
        shown = whitened(steps, columns_of(drive.motion, robot))
        known = known + shown.T @ shown
    return replace(base, information=np.asarray(known))


def coloured(rest: F64) -> tuple[F64, F64]:
    """Levels and times of a rest (3, n) at the bins: of noise that forgets exponentially, means over T have
    the variance 2 level² time / T.
    """
    short, long = (spread(rest, round(s / BIN_S)) for s in (SHORT_S, LONG_S))
    level = np.maximum(short, LEAST_LEVEL)
    return level, np.clip(LONG_S * (long / level) ** 2 / 2, *TIMES_S)


def spread(rest: F64, width: int) -> F64:
    """Root mean square of means over so many bins, by channel."""
    n = rest.shape[1] // width * width
    means = rest[:, :n].reshape(len(rest), -1, width).mean(axis=2)
    return np.asarray(np.sqrt(np.mean(means**2, axis=1)))


def steps_of(motion: Motion, robot: Robot, base: Base, noise_sd: tuple[float, float]) -> Steps:
    """The linear model along a motion, with the rest of the base and the noise of poses and wheels."""
    n = len(motion.t_s) // PER_BIN
    square = np.zeros((n, N_STATES + 3, N_STATES + 3))
    square[:, :N_STATES] = dynamics(motion, robot)
    own = range(DISTURBANCE, DISTURBANCE + 3)
    square[:, own, own] = -1 / base.time_s
    flow = exponential(square * BIN_S)
    variance = base.level**2
    process, start = np.zeros((2, N_STATES, N_STATES))
    process[own, own] = variance * (1 - np.exp(-2 * BIN_S / base.time_s))
    start[range(6), range(6)] = START_SD**2
    start[own, own] = variance
    if robot.by_wheels:
        one_m2 = (robot.wheel_radius_m * WHEEL_SPEED_SD_RADPS) ** 2 / 2 / RATE_HZ * BIN_S
        process[X, X] = process[Y, Y] = one_m2
        process[YAW, YAW] = one_m2 / robot.half_track_m**2
    white = np.diag(np.array([noise_sd[0], noise_sd[0], noise_sd[1]]) ** 2 / PER_BIN)
    return Steps(flow[:, :N_STATES, :N_STATES], flow[:, :N_STATES, N_STATES:], process, start, white)


def dynamics(motion: Motion, robot: Robot) -> F64:
    """Derivative of the state by the state, and behind it by three inputs, (n, 12, 15) at the bins."""
    rates, yaw = binned(body_pose(motion)), binned(motion.yaw_rad)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    found = np.zeros((len(yaw), N_STATES, N_STATES + 3))
    found[:, X, YAW], found[:, Y, YAW] = -rates[1], rates[0]
    for first in (DISTURBANCE, N_STATES):
        found[:, X, first + 1], found[:, Y, first + 1] = -sine, cosine
        if robot.by_wheels:
            found[:, X, first], found[:, Y, first], found[:, YAW, first + 2] = cosine, sine, 1.0
        else:
            found[:, V, first], found[:, Q, first + 2] = 1.0, 1 / robot.half_track_m
    if not robot.by_wheels:
        found[:, X, V], found[:, Y, V], found[:, YAW, Q] = cosine, sine, 1.0
    found[:, W, W] = -1.0
    return found
