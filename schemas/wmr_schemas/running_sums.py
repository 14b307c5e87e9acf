"""Sums over the last entries of a sequence that comes in batches, to the same bit however it is cut."""

import numpy as np

from wmr_schemas.arrays import F64


class LastEntries:
    """``push(values)`` (m, k) returns the entries ``lag`` before each one, NaN before the first."""

    def __init__(self, n_signals: int, lag: int) -> None:
        self._held = np.full((n_signals, lag), np.nan)
        self._lag = lag

    def push(self, values: F64) -> F64:
        """The next k entries of the m signals."""
        joined = np.concatenate([self._held, values], axis=1)
        self._held = joined[:, joined.shape[1] - self._lag :]
        return joined[:, : values.shape[1]]


class RunningSums:
    """``push(values)`` (m, k) returns the sums (m, k) over the last ``n_last`` entries up to each one."""

    def __init__(self, n_signals: int, n_last: int) -> None:
        self._totals = np.zeros((n_signals, 1))
        self._before = LastEntries(n_signals, n_last)

    def push(self, values: F64) -> F64:
        """The next k entries of the m signals."""
        totals = np.cumsum(np.concatenate([self._totals, values], axis=1), axis=1)
        self._totals = totals[:, -1:]
        return totals[:, 1:] - np.nan_to_num(self._before.push(totals[:, 1:]))
