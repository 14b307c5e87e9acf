"""Noise of a colour that is not known for sure, as the white noise that hides as much slow motion.

A wobble that a log shows weakly is still likelier than none, and a filter that takes it for white noise takes
it for motion. So the answer is a mean over no wobble and every correlation time, by their likelihood.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.differentiate.colour import (
    TIMES_S,
    WHITE,
    WOBBLE,
    Explained,
)

FORGOTTEN_S = 0.2
"""To a filter that remembers so long, a slower wobble is motion."""
NONE = 0.5
"""Probability that nothing wobbles, before any data. Judgement; the times share the rest evenly."""
COST = 2.0
"""Deviance that the wobble's size costs. Statistics: Akaike's."""


class LikelyNoise(NamedTuple):
    """Variances: of white noise that hides as much, of what a tracker of white noise sees, of the wobble."""

    as_white: float
    tracked: float
    wobble: float

    @property
    def factor(self) -> float:
        """How much a tracked variance grows."""
        return max(self.as_white / self.tracked, 1.0) if self.tracked > 0 else 1.0


UNKNOWN = LikelyNoise(0.0, 0.0, 0.0)


def likely_noise(found: Explained | None, step_s: float) -> LikelyNoise:
    """The noise behind what explains the mean squares of differences ``step_s`` apart; 0 where too few tell.

    A wobble of w for τ hides as white noise of its density at the angular frequency 1/T, T =
    :data:`FORGOTTEN_S`: w 2 τ/(1 + (τ/T)²) over the step. Its weight is exp(−deviance/2), with
    :data:`COST`, times the prior.
    """
    if found is None:
        return UNKNOWN
    sizes, times_s = found.sizes, np.array(TIMES_S)
    hides = 2 * times_s / (1 + (times_s / FORGOTTEN_S) ** 2) / step_s
    each = np.append(sizes[:, WHITE] + hides * sizes[:, WOBBLE], found.sizes_white[WHITE])
    wobble = np.append(sizes[:, WOBBLE], 0.0)
    prior = np.append(np.full(len(times_s), (1 - NONE) / len(times_s)), NONE)
    cost = np.append(found.deviance + COST, found.deviance_white)
    weight = prior * np.exp(-0.5 * (cost - cost.min()))
    weight /= weight.sum()
    return LikelyNoise(float(weight @ each), found.tracked, float(weight @ wobble))
