"""The tables of one result on disk: read, and stored as a reference.

A reference is what ``run`` writes (samples, segments and summary of a log, by its stem), so that any
directory of results serves as one. In those that :func:`write_reference` stores, real columns keep 24 bits
after the leading one, which is 3e-8 of the value; that halves the file.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from wmr_replay.regress.tolerance import TABLES, Tolerances
from wmr_replay.tables import SMALL, ParquetStream, with_seconds
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.files import whole_files

KEPT_BITS = 24
ROUNDED_FROM = 2.0 ** (3 - KEPT_BITS)
"""Columns whose relative tolerance is at least this are rounded: rounding takes a sixteenth of it."""
SUMMARY_ENDING = ".summary.parquet"


@dataclass(frozen=True, eq=False)
class Results:
    """The three tables of one log."""

    samples: pl.DataFrame
    segments: pl.DataFrame
    summary: pl.DataFrame

    def table(self, name: str) -> pl.DataFrame:
        """``samples``, ``segments`` or ``summary``."""
        frame: pl.DataFrame = getattr(self, name)
        return frame

    @property
    def every(self) -> int:
        """Of how many samples one is stored."""
        n_pose = int(self.summary["n_pose"][0])
        return max(1, round(n_pose / max(1, len(self.samples))))


def table_path(directory: Path, stem: str, table: str) -> Path:
    """Where a table of a log lies."""
    return directory / f"{stem}.{table}.parquet"


def stems(directory: Path) -> list[str]:
    """The logs that have results in a directory."""
    return sorted(path.name.removesuffix(SUMMARY_ENDING) for path in directory.glob(f"*{SUMMARY_ENDING}"))


def read_results(directory: Path, stem: str) -> Results:
    """The tables of a log. Raises InvalidFile where one is missing or unreadable."""
    tables = {table: read_table(table_path(directory, stem, table)) for table in TABLES}
    if {"start_ns", "end_ns"} <= set(tables["segments"].columns):
        tables["segments"] = with_seconds(tables["segments"])  # older results lack start_s and end_s
    return Results(**tables)


def read_table(path: Path) -> pl.DataFrame:
    """One table, whole."""
    try:
        return pl.read_parquet(path, glob=False)
    except FileNotFoundError:
        raise InvalidFile(path, "", "is missing") from None
    except (OSError, pl.exceptions.PolarsError) as error:
        raise InvalidFile(path, "", f"cannot be read as Parquet ({error})") from None


def write_reference(
    directory: Path, stem: str, results: Results, tolerances: Tolerances, every: int = 1
) -> None:
    """Store a log's tables as its reference, every ``every``-th row of the samples; all files or none.

    Raises InvalidSetting where nothing would be stored.
    """
    if not len(results.samples):
        raise InvalidSetting(f"{stem}: a reference without a single sample would let everything pass")
    directory.mkdir(parents=True, exist_ok=True)
    stored = {
        "samples": rounded(results.samples.gather_every(every), tolerances),
        "segments": results.segments,
        "summary": results.summary,
    }
    with whole_files({table: table_path(directory, stem, table) for table in reversed(TABLES)}) as parts:
        write_compact(parts["samples"], stored["samples"])
        for table in ("segments", "summary"):
            stored[table].write_parquet(parts[table])


def write_compact(path: Path, frame: pl.DataFrame) -> None:
    """One table by significance of its bytes, so that rounding makes it smaller."""
    stream = ParquetStream(path, frame.schema, level=SMALL)
    stream.push(frame)
    stream.finish()


def rounded(samples: pl.DataFrame, tolerances: Tolerances) -> pl.DataFrame:
    """Real columns with KEPT_BITS of their mantissa, as far as their tolerance leaves room."""
    wide = [
        name
        for name, dtype in samples.schema.items()
        if dtype == pl.Float64 and tolerances.of("samples", name).relative >= ROUNDED_FROM
    ]
    return samples.with_columns(round_mantissa(samples[name]) for name in wide)


def round_mantissa(values: pl.Series) -> pl.Series:
    """The nearest numbers whose last 52 − KEPT_BITS bits are 0; null, NaN and infinity stay."""
    dropped = 52 - KEPT_BITS
    numbers = values.fill_null(0.0).to_numpy()
    bits = numbers.view(np.int64) + (1 << (dropped - 1))
    kept = np.where(np.isfinite(numbers), (bits >> dropped << dropped).view(np.float64), numbers)
    return pl.select(
        pl.when(values.is_not_null()).then(pl.Series(values.name, kept)).alias(values.name)
    ).to_series()


def rows_of_reference(reference: pl.DataFrame, new: pl.DataFrame) -> pl.DataFrame:
    """The rows of ``new`` that a thinned reference holds, found by their stamps."""
    return new.filter(pl.col("t_ns").is_in(reference["t_ns"].implode()))
