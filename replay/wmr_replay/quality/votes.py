"""The factor between two signals, by a vote of the log's half seconds.

A cell of slipping, a jump or a frozen pose has one vote, like any other: up to half of them may be wrong.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.sums import PLAIN, Sums
from wmr_schemas.arrays import F64

DECADES, STEP = 6.0, 0.02
"""Factors from 10⁻⁶ to 10⁶ are told apart by 5 %."""
EDGES = np.arange(-DECADES, DECADES + STEP / 2, STEP)
CENTRES = (EDGES[:-1] + EDGES[1:]) / 2
SHARES = np.array([0.25, 0.5, 0.75])
NO_VOTE = -1


class Tally(NamedTuple):
    """After each of m cells, (m,): number of votes, decimal logarithm of the factor (median and interquartile
    range, NaN without votes), and the share of votes for a negative factor.
    """

    n: F64
    log10: F64
    spread: F64
    negative: F64


class Votes:
    """Stage: factors, NaN where a cell abstains → the tally after each cell."""

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._count = sums.count_votes
        self._below = np.zeros(len(CENTRES), np.int64)
        self._n_negative = 0

    def push(self, factors: F64) -> Tally:
        """The tally after each of the next cells (m,)."""
        cast = np.isfinite(factors) & (factors != 0)
        logs = np.log10(np.abs(np.where(cast, factors, 1.0)))
        place = np.clip(np.floor((logs + DECADES) / STEP), 0, len(CENTRES) - 1)
        bins = np.where(cast, place, NO_VOTE).astype(np.int64)
        negative = self._n_negative + np.cumsum(cast & (factors < 0))
        self._n_negative = int(negative[-1]) if len(negative) else self._n_negative
        n, quantiles = np.empty(len(bins)), np.empty((len(bins), len(SHARES)))
        self._count(bins, self._below, SHARES, CENTRES, n, quantiles)
        low, median, high = np.ascontiguousarray(quantiles.T)
        with np.errstate(invalid="ignore"):
            return Tally(n, median, high - low, negative / n)
