"""How well one signal is explained by others at every lag, from running sums of bounded size.

For each lag j the least-squares fit y[k] ≈ c₀ + Σ c_i x_i[k + j] over all k where both are known. The sums
are kept for ``N_GROUPS`` groups of blocks of the log, so that the fit without any one group can be made as
well: the jackknife's deviation holds for residuals that are correlated within a block.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from wmr_schemas.arrays import F64

N_GROUPS = 16
RIDGE = 1e-9
"""Relative to the diagonal: a signal that never changes explains nothing, and is no error."""


class LaggedFit:
    """``push(x, y)`` points of an even grid, ``x`` (p, n) and ``y`` (n,), NaN where unknown.

    Blocks of ``n_block`` points of y are summed once the x up to ``n_lags`` points later are there. The sums
    depend on the points alone, not on the batches. The last block is left out while it is not complete.
    """

    def __init__(self, n_signals: int, n_lags: int, n_block: int) -> None:
        self.n_lags, self._n_block, self._n_blocks = n_lags, n_block, 0
        self._rows, self._columns = np.triu_indices(n_signals + 1)
        self._sums = np.zeros((N_GROUPS, len(self._rows), 2 * n_lags + 1, 3))
        self._x = np.full((n_signals, n_lags), np.nan)
        self._y = np.empty(0)

    def push(self, x: F64, y: F64) -> None:
        """The next points."""
        self._x = np.concatenate([self._x, x], axis=1)
        self._y = np.concatenate([self._y, y])
        begin, reach = 0, 2 * self.n_lags + self._n_block
        while self._x.shape[1] - begin >= reach:
            self._sum_up(self._x[:, begin : begin + reach], self._y[begin : begin + self._n_block])
            begin += self._n_block
        self._x, self._y = self._x[:, begin:], self._y[begin:]

    def _sum_up(self, x: F64, y: F64) -> None:
        """Add a block: y (n_block,) with the x (p, n_block + 2 n_lags) around it."""
        group = self._sums[self._n_blocks % N_GROUPS]
        self._n_blocks += 1
        known_x, known_y = np.isfinite(x).all(axis=0), np.isfinite(y)
        if not (known_x.any() and known_y.any()):
            return
        ones = np.where(known_x, np.vstack([np.ones(x.shape[1]), x]), 0.0)
        products = ones[self._rows] * ones[self._columns]
        powers = np.where(known_y, np.stack([np.ones(len(y)), y, y**2]), 0.0)
        group += sliding_window_view(products, len(y), axis=1) @ powers.T

    @property
    def groups(self) -> F64:
        """The sums of each group that has any, (g, q, lags, 3)."""
        return self._sums[self._sums[:, 0].any(axis=(1, 2))]

    def fits(self, sums: F64) -> tuple[F64, F64]:
        """By lag the number of points (lags,), and the share of the variance of y that is explained."""
        p = int(self._columns[-1]) + 1
        normal = np.empty((sums.shape[1], p, p))
        normal[:, self._rows, self._columns] = normal[:, self._columns, self._rows] = sums[..., 0].T
        normal[:, range(p), range(p)] *= 1 + RIDGE
        normal[:, range(p), range(p)] += np.finfo(float).tiny ** 0.5
        against = sums[:p, :, 1].T
        explained = (against * np.linalg.solve(normal, against[..., None])[..., 0]).sum(axis=1)
        n = sums[0, :, 0]
        offset = sums[0, :, 1] ** 2 / np.maximum(n, 1)
        whole = sums[0, :, 2] - offset
        share = np.divide(
            explained - offset, whole, out=np.zeros_like(n), where=whole > RIDGE * sums[0, :, 2]
        )
        return n, np.clip(share, 0.0, 1 - RIDGE)
