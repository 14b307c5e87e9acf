"""What the comparisons of signs and units say, cell by cell, and which of it bars an answer."""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality import explain
from wmr_replay.quality.explain import Explained
from wmr_replay.quality.ratios import WheelRatios
from wmr_replay.quality.response import Response
from wmr_replay.quality.signs import Torques, Wheels, torque_signs, wheel_signs, yaw_is_clockwise
from wmr_replay.quality.turning import PathRatios
from wmr_schemas.arrays import I64, Bool
from wmr_schemas.robot import RobotParameters

CODES = (*explain.CODES, "torque_sign", "sides_swapped", "wheel_speed_sign")
"""Findings on signs and units, in the order of the rows of :class:`Judgement`."""
BARRING_TORQUE_DECADES = 1.6
"""Torques 40 times too large: the model foresees accelerations that never come, and calls that slipping. The
paper's robot, slipping throughout, answers 26 times less than its parameters say.
"""


class Comparisons(NamedTuple):
    """All that is compared, after each of m cells."""

    wheels: WheelRatios
    path: PathRatios
    response: Response
    robot: RobotParameters


class Judgement(NamedTuple):
    """After each of m cells: the fault of a unit, signs, and per code whether it is ``found`` and ``bars``."""

    explained: Explained
    torques: I64
    wheels: I64
    clockwise: Bool
    found: Bool
    bars: Bool


def judge(c: Comparisons) -> Judgement:
    """The judgement after each cell."""
    decades = explain.compare(c.wheels, c.path, c.response, c.robot)
    explained = explain.explain(decades, c.path)
    torques, wheels, clockwise = torque_signs(c.response), wheel_signs(c.wheels), yaw_is_clockwise(c.path)
    unit, barring = units(explained)
    unit[explain.YAW] |= clockwise
    barring[explain.YAW] |= clockwise
    # A wrong yaw turns speed and acceleration too: their signs then say nothing.
    right_yaw = ~unit[explain.YAW]
    swapped = torques == Torques.SWAPPED
    reversed_ = (torques != Torques.AS_THEY_SHOULD) & ~swapped
    wheels_swapped = wheels == Wheels.SWAPPED
    wheels_reversed = (wheels != Wheels.AS_THEY_SHOULD) & ~wheels_swapped
    signs = np.stack([reversed_, swapped | wheels_swapped, wheels_reversed]) & right_yaw
    bars = np.stack([reversed_, swapped, np.zeros_like(swapped)]) & right_yaw
    found, bars = np.concatenate([unit, signs]), np.concatenate([barring, bars])
    return Judgement(explained, torques, wheels, clockwise, found, bars)


def units(explained: Explained) -> tuple[Bool, Bool]:
    """Which fault of a unit (faults, m) is found, and which bars."""
    fault, size, alone = explained.fault, explained.size, explained.alone
    found = fault == np.arange(len(explain.CODES))[:, None]
    unexplained = fault == explain.UNEXPLAINED
    by_wheels = explained.off[:2].any(axis=0)
    found[explain.WHEEL] |= unexplained & by_wheels
    found[explain.TORQUE] |= unexplained & ~by_wheels
    bars = found & alone
    bars[explain.WHEEL] = False
    bars[explain.TORQUE] &= size > BARRING_TORQUE_DECADES
    return found, bars
