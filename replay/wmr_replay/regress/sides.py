"""Two results side by side: the summary's fields, the share of another mode, distances of columns."""

from dataclasses import dataclass
from typing import Any

import polars as pl

from wmr_replay.regress.results import Results

SAID_ELSEWHERE = ("log", "log_sha256", "version", "settings", "verdict", "notes")
"""Texts of the summary, which have no difference."""
NOT_COMPARED = ("t_ns", "t_s")
OF_B = "_b"
MOST_APART = 0.1
"""Median distance of matched positions, as a share of the path's size, up to which two logs are one drive."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What differs between the results a and b.

    ``summary`` (field, a, b, delta) has a row for each field that is not the same; ``columns`` (column, n,
    max, at_s, rms) the largest and the root-mean-square difference b − a of each real column of the samples,
    over the rows that both have. ``other_mode`` (t_ns, differs) says of each such row whether the modes
    differ. ``by_stamp``: rows were matched by stamp, else by the time since the start.
    """

    n_a: int
    n_b: int
    by_stamp: bool
    summary: pl.DataFrame
    columns: pl.DataFrame
    other_mode: pl.DataFrame
    unrelated: str | None = None
    """Why the two do not look like one drive; None where they do."""

    @property
    def n_common(self) -> int:
        """Rows that both have."""
        return len(self.other_mode)

    @property
    def other_mode_share(self) -> float | None:
        """Share of the common rows with another mode; None without any."""
        return None if not self.n_common else int(self.other_mode["differs"].sum()) / self.n_common

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "rows_a": self.n_a,
            "rows_b": self.n_b,
            "rows_common": self.n_common,
            "matched_by": "stamp" if self.by_stamp else "time since the start",
            "other_mode_share": self.other_mode_share,
            "unrelated": self.unrelated,
            "summary": self.summary.to_dicts(),
            "columns": self.columns.to_dicts(),
        }


def compare_sides(a: Results, b: Results) -> Comparison:
    """Hold b against a."""
    joined, by_stamp = matched(a.samples, b.samples)
    other = joined.select("t_ns", differs=pl.col("mode").ne_missing(pl.col(f"mode{OF_B}")))
    summary = summary_differences(a.summary, b.summary)
    columns = column_differences(joined)
    apart = unrelated(a.samples, joined)
    return Comparison(len(a.samples), len(b.samples), by_stamp, summary, columns, other, apart)


def unrelated(a: pl.DataFrame, joined: pl.DataFrame) -> str | None:
    """Why the matched rows do not belong to one drive, or None.

    The positions of a drive that was repeated stay together: their median distance is then a small part of
    the path's size.
    """
    if not len(joined):
        return "they have no time in common"
    x, y = (joined[f"{name}{OF_B}"] - joined[name] for name in ("x_m", "y_m"))
    apart = (x**2 + y**2).sqrt().median()
    size = a.select(pl.max_horizontal(pl.col(n).max() - pl.col(n).min() for n in ("x_m", "y_m"))).item()
    if not isinstance(apart, float) or not size or apart <= MOST_APART * size:
        return None
    return f"in the median their positions are {apart:.3g} m apart, on a path {size:.3g} m across"


def matched(a: pl.DataFrame, b: pl.DataFrame) -> tuple[pl.DataFrame, bool]:
    """The rows of a with those of b beside them, by stamp; where fewer than half meet, by ``t_s``.

    Rows meet by ``t_s`` within half of a's median step, the nearest first.
    """
    by_stamp = a.join(b, on="t_ns", how="inner", suffix=OF_B, maintain_order="left")
    if 2 * len(by_stamp) >= min(len(a), len(b)) or len(a) < 2:
        return by_stamp, True
    step = a["t_s"].diff().median()
    renamed = b.rename({name: f"{name}{OF_B}" for name in b.columns})
    near = a.join_asof(
        renamed.set_sorted(f"t_s{OF_B}"),
        left_on="t_s",
        right_on=f"t_s{OF_B}",
        strategy="nearest",
        tolerance=float(step) / 2,  # type: ignore[arg-type]
    )
    return near.filter(pl.col(f"mode{OF_B}").is_not_null()), False


def column_differences(joined: pl.DataFrame) -> pl.DataFrame:
    """The differences of every real column, in the order of the table; nothing where no row has both."""
    real = [
        name
        for name, dtype in joined.schema.items()
        if dtype == pl.Float64 and f"{name}{OF_B}" in joined.columns and name not in NOT_COMPARED
    ]
    schema = {"column": pl.String, "n": pl.Int64, "max": pl.Float64, "at_s": pl.Float64, "rms": pl.Float64}
    rows = []
    for name in real:
        difference = joined.select("t_s", d=pl.col(f"{name}{OF_B}") - pl.col(name)).drop_nulls("d")
        if len(difference):
            size = difference["d"].abs()
            at = int(size.arg_max() or 0)
            rms = difference.select((pl.col("d") ** 2).mean().sqrt()).item()
            rows.append((name, len(difference), difference["d"][at], difference["t_s"][at], rms))
    return pl.DataFrame(rows, schema=schema, orient="row")


def summary_differences(a: pl.DataFrame, b: pl.DataFrame) -> pl.DataFrame:
    """The numbers of the two summaries that are not the same."""
    schema = {"field": pl.String, "a": pl.Float64, "b": pl.Float64, "delta": pl.Float64}
    first, second = a.row(0, named=True), b.row(0, named=True)
    rows = []
    for name in first:
        if name in SAID_ELSEWHERE or name not in second or first[name] == second[name]:
            continue
        before, now = (None if row[name] is None else float(row[name]) for row in (first, second))
        rows.append((name, before, now, None if before is None or now is None else now - before))
    return pl.DataFrame(rows, schema=schema, orient="row")
