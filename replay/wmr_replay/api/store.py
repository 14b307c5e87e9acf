"""The samples of a result: in memory, in a temporary file that goes with the result, or in a result file."""

import shutil
import tempfile
import weakref
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pyarrow.parquet as pq

from wmr_replay.tables import ParquetStream
from wmr_schemas.tables import SAMPLES, polars_schema

ROWS_IN_MEMORY = 500_000
"""Rows that are kept in memory, about 350 bytes each; more go to a temporary file."""


class SampleStore:
    """The samples table of one result: ``push`` its batches, then ``finish``; read it as often as needed."""

    def __init__(self, rows_in_memory: int = ROWS_IN_MEMORY) -> None:
        self._rows_in_memory = rows_in_memory
        self._held: list[pl.DataFrame] = []
        self._n_held = 0
        self._stream: ParquetStream | None = None
        self.file: Path | None = None
        """The Parquet file that holds the samples; None while they are in memory."""

    @classmethod
    def of_file(cls, file: Path) -> "SampleStore":
        """The samples of a result file."""
        store = cls()
        store.file = file
        return store

    def push(self, samples: pl.DataFrame) -> None:
        """Append a batch."""
        self._held.append(samples)
        self._n_held += len(samples)
        if self._n_held > self._rows_in_memory and self._stream is None:
            folder = tempfile.mkdtemp(prefix="wmr-replay-")
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            self.file = Path(folder, "samples.parquet")
            self._stream = ParquetStream(self.file, polars_schema(SAMPLES))
        if self._stream is not None:
            for frame in self._held:
                self._stream.push(frame)
            self._held = []

    def finish(self) -> None:
        """Complete the temporary file, where there is one."""
        if self._stream is not None:
            self._stream.finish()
            self._stream = None

    def lazy(self) -> pl.LazyFrame:
        """All rows; a file is scanned, not read."""
        if self.file is not None:
            return pl.scan_parquet(self.file, glob=False)
        return pl.concat([pl.DataFrame(schema=polars_schema(SAMPLES)), *self._held]).lazy()

    def batches(self) -> Iterator[pl.DataFrame]:
        """All rows in order, as many at a time as memory allows."""
        if self.file is None:
            yield from self._held
            return
        with pq.ParquetFile(self.file) as file:
            for group in range(file.num_row_groups):
                yield pl.DataFrame(file.read_row_group(group)).cast(polars_schema(SAMPLES))
