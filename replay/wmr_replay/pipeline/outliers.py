"""Rows whose pose is an outlier: the table holds them with the last estimate before them."""

import numpy as np

from wmr_replay.pipeline.columns import POSTERIOR, Columns
from wmr_schemas.arrays import Bool
from wmr_schemas.status import Status

HELD = ("mode", "mode_set", "alpha", "alpha_sd", *POSTERIOR)
"""Columns that an outlier row takes from the last kept row; its other estimates are NaN."""


class OutlierFill:
    """Stage: estimates of the kept rows → estimates of all rows."""

    def __init__(self) -> None:
        self._last: Columns = {}

    def push(self, kept: Bool, estimates: Columns) -> Columns:
        """``estimates`` hold the rows of the mask ``kept`` (n,); the first row of a log is always kept."""
        if kept.all():
            self._last = last_row(estimates) if len(kept) else self._last
            return estimates
        known = {
            name: np.concatenate([self._last.get(name, column[:0]), column])
            for name, column in estimates.items()
        }
        source = np.cumsum(kept, dtype=np.int64) - (not self._last)
        self._last = last_row(known)
        return mark_outliers({name: column[source] for name, column in known.items()}, ~kept)


def last_row(columns: Columns) -> Columns:
    """The last row, if there is one."""
    return {name: column[-1:] for name, column in columns.items()}


def mark_outliers(columns: Columns, outlier: Bool) -> Columns:
    """Set the rows of the mask to the status ``outlier`` and their estimates, except ``HELD``, to NaN."""
    for name, column in columns.items():
        if name == "status":
            column[outlier] = Status.OUTLIER
        elif name not in HELD and column.dtype == np.float64:
            column[outlier] = np.nan
    return columns
