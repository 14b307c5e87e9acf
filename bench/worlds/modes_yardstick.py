"""A yardstick for contact modes, told everything but the modes: parameters, noises, disturbances, rates.

Causal: the filter's posterior. In hindsight: that of whole histories. Both are scored on the rows of the log
after the first second, as ``run`` is. What the yardstick does not know: the shortest length of an interval,
and where within its bin the mode switches.
"""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I8
from worlds.case import World
from worlds.yardstick_kernels import backward, forward
from worlds.yardstick_model import Linear, linear_of

HINDSIGHT_BIN_S, CAUSAL_BIN_S = 0.05, 0.02
HYPOTHESES, DRAWS = 100, 200
WARM_UP_S = 1.0
ECE_BINS = 10


@dataclass(frozen=True)
class Marks:
    """Share of rows with the true mode, and expected calibration error."""

    accuracy: float
    ece: float


def marks(posterior: F64, mode: I8) -> Marks:
    """Scores of posteriors (n, 3) at rows with the true modes."""
    best, level = posterior.argmax(axis=1), posterior.max(axis=1)
    right = best == mode
    place = np.minimum((level * ECE_BINS).astype(int), ECE_BINS - 1)
    off = [abs(float(np.sum(right[place == b] - level[place == b]))) for b in range(ECE_BINS)]
    return Marks(float(right.mean()), sum(off) / len(right))


def filtered(linear: Linear, hypotheses: int) -> tuple[np.ndarray, ...]:
    """The forward pass."""
    return forward(
        linear.flow,
        linear.offset,
        linear.process,
        linear.mixing,
        linear.measured,
        linear.variance,
        linear.start,
        linear.switching,
        hypotheses,
    )


def causal(world: World, hypotheses: int = HYPOTHESES) -> Marks:
    """The filter's marks; a row has the posterior of the last edge at or before it."""
    linear = linear_of(world, CAUSAL_BIN_S)
    posterior = filtered(linear, hypotheses)[-1]
    return at_rows(world, posterior, np.searchsorted(linear.edges_s, world.truth.t_s, side="right") - 2)


def hindsight(world: World, hypotheses: int = HYPOTHESES, draws: int = DRAWS, seed: int = 1) -> Marks:
    """The smoother's marks; a row has the posterior of its bin."""
    linear = linear_of(world, HINDSIGHT_BIN_S)
    found = filtered(linear, hypotheses)
    posterior = backward(
        linear.flow, linear.offset, linear.process, linear.mixing, linear.switching, *found[:-1], draws, seed
    )
    return at_rows(world, posterior, np.searchsorted(linear.edges_s, world.truth.t_s, side="right") - 1)


def at_rows(world: World, posterior: F64, bins: np.ndarray) -> Marks:
    """Marks at the rows behind the warm-up, each with the posterior of its bin."""
    rows = (world.truth.t_s > WARM_UP_S) & (bins >= 0) & (bins < len(posterior))
    return marks(posterior[bins[rows]], world.truth.mode[rows])
