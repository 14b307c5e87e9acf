"""What the first pass keeps for the second: its rows, and the bins that its identifier went through."""

from collections.abc import Iterator

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.identify import Motion
from wmr_replay.identify.filter_bank.bins import Bins
from wmr_replay.pipeline.columns import SMOOTHED_POSE, Columns
from wmr_replay.pipeline.hindsight.spool import Spool, Table
from wmr_schemas.status import WHOLE_LOG, Status

DESCRIBED = ("x_m", "y_m", "yaw_rad", *Motion._fields)
"""Columns that describe the instant t − delay: pose and motion."""
ROW = np.dtype(
    [
        ("t_ns", np.int64),
        ("delay_s", np.float64),
        ("described", np.float64, len(DESCRIBED)),
        ("mode", np.int8),
        ("mode_set", np.uint8),
        ("status", np.int8),
        ("mode_true", np.int8),
        ("slip_known", np.bool_),
    ]
)
SILENT = np.array([Status.WARMING_UP, Status.GAP, Status.POSE_JUMP, Status.OUTLIER])
"""Statuses that leave open whether a fault of the whole log still holds."""


class Record:
    """Rows and bins of the first pass, in order."""

    def __init__(self) -> None:
        self._rows, self._bins = Spool(ROW), list[Spool]()
        self.last_status = Status.OK
        """Of the last row that tells: a fault of the whole log that holds there held from the beginning."""
        self.first_delay_s = np.nan
        """Delay of the first full window; NaN before it."""

    def push_rows(self, rows: SampleBatch, estimates: Columns) -> None:
        """Rows of the samples table."""
        n = len(rows)
        if not n:
            return
        table = np.empty(n, ROW)
        table["t_ns"], table["mode_true"] = rows.t_ns, rows.mode_true
        for k, name in enumerate((*SMOOTHED_POSE, *Motion._fields)):
            table["described"][:, k] = estimates[name]
        for name in ("delay_s", "mode", "mode_set", "status"):
            table[name] = estimates[name]
        table["slip_known"] = ~np.isnan(estimates["slip_left_mps"]) if "slip_left_mps" in estimates else True
        self._rows.push(table)
        telling = np.flatnonzero(~np.isin(table["status"], SILENT))
        if len(telling):
            self.last_status = Status(int(table["status"][telling[-1]]))
        if np.isnan(self.first_delay_s) and np.isfinite(table["delay_s"]).any():
            self.first_delay_s = float(table["delay_s"][np.isfinite(table["delay_s"])][0])

    def push_bins(self, bins: Bins) -> None:
        """Bins that the identifier completed."""
        layout = np.dtype([("values", np.float64, len(bins.values)), ("stamp", np.int64)])
        if not self._bins:
            self._bins.append(Spool(layout))
        table = np.empty(len(bins.stamps), layout)
        table["values"], table["stamp"] = bins.values.T, bins.stamps
        self._bins[0].push(table)

    @property
    def whole_log(self) -> Status | None:
        """The status of a fault of the whole log."""
        return self.last_status if self.last_status in WHOLE_LOG else None

    def rows(self) -> Iterator[Table]:
        """The rows in blocks."""
        return self._rows.blocks()

    def bins(self) -> Iterator[Bins]:
        """The bins in blocks."""
        for table in self._bins[0].blocks() if self._bins else ():
            yield Bins(np.ascontiguousarray(table["values"].T), table["stamp"].copy())
