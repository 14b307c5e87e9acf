"""Rows gathered into blocks, so that tables and timeline do once what they would do for every batch."""

from collections.abc import Iterator, Sequence

import numpy as np

from wmr_replay.pipeline.columns import Columns

BLOCK_ROWS, LIVE_BLOCK_ROWS = 65_536, 4_096
"""Rows that are handed on at one time; fewer where a viewer looks on."""


class RowBlocks:
    """Stage: columns of any number of rows → columns of ``block_rows`` rows, of the ``names`` alone.

    The blocks depend on the rows, not on the batches in which they come. A column that only some of a block's
    batches have is NaN elsewhere.
    """

    def __init__(self, names: Sequence[str], block_rows: int = BLOCK_ROWS) -> None:
        self._names, self._block_rows = names, block_rows
        self._held: Columns = {}
        self._n_held = 0

    def push(self, columns: Columns) -> Iterator[Columns]:
        """Append rows; the blocks that they complete."""
        n, done = len(columns["t_ns"]), 0
        while done < n:
            took = min(n - done, self._block_rows - self._n_held)
            self._hold(columns, slice(done, done + took))
            done += took
            if self._n_held == self._block_rows:
                yield from self.finish()

    def finish(self) -> Iterator[Columns]:
        """The rows still held, if any."""
        if self._n_held:
            yield self._taken()

    def _taken(self) -> Columns:
        """The rows held, which are held no longer."""
        block = {name: column[: self._n_held] for name, column in self._held.items()}
        self._held, self._n_held = {}, 0
        return block

    def _hold(self, columns: Columns, rows: slice) -> None:
        """Copy these rows behind those that are held."""
        n = rows.stop - rows.start
        place = slice(self._n_held, self._n_held + n)
        for name in self._names:
            if name in columns and name not in self._held:
                self._held[name] = self._empty(columns[name].dtype)
            if name in columns:
                self._held[name][place] = columns[name][rows]
            elif name in self._held:
                self._held[name][place] = np.nan
        self._n_held += n

    def _empty(self, dtype: np.dtype[np.generic]) -> np.ndarray[tuple[int], np.dtype[np.generic]]:
        """A column of a block, NaN where rows are held that lack it."""
        column = np.empty(self._block_rows, dtype)
        if self._n_held:
            column[: self._n_held] = np.nan
        return column
