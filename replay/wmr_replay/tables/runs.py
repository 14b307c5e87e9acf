"""Run lengths of (true mode, estimated mode, warming up): all that scoring needs, however long the log."""

from dataclasses import dataclass

import numpy as np
import polars as pl

from wmr_schemas.arrays import I8, I64, Bool
from wmr_schemas.status import Status


@dataclass(frozen=True, eq=False)
class ModeRuns:
    """Runs of rows that share truth, estimate and warm-up: first stamp, row count, true mode (−1: none),
    mode, warm-up; (n,).

    ``end_ns`` is the stamp of the log's last row.
    """

    start_ns: I64
    n_rows: I64
    mode_true: I8
    mode: I8
    warming: Bool
    end_ns: int

    @property
    def seconds(self) -> np.ndarray:
        """Time from each run's first row to the next run's."""
        return np.diff(self.start_ns, append=self.end_ns) / 1e9

    def __len__(self) -> int:
        """Number of runs, n."""
        return len(self.start_ns)


class RunCollector:
    """``push(samples)`` batches in order; ``finish()`` gives the runs."""

    KEYS = ("mode_true", "mode", "warming")

    def __init__(self) -> None:
        self._parts: list[pl.DataFrame] = []
        self._end_ns = 0

    def push(self, samples: pl.DataFrame) -> None:
        """Reduce a batch to its runs."""
        if not len(samples):
            return
        self._end_ns = samples["t_ns"][-1]
        warming = (pl.col("status") == Status.WARMING_UP.label).alias("warming")
        rows = samples.select(
            "t_ns", pl.lit(1, pl.Int64).alias("n"), pl.col("mode_true").fill_null(-1), "mode", warming
        )
        self._parts.append(self._reduce(rows))

    def finish(self) -> ModeRuns:
        """The runs, those that batches cut in two joined again."""
        schema = {
            "t_ns": pl.Int64,
            "n": pl.Int64,
            "mode_true": pl.Int8,
            "mode": pl.Int8,
            "warming": pl.Boolean,
        }
        runs = self._reduce(pl.concat(self._parts)) if self._parts else pl.DataFrame(schema=schema)
        t_ns, n, mode_true, mode, warming = (runs[name].to_numpy() for name in schema)
        return ModeRuns(t_ns, n, mode_true, mode, warming, self._end_ns)

    def _reduce(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Consecutive rows of equal keys as one row."""
        grouped = rows.group_by(pl.struct(self.KEYS).rle_id().alias("run"), maintain_order=True)
        return grouped.agg(pl.col("t_ns").first(), pl.col("n").sum(), pl.col(self.KEYS).first()).drop("run")
