"""The pose as measured, and back: a sensor at a on the robot, turned by an angle, with a drifting yaw.

position = (x, y) + R(ψ) a      yaw = ψ + angle + rate t,      t in s from the log's first pose
"""

import math

import numpy as np

from wmr_replay.effects.theta import Theta
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

ON_POSE = (Theta.HEADING, Theta.YAW_DRIFT, Theta.ARM_X, Theta.ARM_Y)
"""Places in θ that change the measured pose and not the motion."""


@lean
def yaw_error(age: float, per_s: float, theta: F64) -> tuple[float, float]:
    """The two errors of yaw in rad, constant and drifted, ``age`` after the first pose, ``per_s`` of which
    make a second.
    """
    return theta[Theta.HEADING], theta[Theta.YAW_DRIFT] * age / per_s


@lean
def moved(x: float, y: float, yaw: float, arm: tuple[float, float]) -> tuple[float, float]:
    """(x, y) + R(ψ) a in m, world frame; ``arm`` is a on the robot, forward and left."""
    if arm[0] == 0.0 and arm[1] == 0.0:
        return x, y
    cos, sin = math.cos(yaw), math.sin(yaw)
    return x + cos * arm[0] - sin * arm[1], y + sin * arm[0] + cos * arm[1]


@lean
def arm_slopes(yaw: float, theta: F64) -> tuple[float, float]:
    """Slopes of the measured x and y by yaw: those of R(ψ) a."""
    if theta[Theta.ARM_X] == 0.0 and theta[Theta.ARM_Y] == 0.0:
        return 0.0, 0.0
    cos, sin = math.cos(yaw), math.sin(yaw)
    x = -sin * theta[Theta.ARM_X] - cos * theta[Theta.ARM_Y]
    return x, cos * theta[Theta.ARM_X] - sin * theta[Theta.ARM_Y]


@lean
def slope_by_place(place: int, component: int, yaw: float, age_s: float) -> float:
    """Slope of the measured x, y or yaw (``component`` 0, 1, 2) by a place in θ, in m or rad per unit."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    slope = 0.0
    if place == Theta.ARM_X:
        slope = (cos, sin, 0.0)[component]
    elif place == Theta.ARM_Y:
        slope = (-sin, cos, 0.0)[component]
    elif place == Theta.HEADING and component == 2:
        slope = 1.0
    elif place == Theta.YAW_DRIFT and component == 2:
        slope = age_s
    return slope


def to_axle(measured: F64, age: F64, per_s: float, theta: F64) -> F64:
    """Poses (3, n) of the axle's middle N out of measured ones, ``age`` (n,) as in :func:`yaw_error`."""
    poses = measured.copy()
    move_to_axle(poses, age.astype(np.float64), float(per_s), theta)
    return poses


@lean
def move_to_axle(poses: F64, age: F64, per_s: float, theta: F64) -> None:
    """Replace measured ``poses`` (3, n) by those of N; see :func:`to_axle`."""
    back = (-theta[Theta.ARM_X], -theta[Theta.ARM_Y])
    for k in range(poses.shape[1]):
        constant, drifted = yaw_error(age[k], per_s, theta)
        poses[2, k] = poses[2, k] - constant - drifted
        poses[0, k], poses[1, k] = moved(poses[0, k], poses[1, k], poses[2, k], back)
