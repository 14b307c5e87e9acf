"""What each lag between two signals costs: n log(1 − R²) of the fit at that lag, over a whole log.

Both classes take points in by ``push(x, y)`` and keep ``N_GROUPS`` groups of blocks apart, in bounded memory.
``costs()`` are those of all groups and those without each one, from which a jackknife's deviation is made: it
holds for residuals that are correlated within a block.
"""

import numpy as np

from wmr_replay.quality.lagged_fit import LaggedSums
from wmr_schemas.arrays import F64, Bool

N_GROUPS = 16
LEAST_KNOWN = 0.9
"""Share of a block's points that have to be known at every lag: fewer points are fitted better by chance."""
MOST_SHARE = 0.999
"""R² of a block counts up to here, so that no block outweighs all others."""


class PooledCosts:
    """One set of coefficients for the log: every block weighs by its variance."""

    def __init__(self, n_signals: int, n_lags: int, n_block: int) -> None:
        self._blocks = LaggedSums(n_signals, n_lags, n_block)
        self._sums = np.zeros((N_GROUPS, *self._blocks.shape))

    def push(self, x: F64, y: F64) -> None:
        """The next points, (p, n) and (n,)."""
        for number, sums in self._blocks.push(x, y):
            self._sums[number % N_GROUPS] += sums

    @property
    def known(self) -> Bool:
        """Which groups have any point, (N_GROUPS,)."""
        return np.asarray(self._sums[:, 0].any(axis=(1, 2)))

    @property
    def share(self) -> float:
        """R² at the best lag."""
        return float(self._blocks.fits(self._sums.sum(axis=0))[1].max())

    def costs(self) -> F64:
        """(1 + N_GROUPS, lags): of the log, then of the log without each group."""
        whole = self._sums.sum(axis=0)
        fits = [self._blocks.fits(sums) for sums in (whole, *(whole - self._sums))]
        return np.array([n.max() * np.log1p(-share) for n, share in fits])


class BlockCosts:
    """Coefficients of its own for each block: what relates the signals may change from one to the next.

    A block in which the signals have little in common has nearly the same R² at all lags, and hardly weighs.
    """

    def __init__(self, n_signals: int, n_lags: int, n_block: int) -> None:
        self._blocks = LaggedSums(n_signals, n_lags, n_block)
        self._costs, self._n = np.zeros((N_GROUPS, self._blocks.shape[1])), np.zeros(N_GROUPS)

    def push(self, x: F64, y: F64) -> None:
        """The next points, (p, n) and (n,)."""
        for number, sums in self._blocks.push(x, y):
            n, share = self._blocks.fits(sums)
            if n.min() >= LEAST_KNOWN * self._blocks.n_block:
                self._costs[number % N_GROUPS] += n.max() * np.log1p(-np.minimum(share, MOST_SHARE))
                self._n[number % N_GROUPS] += n.max()

    @property
    def known(self) -> Bool:
        """Which groups have any block, (N_GROUPS,)."""
        return self._n > 0

    @property
    def share(self) -> float:
        """R² of the blocks at the best lag, in the geometric mean."""
        return float(-np.expm1(self._costs.sum(axis=0).min() / max(self._n.sum(), 1.0)))

    def costs(self) -> F64:
        """(1 + N_GROUPS, lags): of the log, then of the log without each group."""
        whole = self._costs.sum(axis=0)
        return np.concatenate([whole[None], whole - self._costs])
