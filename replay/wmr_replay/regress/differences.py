"""A table against its reference: types and counts first, then every value within its tolerance."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from wmr_replay.regress.tolerance import Tolerance
from wmr_schemas.arrays import F64, I64, Bool

DIFFERENCES = pl.Schema(
    {
        "column": pl.String,
        "row": pl.Int64,
        "t_s": pl.Float64,
        "reference": pl.String,
        "new": pl.String,
        "difference": pl.Float64,
    }
)
"""A row for each value beyond its tolerance: ``row`` counts from 0 within the rows compared, ``t_s`` from the
first row; the values in their shortest exact form; ``difference`` is new − reference, null between texts."""


@dataclass(frozen=True)
class ColumnDifference:
    """What lies beyond the tolerance of one column: how many values, how many of these may, and the worst."""

    column: str
    n: int
    allowed: int
    first_row: int
    worst: float | None

    @property
    def passed(self) -> bool:
        """Whether no more values lie beyond than may."""
        return self.n <= self.allowed


@dataclass(frozen=True, eq=False)
class TableComparison:
    """The comparison of one table. With ``problems`` of type or count, its values are not compared."""

    table: str
    problems: tuple[str, ...]
    n_rows: int
    n_values: int
    columns: tuple[ColumnDifference, ...]
    differences: pl.DataFrame

    @property
    def passed(self) -> bool:
        """Whether anything was compared, and nothing lies beyond its tolerance."""
        return not self.problems and self.n_values > 0 and all(column.passed for column in self.columns)


def compare_tables(
    table: str, reference: pl.DataFrame, new: pl.DataFrame, tolerances: Mapping[str, Tolerance]
) -> TableComparison:
    """Hold ``new`` against ``reference``, row by row. NaN equals NaN, null equals null, null is no NaN.

    Columns that ``tolerances`` does not name must be equal.
    """
    none = pl.DataFrame(schema=DIFFERENCES)
    problems = type_problems(reference, new) or count_problems(reference, new)
    if problems:
        return TableComparison(table, problems, 0, 0, (), none)
    compared = [name for name in reference.columns if not tolerances.get(name, Tolerance()).ignore]
    n_values = len(reference) * len(compared)
    if not n_values:
        return TableComparison(table, ("nothing was compared",), len(reference), 0, (), none)
    t_s = seconds(reference)
    found = [
        compare_column(reference[name], new[name], tolerances.get(name, Tolerance()), t_s)
        for name in compared
    ]
    columns = tuple(column for column, _ in found if column is not None)
    return TableComparison(
        table, (), len(reference), n_values, columns, pl.concat([none, *(rows for _, rows in found)])
    )


def type_problems(reference: pl.DataFrame, new: pl.DataFrame) -> tuple[str, ...]:
    """Columns that are gone, new, of another type, or in another order."""
    before, now = reference.schema, new.schema
    gone = [f"column {name} is gone" for name in before if name not in now]
    added = [f"column {name} is new" for name in now if name not in before]
    changed = [
        f"column {name} is {now[name]}, not {before[name]}"
        for name in before
        if name in now and before[name] != now[name]
    ]
    moved = ["the columns are in another order"] if before.names() != now.names() else []
    return tuple(gone + added + changed) or tuple(moved)


def count_problems(reference: pl.DataFrame, new: pl.DataFrame) -> tuple[str, ...]:
    """Another number of rows."""
    return () if len(reference) == len(new) else (f"{len(new)} rows, not {len(reference)}",)


def seconds(table: pl.DataFrame) -> pl.Series:
    """When each row is, in seconds from the first; null in tables without time."""
    if "t_s" in table.columns:
        return table["t_s"]
    if "start_ns" in table.columns and len(table):
        return table.select((pl.col("start_ns") - pl.col("start_ns").first()) / 1e9).to_series()
    return pl.Series([None] * len(table), dtype=pl.Float64)


def compare_column(
    reference: pl.Series, new: pl.Series, tolerance: Tolerance, t_s: pl.Series
) -> tuple[ColumnDifference | None, pl.DataFrame]:
    """The rows of one column that lie beyond its tolerance; None and no rows where none does."""
    numeric = reference.dtype.is_numeric()
    beyond = numbers_beyond(reference, new, tolerance) if numeric else reference.ne_missing(new).to_numpy()
    rows = np.flatnonzero(beyond)
    if not len(rows):
        return None, pl.DataFrame(schema=DIFFERENCES)
    before, now = reference[rows], new[rows]
    difference = (
        now.cast(pl.Float64) - before.cast(pl.Float64)
        if numeric
        else pl.Series([None] * len(rows), dtype=pl.Float64)
    )
    worst = largest(difference)
    frame = pl.DataFrame(
        [
            pl.Series("column", [reference.name] * len(rows)),
            pl.Series("row", rows, dtype=pl.Int64),
            t_s[rows].alias("t_s"),
            texts(before).alias("reference"),
            texts(now).alias("new"),
            difference.alias("difference"),
        ],
        schema=DIFFERENCES,
    )
    return ColumnDifference(reference.name, len(rows), tolerance.rows, int(rows[0]), worst), frame


def numbers_beyond(reference: pl.Series, new: pl.Series, tolerance: Tolerance) -> Bool:
    """Where new lies beyond the tolerance of reference, or only one of them is null or NaN.

    Whole numbers are compared as such: stamps in ns do not fit into a float.
    """
    nulls, new_nulls = reference.is_null().to_numpy(), new.is_null().to_numpy()
    whole = not reference.dtype.is_float()
    if whole and tolerance.absolute == tolerance.relative == 0:
        return reference.ne_missing(new).to_numpy()
    as_array: Callable[[pl.Series], F64 | I64] = integers if whole else floats
    a, b = as_array(reference), as_array(new)
    with np.errstate(invalid="ignore", over="ignore"):
        limit = np.maximum(tolerance.absolute, tolerance.relative * np.abs(a))
        close: Bool = (a == b) | (np.abs(b - a) <= limit) | (np.isnan(a) & np.isnan(b))
    infinite = np.isinf(a) & (a != b)
    beyond: Bool = np.where(nulls | new_nulls, nulls != new_nulls, ~close | infinite)
    return beyond


def integers(series: pl.Series) -> I64:
    """Whole numbers, null as 0."""
    return series.cast(pl.Int64).fill_null(0).to_numpy()


def floats(series: pl.Series) -> F64:
    """Real numbers, null as NaN."""
    return series.cast(pl.Float64).fill_null(float("nan")).to_numpy()


def largest(difference: pl.Series) -> float | None:
    """The difference of the largest size, as far as any is a number."""
    known = difference.drop_nulls().drop_nans()
    return None if not len(known) else float(known[int(known.abs().arg_max() or 0)])


def texts(values: pl.Series) -> pl.Series:
    """Values in their shortest exact form; null stays null."""
    return pl.Series(
        [None if v is None else v if isinstance(v, str) else repr(v) for v in values], dtype=pl.String
    )
