"""Noise of the pose that is correlated in time, as white noise that says as much about motion.

A marker that wobbles looks like a robot that is shaken: a filter that takes its noise for white finds
disturbances of metres per second squared. White noise of the wobble's density at the frequencies of a drive
tells a filter as much. On a whole log; :mod:`.colour` has the causal estimate.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.differentiate.colour import Scales, explanations, shapes_of
from wmr_replay.differentiate.likely_noise import likely_noise
from wmr_schemas.arrays import F64


class WholeColour(NamedTuple):
    """Of position and yaw (2,): variance of a row's noise as white noise, what a tracker of white noise takes
    for it, and the wobble's variance, all as :mod:`~wmr_replay.differentiate.likely_noise` has them.
    """

    as_white: F64
    tracked: F64
    wobble: F64

    @property
    def factor(self) -> F64:
        """How much a tracked variance (2,) grows; 1 where the noise looks white."""
        return np.maximum(self.as_white / np.where(self.tracked > 0, self.tracked, 1.0), 1.0)


def whole_colour(t_s: F64, pose: F64) -> WholeColour:
    """The colour of the poses (3, n) at ``t_s`` (n,)."""
    step_s = float(np.median(np.diff(t_s)))
    scales = Scales(step_s)
    shapes = shapes_of([scale.b for scale in scales.scales], step_s)
    scales.push(np.stack([t_s, *pose, np.zeros(len(t_s))]))
    n, squares = scales.levels()
    found = [
        likely_noise(explanations(one, seen, shapes), step_s)
        for one, seen in zip((2 * n, n), squares, strict=True)
    ]
    return WholeColour(*np.array(found).T)
