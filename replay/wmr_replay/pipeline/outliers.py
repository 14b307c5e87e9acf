"""Rows without a measured pose – outliers, frozen poses: the table holds the last estimate before."""

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.pipeline.columns import POSTERIOR, Columns
from wmr_schemas.arrays import I64, Bool
from wmr_schemas.modes import ContactMode, ModeSet
from wmr_schemas.status import Status

HELD = ("mode", "mode_set", "alpha", "alpha_sd", *POSTERIOR)
"""Columns that such a row takes from the last kept row; its other estimates are NaN."""


class OutlierFill:
    """Stage: estimates of the kept rows → estimates of all rows.

    A frozen pose holds the last verdict, status included, as long as the differentiator bridges a hole: as
    between two poses, nothing new is known. Later it has none, and the status ``gap``.
    """

    def __init__(self, all_modes: ModeSet) -> None:
        self._all_modes = all_modes
        self._last: Columns = {}
        self._last_ns = 0

    def push(self, rows: SampleBatch, estimates: Columns, bridged_ns: int) -> Columns:
        """``estimates`` hold the rows of the mask ``rows.kept`` (n,); the first row of a log is always kept.
        Holes of up to ``bridged_ns`` are bridged.
        """
        kept = rows.kept
        if not len(kept):
            return estimates
        if kept.all():
            self._last, self._last_ns = last_row(estimates), int(rows.t_ns[-1])
            return estimates
        kept_ns = np.concatenate([np.array([self._last_ns], np.int64), rows.t_ns[kept]])
        self._last_ns = int(kept_ns[-1])
        known = {
            name: np.concatenate([self._last.get(name, column[:0]), column])
            for name, column in estimates.items()
        }
        at: I64 = np.cumsum(kept, dtype=np.int64)
        source = at - (not self._last)
        self._last = last_row(known)
        columns = without_derivatives({name: column[source] for name, column in known.items()}, ~kept)
        columns["status"][~kept & ~rows.frozen] = Status.OUTLIER
        lost = rows.frozen & (rows.t_ns - kept_ns[at] > bridged_ns)
        return self._lost(columns, lost) if lost.any() else columns

    def _lost(self, columns: Columns, rows: Bool) -> Columns:
        """Rows of the mask get no verdict, and the status ``gap``."""
        nothing: dict[str, float] = dict.fromkeys(HELD, np.nan)
        nothing |= {"mode": ContactMode.UNDECIDED, "mode_set": self._all_modes, "status": Status.GAP}
        for name, value in nothing.items():
            columns[name][rows] = value
        return columns


def last_row(columns: Columns) -> Columns:
    """The last row, if there is one."""
    return {name: column[-1:] for name, column in columns.items()}


def without_derivatives(columns: Columns, rows: Bool) -> Columns:
    """Set the estimates of the rows of a mask, except ``HELD``, to NaN."""
    for name, column in columns.items():
        if name not in HELD and column.dtype == np.float64:
            column[rows] = np.nan
    return columns
