"""Noise of the pose that is correlated in time, as white noise that says as much about motion.

A marker that wobbles looks like a robot that is shaken: a filter that takes its noise for white finds
disturbances of metres per second squared. White noise of the wobble's density at the frequencies of a drive
tells a filter as much. On a whole log; :mod:`.colour` has the causal estimate.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.differentiate.colour import (
    EVIDENCE,
    TIMES_S,
    WHITE,
    WOBBLE,
    Scales,
    explained,
    known_scales,
    shapes_of,
    without_wobble,
)
from wmr_replay.pipeline.colour import FORGOTTEN_S
from wmr_schemas.arrays import F64


class WholeColour(NamedTuple):
    """Of position and yaw (2,): variance of a row's noise as white noise, what a tracker of white noise takes
    for it, and the wobble's variance. All 0 where the noise looks white.
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
    found = [averaged(one, seen, shapes, step_s) for one, seen in zip((2 * n, n), squares, strict=True)]
    return WholeColour(*np.array(found).T)


def averaged(n: F64, squares: F64, shapes: F64, step_s: float) -> tuple[float, float, float]:
    """Of one signal: as in :class:`WholeColour`, averaged over correlation times τ by their likelihood.

    The wobble's density at the angular frequency 1/(.2 s) is 2 w τ/(1 + (τ/.2 s)²): slower ones count as
    motion.
    """
    known = known_scales(n, squares, shapes)
    if known is None:
        return 0.0, 0.0, 0.0
    sizes, deviance = explained(*known)
    if without_wobble(*known) - deviance.min() < EVIDENCE:
        return 0.0, 0.0, 0.0
    weight = np.exp(-0.5 * (deviance - deviance.min()))
    weight /= weight.sum()
    times_s = np.array(TIMES_S)
    rows = 2 * times_s / (1 + (times_s / FORGOTTEN_S) ** 2) / step_s
    wobble = sizes[:, WOBBLE]
    return float(weight @ (sizes[:, WHITE] + rows * wobble)), float(squares[0]), float(weight @ wobble)
