"""The wheel torques of a replay, as far as a plot needs them."""

from threading import Lock

import numpy as np
import polars as pl

from wmr_replay.pipeline.columns import EFFORTS, Columns
from wmr_schemas.arrays import NS_PER_S

MOST_HZ = 50.0


class TorqueRecord:
    """Keeps the first row of every 20 ms: 0.8 KB a second of log, whatever the pose's rate.

    One thread may append while another asks for the rows so far.
    """

    def __init__(self) -> None:
        self._held: list[pl.DataFrame] = []
        self._last_bin: int | None = None
        self._lock = Lock()

    def push(self, columns: Columns) -> None:
        """Append the torques of the next rows."""
        bins = columns["t_ns"] // round(NS_PER_S / MOST_HZ)
        before = np.concatenate([[bins[0] - 1 if self._last_bin is None else self._last_bin], bins[:-1]])
        first = bins != before
        self._last_bin = int(bins[-1])
        kept = {name: columns[name][first].astype(np.float32) for name in EFFORTS}
        rows = pl.DataFrame({"t_ns": columns["t_ns"][first]} | kept)
        with self._lock:
            self._held.append(rows)

    def frame(self) -> pl.DataFrame:
        """``t_ns, left_nm, right_nm`` of the rows so far, NaN where unknown."""
        with self._lock:
            if len(self._held) > 1:
                self._held = [pl.concat(self._held)]
            if self._held:
                return self._held[0]
        return pl.DataFrame(schema={"t_ns": pl.Int64} | dict.fromkeys(EFFORTS, pl.Float32))
