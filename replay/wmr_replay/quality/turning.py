"""The turning of the yaw against the turning of the path, and how fast the robot moves; from the pose alone.

Positions and yaw are averaged over cells, so that no design of a differentiator and no repair of the pose
stands between: a yaw in degrees looks like jumps to both.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.cells import Means
from wmr_replay.quality.votes import Tally, Votes
from wmr_schemas.arrays import F64

LEAST_TURN_RAD, MOST_TURN_RAD = 0.15, 1.5
"""The path turns by as much from one cell to the next where it is compared. Less is lost in sideslip and
noise, more may be a reversal.
"""
COURSE_SD_RAD = 0.05
"""The path's direction is known as well as this: a third of the least turn."""


class PathRatios(NamedTuple):
    """Tallies after each cell: ``path``: turning of the yaw over turning of the path; ``speed_mps``;
    ``lateral_mps2``: speed × turning rate of the path.
    """

    path: Tally
    speed_mps: Tally
    lateral_mps2: Tally


class PathVotes:
    """Stage: means over cells → tallies."""

    def __init__(self) -> None:
        self._votes = [Votes() for _ in PathRatios._fields]
        self._last = np.full((5, 2), np.nan)

    def push(self, means: Means) -> PathRatios:
        """The next cells (m,)."""
        cells = np.concatenate([self._last, np.stack(means[:5])], axis=1)
        self._last = cells[:, -2:]
        return PathRatios(*(v.push(f) for v, f in zip(self._votes, _factors(cells), strict=True)))


def _factors(cells: F64) -> tuple[F64, F64, F64]:
    """Factors (m,) from 2 + m cells: time, mean x, y and yaw, variance of mean x; NaN where one abstains."""
    t_s, _, _, yaw_rad, variance = cells
    steps = np.diff(cells[1:3], axis=1)
    length = np.hypot(*steps)
    clear = length**2 * COURSE_SD_RAD**2 > variance[1:] + variance[:-1]
    course = np.where(clear, np.arctan2(steps[1], steps[0]), np.nan)
    turned = np.remainder(np.diff(course) + np.pi, 2 * np.pi) - np.pi
    turns = (np.abs(turned) > LEAST_TURN_RAD) & (np.abs(turned) < MOST_TURN_RAD)
    path = np.where(turns, turned, np.nan)
    time_s = np.diff(t_s)[1:]
    speed = np.where(clear, length, np.nan)[1:] / time_s
    return (yaw_rad[2:] - yaw_rad[:-2]) / 2 / path, speed, speed * np.abs(path) / time_s
