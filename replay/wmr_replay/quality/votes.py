"""The factor between two signals, by a vote of the log's half seconds.

A cell of slipping, a jump or a frozen pose has one vote, like any other: up to half of them may be wrong.
"""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64

DECADES, STEP = 8.0, 0.02
"""Factors from 10⁻⁸ to 10⁸ are told apart by 5 %."""
EDGES = np.arange(-DECADES, DECADES + STEP / 2, STEP)
CENTRES = (EDGES[:-1] + EDGES[1:]) / 2


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

    def __init__(self) -> None:
        self._counts = np.zeros(len(CENTRES), np.int32)
        self._n_negative = 0

    def push(self, factors: F64) -> Tally:
        """The tally after each of the next cells (m,)."""
        cast = np.flatnonzero(np.isfinite(factors) & (factors != 0))
        logs = np.log10(np.abs(factors[cast]))
        place = np.clip(np.floor((logs + DECADES) / STEP), 0, len(CENTRES) - 1).astype(np.int64)
        ballots = np.zeros((len(factors) + 1, len(CENTRES)), np.int32)
        ballots[0] = self._counts
        ballots[cast + 1, place] = 1
        counts = np.cumsum(ballots, axis=0, dtype=np.int32)
        negative = self._n_negative + np.cumsum(np.nan_to_num(factors) < 0)
        self._counts = counts[-1]
        self._n_negative = int(negative[-1]) if len(negative) else self._n_negative
        below = np.cumsum(counts[1:], axis=1, dtype=np.int64)
        n = below[:, -1].astype(np.float64)
        low, median, high = (_quantile(below, n, share) for share in (0.25, 0.5, 0.75))
        with np.errstate(invalid="ignore"):
            return Tally(n, median, high - low, negative / n)


def _quantile(below: I64, n: F64, share: float) -> F64:
    """The quantile (m,) of histograms with the cumulative counts ``below`` (m, bins)."""
    place = np.argmax(below >= share * n[:, None], axis=1)
    return np.where(n > 0, CENTRES[place], np.nan)
