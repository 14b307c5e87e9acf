"""Signals of uneven stamps on an even grid, whatever the batches."""

from collections.abc import Callable

import numpy as np

from wmr_schemas.arrays import F64, I64

LONGEST_HOLE_S = 6.0
"""Longer holes count as so long, more than the lags that are looked at: stamps may lie years apart."""


class EvenGrid:
    """Stage: rows at ``t_s`` → values at the multiples of ``step_s``, linear between neighbouring rows.

    A point is NaN where a neighbour is, or where the neighbours are more than ``longest_s`` apart. The grid
    runs on behind a hole, of which ``LONGEST_HOLE_S`` at most are filled with points.
    """

    def __init__(self, step_s: float, n_signals: int, longest_s: float) -> None:
        self._step_s, self._longest_s = step_s, longest_s
        self._last_t_s, self._last = np.empty(0), np.empty((n_signals, 0))
        self._before_s, self._left_out_s = np.nan, 0.0

    def push(self, t_s: F64, values_of: Callable[[I64], F64]) -> F64:
        """Rows (n,) of strictly increasing time; the points (k, m) that they complete. ``values_of`` gives
        the signals (k, r) of r of these rows, and is asked for those beside points alone.
        """
        if not len(t_s):
            return self._last[:, :0]
        n_before = len(self._last_t_s)
        t_s = np.concatenate([self._last_t_s, self._without_long_holes(t_s)])

        def values_at(rows: I64) -> F64:
            found = values_of(np.maximum(rows - n_before, 0))
            found[:, rows < n_before] = self._last
            return found

        first, last = np.floor(t_s[[0, -1]] / self._step_s).astype(np.int64)
        grid_s = np.arange(first + 1, last + 1) * self._step_s
        after = np.clip(np.searchsorted(t_s, grid_s), 1, len(t_s) - 1)
        gap_s = t_s[after] - t_s[after - 1]
        share = (grid_s - t_s[after - 1]) / gap_s
        before, behind = values_at(after - 1), values_at(after)
        points = before + share * (behind - before)
        self._last_t_s, self._last = t_s[-1:], values_at(np.array([len(t_s) - 1]))
        return np.where(gap_s <= self._longest_s, points, np.nan)

    def _without_long_holes(self, t_s: F64) -> F64:
        """The rows' times (n,), less what holes last beyond the longest."""
        gaps_s = np.diff(t_s, prepend=self._before_s)
        if not self._left_out_s and not (gaps_s > LONGEST_HOLE_S).any():
            self._before_s = float(t_s[-1])
            return t_s
        beyond_s = np.where(gaps_s > LONGEST_HOLE_S, gaps_s - LONGEST_HOLE_S, 0.0)
        left_out_s = np.cumsum(np.concatenate([[self._left_out_s], beyond_s]))[1:]
        self._before_s, self._left_out_s = float(t_s[-1]), float(left_out_s[-1])
        return np.asarray(t_s - left_out_s)
