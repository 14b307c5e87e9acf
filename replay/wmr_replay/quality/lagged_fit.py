"""How well one signal is explained by others at every lag, block by block of a log.

For each lag j the least-squares fit y[k] ≈ c₀ + Σ c_i x_i[k + j] over all k where both are known, from sums
of products.
"""

from collections.abc import Iterator

import numpy as np

from wmr_schemas.arrays import F64

RIDGE = 1e-9
"""Relative to the diagonal: a signal that never changes explains nothing, and is no error."""


class LaggedSums:
    """Stage: points of an even grid, ``x`` (p, n) and ``y`` (n,), NaN where unknown → sums of each block.

    Blocks of ``n_block`` points of y are summed once the x up to ``n_lags`` points later are there. The sums
    depend on the points alone, not on the batches. The last block is left out while it is not complete.
    """

    def __init__(self, n_signals: int, n_lags: int, n_block: int) -> None:
        self.n_lags, self.n_block, self._n_blocks = n_lags, n_block, 0
        self._rows, self._columns = np.triu_indices(n_signals + 1)
        self._x = np.full((n_signals, n_lags), np.nan)
        self._y = np.empty(0)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(q, lags, 3) of the sums of a block."""
        return len(self._rows), 2 * self.n_lags + 1, 3

    def push(self, x: F64, y: F64) -> Iterator[tuple[int, F64]]:
        """The next points; number and sums (q, lags, 3) of the blocks that they complete, of those in which
        anything is known.
        """
        self._x = np.concatenate([self._x, x], axis=1)
        self._y = np.concatenate([self._y, y])
        reach = 2 * self.n_lags + self.n_block
        while self._x.shape[1] >= reach:
            sums = self._sums_of(self._x[:, :reach], self._y[: self.n_block])
            self._x, self._y = self._x[:, self.n_block :], self._y[self.n_block :]
            self._n_blocks += 1
            if sums is not None:
                yield self._n_blocks - 1, sums

    def _sums_of(self, x: F64, y: F64) -> F64 | None:
        """Σ of 1, y and y² times the products of 1 and x: ``y`` (n_block,), ``x`` (p, n_block + 2 n_lags)."""
        known_x, known_y = np.isfinite(x).all(axis=0), np.isfinite(y)
        if not (known_x.any() and known_y.any()):
            return None
        ones = np.where(known_x, [np.ones(x.shape[1]), *x], 0.0)
        products = ones[self._rows] * ones[self._columns]
        powers = np.where(known_y, [np.ones(len(y)), y, y**2], 0.0)
        sums = [[np.correlate(product, power) for power in powers] for product in products]
        return np.array(sums).transpose(0, 2, 1)

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
