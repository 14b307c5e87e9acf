"""b − a at the instants of a."""

import numpy as np
import polars as pl

from wmr_replay.timeline.comparison.quantities import QUANTITIES
from wmr_replay.timeline.sink import XY
from wmr_schemas.arrays import F64, NS_PER_S

REACH = 2.5
"""Values of b are carried over to instants between rows no further apart than this many usual steps."""


def differences(a: pl.DataFrame, b: pl.DataFrame) -> pl.DataFrame:
    """Differences b − a at a's rows, NaN where either is unknown: ``t_ns``, ``delay_s``, the quantities,
    ``position_m``.

    What describes an instant is compared at that instant: b's values are interpolated to it, since the two
    may have other delays.
    """
    columns: dict[str, F64 | pl.Series] = {"t_ns": a["t_ns"], "delay_s": a["delay_s"]}
    for quantity in QUANTITIES:
        columns[quantity.column] = difference(a, b, quantity.column, described=quantity.at_described)
    x, y = (difference(a, b, name, described=False) for name in XY)
    return pl.DataFrame(columns | {"position_m": np.hypot(x, y)})


def difference(a: pl.DataFrame, b: pl.DataFrame, column: str, *, described: bool) -> F64:
    """Difference b − a of one column at the instants of a."""
    start_ns = int(a["t_ns"][0])
    at, values = instants(a, start_ns, described=described), a[column].cast(pl.Float64).to_numpy()
    there, others = instants(b, start_ns, described=described), b[column].cast(pl.Float64).to_numpy()
    apart: F64 = carried(there, others, at) - values
    return apart


def instants(rows: pl.DataFrame, start_ns: int, *, described: bool) -> F64:
    """Seconds since ``start_ns`` of each row, or of the instant that it describes."""
    t_s = (rows["t_ns"].to_numpy() - start_ns) / NS_PER_S
    return np.asarray(t_s - rows["delay_s"].fill_null(0.0).to_numpy() if described else t_s)


def carried(t_s: F64, values: F64, at_s: F64) -> F64:
    """``values`` at ``t_s``, linearly interpolated to ``at_s``; NaN beside holes and outside."""
    known = np.isfinite(values) & np.isfinite(t_s)
    t_s, values = t_s[known], values[known]
    if len(t_s) < 2:
        return np.full(len(at_s), np.nan)
    after = np.clip(np.searchsorted(t_s, at_s), 1, len(t_s) - 1)
    near = t_s[after] - t_s[after - 1] <= REACH * np.median(np.diff(t_s))
    inside = (at_s >= t_s[0]) & (at_s <= t_s[-1])
    return np.where(near & inside, np.interp(at_s, t_s, values), np.nan)


def differs(rows: pl.DataFrame, column: str) -> bool:
    """Whether any difference is known and not zero."""
    return bool((np.abs(np.nan_to_num(rows[column].to_numpy())) > 0).any())
