"""Result tables as Parquet files that are whole or absent."""

from pathlib import Path

import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

from wmr_schemas.files import PartFile, whole_file

QUICK, SMALL = -1, 1
"""Levels of the compression: the first takes a sixth less time, for half a per cent more bytes of measured
numbers, and more of rounded ones.
"""
GROUP_ROWS = 65_536
"""Rows of a row group: what a reader holds in memory at a time."""


def write_parquet(path: Path, frame: pl.DataFrame) -> None:
    """Write a whole table, or none."""
    with whole_file(path) as part:
        frame.write_parquet(part)


class ParquetStream:
    """A Parquet file written batch by batch in groups of ``group_rows`` rows, with bounded memory.

    The bytes of the file depend on its rows alone, not on the batches in which they come. Measured numbers
    hardly repeat: their bytes are written by significance, which is smaller and takes a fifth of the time of
    looking for repetitions. Stamps are written by their differences. Row groups are found by time, mode and
    status, of which alone extremes are kept.
    """

    def __init__(
        self, path: Path, schema: pl.Schema, group_rows: int = GROUP_ROWS, level: int = QUICK
    ) -> None:
        self._file, self._group_rows = PartFile(path), group_rows
        self._writer = pq.ParquetWriter(
            self._file.path,
            pl.DataFrame(schema=schema).to_arrow().schema,
            compression="zstd",
            compression_level=level,
            use_dictionary=[
                name for name, dtype in schema.items() if not dtype.is_float() and name != "t_ns"
            ],
            column_encoding={"t_ns": "DELTA_BINARY_PACKED"} if "t_ns" in schema else None,
            use_byte_stream_split=[name for name, dtype in schema.items() if dtype.is_float()],
            write_statistics=[
                name for name, dtype in schema.items() if name == "t_s" or not dtype.is_float()
            ],
        )
        self._waiting: list[pl.DataFrame] = []
        self._n_waiting = 0

    def push(self, frame: pl.DataFrame) -> None:
        """Append rows; write the groups that they complete."""
        self._waiting.append(frame)
        self._n_waiting += len(frame)
        while self._n_waiting >= self._group_rows:
            self._writer.write_table(self._take(self._group_rows))

    def close(self) -> None:
        """Write the last rows; the file keeps its temporary name until :meth:`finish`."""
        if self._n_waiting:
            self._writer.write_table(self._take(self._n_waiting))
        self._writer.close()

    def finish(self) -> None:
        """Write the last rows and give the file its name."""
        self.close()
        self._file.finish()

    def discard(self) -> None:
        """Remove the unfinished file; a finished one stays."""
        self._writer.close()
        self._file.discard()

    def _take(self, n: int) -> pa.Table:
        """The first ``n`` rows that wait; what they were copied from is let go before they are written."""
        waiting = pl.concat(self._waiting)
        rows, rest = waiting[:n].rechunk(), waiting[n:]
        self._waiting, self._n_waiting = [rest] if len(rest) else [], len(rest)
        return rows.to_arrow().cast(self._writer.schema)
