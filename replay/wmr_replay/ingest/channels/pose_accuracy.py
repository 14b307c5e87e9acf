"""How accurate a pose is by the covariance in its own first messages, in decades."""

import math
from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest.channels.candidate import Candidate
from wmr_replay.ingest.channels.first_rows import first_rows
from wmr_replay.ingest.decoding.bindings import Recipe, one
from wmr_replay.ingest.decoding.layout import Layout
from wmr_replay.ingest.mcap.sampling import N_WANTED
from wmr_schemas.arrays import F64

COVARIANCE = "pose.covariance"
"""Of ``PoseWithCovarianceStamped`` and ``Odometry``: 6 × 6 in rows, of x, y, z, roll, pitch, yaw."""
FINE_M, FINE_RAD = 0.05, 0.1
"""Deviations up to which poses are not told apart: what a localiser states is no finer than that."""
COARSEST = 3


@dataclass(frozen=True)
class CovarianceBinding:
    """The variances of x, y and yaw."""

    stamp: tuple[str, str] | None = None
    n_raw: int = 3

    def recipe(self, layout: Layout) -> Recipe:
        """Elements (0, 0), (1, 1) and (5, 5). Raises Undecodable when they are missing."""
        return Recipe((), tuple(one(layout, f"{COVARIANCE}[{k}]") for k in (0, 7, 35)))

    def values(self, raw: F64) -> F64:
        """The raw columns: variances in m² and rad²."""
        return raw


def decades_too_coarse(candidate: Candidate) -> int:
    """0 for a pose of 5 cm and .1 rad or better, and for one that states nothing; one more for each decade.

    A variance of zero or below, or one that is not finite, states nothing.
    """
    if not candidate.has(COVARIANCE):
        return 0
    x, y, yaw = first_rows(candidate.definition, CovarianceBinding(), candidate.samples[:N_WANTED]).values
    pairs = ((x + y) / 2, FINE_M), (yaw, FINE_RAD)
    return max(decades(variance, fine) for variance, fine in pairs)


def decades(variance: F64, fine: float) -> int:
    """By how many decades, rounded up, the median deviation (n,) is above the fine one."""
    stated = variance[np.isfinite(variance) & (variance > 0)]
    if 2 * len(stated) <= len(variance):
        return 0
    sd = math.sqrt(float(np.median(stated)))
    return min(max(math.ceil(math.log10(sd / fine) - 1e-9), 0), COARSEST)
