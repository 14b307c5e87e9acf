"""The turning of the yaw against the turning of the path, and how fast the robot moves; from the pose alone.

Positions and yaw are averaged over cells, so that no design of a differentiator and no repair of the pose
stands between: a yaw in degrees looks like jumps to both.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.cells import Means
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_replay.quality.votes import Tally, Votes
from wmr_schemas.arrays import F64

LEAST_TURN_RAD, MOST_TURN_RAD = 0.15, 1.5
"""The path turns by as much from one cell to the next where it is compared. Less is lost in sideslip and
noise, more may be a reversal.
"""
LONGEST = 2
"""Cells of the longest chord: 1 s, a turn of less than half a circle up to 3 rad/s."""
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
    """Stage: means over cells → tallies. Where a cell's chord is lost in noise, one over two cells votes."""

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._votes = [Votes(sums) for _ in PathRatios._fields]
        self._last = np.full((5, 2 * LONGEST), np.nan)

    def push(self, means: Means) -> PathRatios:
        """The next cells (m,)."""
        cells = np.concatenate([self._last, np.stack(means[:5])], axis=1)
        self._last = cells[:, -2 * LONGEST :]
        short = chord_factors(cells[:, 2 * (LONGEST - 1) :], 1)
        factors = (
            np.where(np.isnan(a), b, a) for a, b in zip(short, chord_factors(cells, LONGEST), strict=True)
        )
        return PathRatios(*(v.push(f) for v, f in zip(self._votes, factors, strict=True)))


def chord_factors(cells: F64, k: int) -> tuple[F64, F64, F64]:
    """Factors (m,) by chords over k cells, NaN where one abstains; yaw is compared at the chords' middles.

    ``cells`` (5, 2k + m): time, mean x, y and yaw, variance of mean x.
    """
    t_s, _, _, yaw_rad, variance = cells
    steps = cells[1:3, k:] - cells[1:3, :-k]
    length = np.hypot(*steps)
    clear = length**2 * COURSE_SD_RAD**2 > variance[k:] + variance[:-k]
    course = np.where(clear, np.arctan2(steps[1], steps[0]), np.nan)
    turned = np.remainder(course[k:] - course[:-k] + np.pi, 2 * np.pi) - np.pi
    path = np.where((np.abs(turned) > LEAST_TURN_RAD) & (np.abs(turned) < MOST_TURN_RAD), turned, np.nan)
    yaw = yaw_rad[k:] + yaw_rad[:-k] if k % 2 else 2 * yaw_rad[k // 2 : -(k // 2)]
    time_s = (t_s[k:] - t_s[:-k])[k:]
    speed = np.where(clear, length, np.nan)[k:] / time_s
    return (yaw[k:] - yaw[:-k]) / 2 / path, speed, speed * np.abs(path) / time_s
