"""Factors between the motion and the wheels' speeds, half a second at a time."""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.cells import Means
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_replay.quality.votes import Tally, Votes
from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

CLEAR = 10.0
"""A cell has a vote where its motion is so many times the motion's standard deviation: 10 % of noise."""


class WheelRatios(NamedTuple):
    """Tallies after each cell. With the wheels' speeds × radius: ``ahead``: v_long over their mean;
    ``crossed``: v_long over half their difference, right − left; ``turn``: yaw rate × half track over that.
    """

    ahead: Tally
    crossed: Tally
    turn: Tally


class WheelVotes:
    """Stage: means over cells → tallies. An unknown radius or half track counts as 1 m."""

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._votes = [Votes(sums) for _ in WheelRatios._fields]

    def push(self, means: Means, robot: RobotParameters) -> WheelRatios:
        """The next cells (m,)."""
        radius, half_track = robot.wheel_radius_m or 1.0, robot.half_track_m or 1.0
        mean = radius * (means.right_radps + means.left_radps) / 2
        half = radius * (means.right_radps - means.left_radps) / 2
        ahead = np.where(means.v_mps**2 > CLEAR**2 * means.v_var, means.v_mps, np.nan)
        rate = means.yaw_rate_radps
        turn = np.where(rate**2 > CLEAR**2 * means.yaw_rate_var, half_track * rate, np.nan)
        factors = ratio(ahead, mean), ratio(ahead, half), ratio(turn, half)
        return WheelRatios(*(v.push(f) for v, f in zip(self._votes, factors, strict=True)))


def ratio(above: F64, below: F64) -> F64:
    """The quotient (m,), NaN where it has none."""
    return np.asarray(above / np.where(below == 0, np.nan, below))
