"""Synthetic logs as batches, without a file in between."""

from itertools import pairwise

import polars as pl
import pytest

from wmr_replay.engine import Engine
from wmr_replay.ingest.signals import RawBatch, Rows
from wmr_replay.memory import as_batch
from wmr_replay.settings import Settings
from wmr_replay.tables import samples_frame
from wmr_schemas.signals import Log


class LogRows:
    """The rows of a log in the order in which a recorder would have written them."""

    def __init__(self, log: Log) -> None:
        self.robot = log.robot
        whole = as_batch(log)
        self.signals = [whole.pose, whole.torque, whole.mode]
        self.n = sum(map(len, self.signals))

    def batch(self, start: int, stop: int) -> RawBatch:
        """The messages start … stop − 1."""
        parts = []
        for rows in self.signals:
            chosen = (rows.order >= start) & (rows.order < stop)
            parts.append(Rows(rows.t_ns[chosen], rows.order[chosen], rows.values[:, chosen]))
        return RawBatch(*parts)

    def samples(self, settings: Settings | None = None, *, cuts=(), stop: int | None = None) -> pl.DataFrame:
        """The samples table of the first ``stop`` messages, pushed in pieces."""
        engine = Engine(settings or Settings(), self.robot)
        stop = self.n if stop is None else stop
        edges = [0, *sorted(c for c in cuts if c < stop), stop]
        columns = [c for a, b in pairwise(edges) for c in engine.push(self.batch(a, b))] + engine.finish()
        return pl.concat([samples_frame(c) for c in columns])


@pytest.fixture(scope="session")
def log_rows():
    """The class itself: tests make their own."""
    return LogRows
