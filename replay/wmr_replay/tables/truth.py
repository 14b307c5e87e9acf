"""The simulator's side files, read for scoring only: deleting them changes no estimate."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import polars as pl
import pyarrow.parquet as pq

from wmr_replay.ingest import LogPath

STATES = ("t_ns", "x_m", "y_m", "yaw_rad", "v_long_mps", "v_lat_mps", "yaw_rate_radps")
"""Columns of the side file that are asked for."""


@dataclass(frozen=True)
class SideTruth:
    """What lies beside a synthetic log: a file with the true states at the pose stamps, true α."""

    states_file: Path | None = None
    alpha: float | None = None

    def states(self, stride: int = 1) -> Iterator[pl.DataFrame]:
        """Every ``stride``-th true state, block by block."""
        if self.states_file is None:
            return
        n_read = 0
        with pq.ParquetFile(self.states_file) as file:
            known = [name for name in STATES if name in file.schema_arrow.names]
            for group in range(file.num_row_groups):
                rows = pl.DataFrame(file.read_row_group(group, columns=known))
                yield rows.gather_every(stride, offset=-n_read % stride)
                n_read += len(rows)


def read_side_truth(log: LogPath) -> SideTruth:
    """``<stem>.truth.parquet`` and ``<stem>.truth.json`` beside the log, where they exist and can be read.

    Of a log behind a URL the JSON alone: the states are for the eye, and would have to be fetched whole.
    """
    states, facts = log.with_name(f"{log.stem}.truth.parquet"), log.with_name(f"{log.stem}.truth.json")
    alpha = None
    if facts.is_file():
        alpha = json.loads(facts.read_text(encoding="utf-8")).get("robot", {}).get("alpha")
    return SideTruth(states if isinstance(states, Path) and states.is_file() else None, alpha)
