"""Tests of paired differences, without ``scipy.stats``, whose import takes a second.

Source: Wilcoxon (1945) for the signed-rank test; Efron and Tibshirani (1993), ch. 13, for the percentile
bootstrap.
"""

from collections.abc import Callable

import numpy as np
from scipy.special import ndtr

from wmr_schemas.arrays import F64

MOST_EXACT = 50
"""Up to so many differences without ties, the distribution of the rank sum is counted."""


def signed_rank_p(differences: F64) -> float:
    """Wilcoxon's one-sided p that the differences (n,) are greater than 0; zeros are left out."""
    left = differences[differences != 0]
    n = len(left)
    if n == 0:
        return 1.0
    _, place, count = np.unique(np.abs(left), return_inverse=True, return_counts=True)
    ranks = (np.cumsum(count) - (count - 1) / 2)[place]
    above = float(ranks[left > 0].sum())
    if n <= MOST_EXACT and n == len(differences) and len(count) == n:
        return float(rank_sums(n)[round(above) :].sum())
    variance = n * (n + 1) * (2 * n + 1) / 24 - float((count**3 - count).sum()) / 48
    return float(ndtr(-(above - n * (n + 1) / 4) / np.sqrt(variance)))


def rank_sums(n: int) -> F64:
    """Probability of each sum of the ranks of n signs that are + or − at random."""
    shares = np.ones(1)
    for rank in range(1, n + 1):
        grown = np.zeros(len(shares) + rank)
        grown[: len(shares)] += shares
        grown[rank:] += shares
        shares = grown / 2
    return shares


def bootstrap_interval(
    pairs: tuple[F64, F64], statistic: Callable[[F64, F64], F64], draws: int, seed: int
) -> tuple[float, float]:
    """95 % interval by percentiles of the statistic, of pairs (n,) drawn with replacement.

    ``statistic`` takes both (draws, n) and works along the last axis.
    """
    n = len(pairs[0])
    chosen = np.random.default_rng(seed).integers(0, n, (draws, n))
    low, high = np.percentile(statistic(pairs[0][chosen], pairs[1][chosen]), [2.5, 97.5])
    return float(low), float(high)
