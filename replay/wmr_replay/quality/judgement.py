"""What the comparisons of signs and units say, cell by cell, and which of it bars an answer."""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality import explain
from wmr_replay.quality.explain import Explained
from wmr_replay.quality.plausibility_limits import LIMITS
from wmr_replay.quality.ratios import WheelRatios
from wmr_replay.quality.response import Response
from wmr_replay.quality.signs import (
    Torques,
    Wheels,
    torque_signs,
    wheel_signs,
    yaw_is_clockwise,
    yaw_is_right,
)
from wmr_replay.quality.turning import PathRatios
from wmr_schemas.arrays import I64, Bool
from wmr_schemas.robot import RobotParameters

CODES = (*explain.CODES, "torque_sign", "sides_swapped", "wheel_speed_sign")
"""Findings on signs and units, in the order of the rows of :class:`Judgement`."""


TOLD_BY_TURNS = (Torques.SWAPPED, Torques.TURN_REVERSED, Torques.REVERSED_AND_SWAPPED)


class Comparisons(NamedTuple):
    """All that is compared, after each of m cells."""

    wheels: WheelRatios
    path: PathRatios
    response: Response
    robot: RobotParameters


class Judgement(NamedTuple):
    """After each of m cells: the fault of a unit, signs, and per code whether it is found and bars."""

    explained: Explained
    torques: I64
    wheels: I64
    clockwise: Bool
    found: Bool
    bars: Bool


def judge(c: Comparisons) -> Judgement:
    """The judgement after each cell."""
    decades = explain.compare(c.wheels, c.path, c.response, c.robot)
    wheels = wheel_signs(c.wheels)
    one_side = (wheels == Wheels.LEFT_REVERSED) | (wheels == Wheels.RIGHT_REVERSED)
    decades[:2, one_side] = np.nan
    explained = explain.explain(decades, c.path)
    torques = torque_signs(c.response)
    clockwise = yaw_is_clockwise(c.path)
    unit, barring = units(explained)
    unit[explain.YAW] |= clockwise
    barring[explain.YAW] |= clockwise
    # A wrong yaw turns speed and acceleration too: their signs then say nothing, least of all of turns.
    wrong_yaw, right_yaw = unit[explain.YAW], yaw_is_right(c.path, c.response.n)
    torques = np.where(right_yaw | ~np.isin(torques, TOLD_BY_TURNS), torques, Torques.AS_THEY_SHOULD)
    wheels_swapped = (wheels == Wheels.SWAPPED) & right_yaw
    swapped = (torques == Torques.SWAPPED) | ((torques == Torques.TURN_REVERSED) & wheels_swapped)
    reversed_ = (torques != Torques.AS_THEY_SHOULD) & ~swapped
    wheels_reversed = (wheels != Wheels.AS_THEY_SHOULD) & (wheels != Wheels.SWAPPED)
    signs = np.stack([reversed_, swapped | wheels_swapped, wheels_reversed]) & ~wrong_yaw
    bars = np.stack([reversed_, swapped, np.zeros_like(swapped)]) & ~wrong_yaw
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
    bars[explain.TORQUE] &= size > LIMITS.barring_torque
    return found, bars
