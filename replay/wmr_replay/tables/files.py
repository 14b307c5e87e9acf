"""Files that are whole or absent: written under a temporary name, renamed when complete."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import polars as pl
import pyarrow.parquet as pq


def temporary_name(path: Path) -> Path:
    """Where a file grows until it is whole."""
    return path.with_name(f".{path.name}.part")


@contextlib.contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """Yields the temporary name; renames on success, removes on any failure."""
    part = temporary_name(path)
    try:
        yield part
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


@contextlib.contextmanager
def replace_files(paths: Mapping[str, Path]) -> Iterator[dict[str, Path]]:
    """Yields a temporary name for each; all are renamed once the block is through, or none is and all go."""
    parts = {key: temporary_name(path) for key, path in paths.items()}
    try:
        yield parts
        for key, part in parts.items():
            part.replace(paths[key])
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)


class ParquetStream:
    """A Parquet file written batch by batch in groups of ``group_rows`` rows, with bounded memory.

    Measured numbers hardly repeat: their bytes are written by significance, which is smaller and takes a
    fifth of the time of looking for repetitions.
    """

    def __init__(self, path: Path, schema: pl.Schema, group_rows: int = 131_072) -> None:
        self.path, self._group_rows = path, group_rows
        self._schema = schema
        self._part = temporary_name(path)
        self._writer = pq.ParquetWriter(
            self._part,
            pl.DataFrame(schema=schema).to_arrow().schema,
            compression="zstd",
            use_dictionary=[
                name for name, dtype in schema.items() if not dtype.is_float() and name != "t_ns"
            ],
            use_byte_stream_split=[name for name, dtype in schema.items() if dtype.is_float()],
        )
        self._waiting: list[pl.DataFrame] = []
        self._n_waiting = 0

    def push(self, frame: pl.DataFrame) -> None:
        """Take rows in."""
        self._waiting.append(frame)
        self._n_waiting += len(frame)
        if self._n_waiting >= self._group_rows:
            self._flush()

    def finish(self) -> None:
        """Write what is left and give the file its name."""
        self._flush()
        self._writer.close()
        self._part.replace(self.path)

    def discard(self) -> None:
        """Remove the unfinished file."""
        self._writer.close()
        self._part.unlink(missing_ok=True)

    def _flush(self) -> None:
        if self._n_waiting:
            table = pl.concat(self._waiting).to_arrow().cast(self._writer.schema)
            self._writer.write_table(table)
        self._waiting, self._n_waiting = [], 0
