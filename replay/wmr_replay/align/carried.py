"""Inputs of frozen rows, carried to the next row that is measured."""

import numpy as np

from wmr_replay.align.batch import SampleBatch
from wmr_schemas.arrays import F64, I64, NS_PER_S


class CarriedInputs:
    """Stage: mean inputs since the row before → mean inputs since the measured row before.

    Sums go from row to row and are carried over batches, so that the batches change no bit.
    """

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._sums: F64 = np.zeros(4)
        self._seconds = 0.0

    def push(self, rows: SampleBatch) -> F64:
        """The inputs (4, n) of all rows; those behind frozen rows take these rows' inputs in."""
        n = len(rows)
        if not n:
            return rows.inputs
        frozen, last_ns = rows.frozen, int(rows.t_ns[0]) if self._last_ns is None else self._last_ns
        self._last_ns = int(rows.t_ns[-1])
        open_before = self._seconds > 0.0
        if not open_before and not frozen.any():
            return rows.inputs
        step_s = np.diff(rows.t_ns, prepend=last_ns) / NS_PER_S
        group: I64 = np.cumsum(~frozen, dtype=np.int64) - ~frozen
        at = np.concatenate([[0], group])
        seconds = np.bincount(at, np.concatenate([[self._seconds], step_s]), int(group[-1]) + 2)
        parts = np.concatenate([self._sums[:, None], rows.inputs * step_s], axis=1)
        sums = np.stack([np.bincount(at, part, len(seconds)) for part in parts])
        behind = ~frozen & np.concatenate([[open_before], frozen[:-1]])
        inputs = rows.inputs.copy()
        inputs[:, behind] = sums[:, group[behind]] / seconds[group[behind]]
        is_open = bool(frozen[-1])
        self._sums = np.asarray(sums[:, group[-1]] if is_open else np.zeros(4), np.float64)
        self._seconds = float(seconds[group[-1]]) if is_open else 0.0
        return inputs
