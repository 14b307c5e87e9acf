"""Rows whose pose was set aside come back into the table, with what was known before them."""

import numpy as np

from wmr_replay.align import AlignedBatch
from wmr_replay.pipeline.columns import POSTERIOR, Columns, measured
from wmr_schemas.arrays import Bool
from wmr_schemas.status import Status

CARRIED_ON = ("mode", "mode_set", "alpha", "alpha_sd", *POSTERIOR)
"""What such a row takes from the last judged one; but for time, pose and truth all else is null in it."""


class Aside:
    """Stage: columns of the rows that were judged → columns of all rows."""

    def __init__(self, start_ns: int, status: Status) -> None:
        self._start_ns, self._status = start_ns, status
        self._last: Columns = {}

    def push(self, rows: AlignedBatch, kept: Bool, judged: Columns) -> Columns:
        """``judged`` holds the rows of ``kept`` (n,), the very first of all among them. Poses are as
        measured.
        """
        if kept.all():
            self._last = {name: column[-1:] for name, column in judged.items()} if len(kept) else self._last
            return judged | measured(self._start_ns, rows)
        known = {
            name: np.concatenate([self._last.get(name, column[:0]), column])
            for name, column in judged.items()
        }
        source = np.cumsum(kept, dtype=np.int64) - (not self._last)
        whole = {name: column[source] for name, column in known.items()}
        for name, column in whole.items():
            if name == "status":
                column[~kept] = self._status
            elif name not in CARRIED_ON and column.dtype == np.float64:
                column[~kept] = np.nan
        self._last = {name: column[-1:] for name, column in known.items()}
        return whole | measured(self._start_ns, rows)
