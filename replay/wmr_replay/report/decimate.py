"""Fewer points, the same picture: extremes of every pixel column stay, and so do holes.

A plot that is a thousand pixels wide shows at most two values per series and column, the least and the
largest. Keeping these two draws the same picture from any number of rows, and no peak is lost.
"""

import numpy as np

from wmr_schemas.arrays import F64, I64, Bool

COLUMNS = 900
"""Columns of a plot over time: about the pixels of the widest page."""
MOST_POINTS = 3000
"""Points of a path, in which no two neighbours are nearer than a pixel."""
FINEST = 1000.0
"""A path's points are at least its extent divided by this apart."""


def extremes(t_s: F64, value: F64, columns: int = COLUMNS) -> I64:
    """Rows, ascending, that draw ``value`` (n,) over ``t_s`` (n,): least and largest of each column, the
    first and the last row, and the first row of every hole (NaN) that is wider than a column.
    """
    n = len(t_s)
    if n <= 2 * columns:
        return np.arange(n)
    known = np.flatnonzero(np.isfinite(value))
    holes = hole_rows(t_s, ~np.isfinite(value), (t_s[-1] - t_s[0]) / columns)
    if not len(known):
        return np.unique(np.append(holes, [0, n - 1]))
    column = column_of(t_s, columns)[known]
    order = np.lexsort((value[known], column))
    first = np.flatnonzero(np.diff(column[order], prepend=-1))
    last = np.append(first[1:], len(order)) - 1
    ends = known[[0, -1]]
    return np.unique(np.concatenate([known[order[first]], known[order[last]], ends, holes]))


def column_of(t_s: F64, columns: int = COLUMNS) -> I64:
    """The column of each row, 0 to ``columns`` − 1."""
    span = float(t_s[-1] - t_s[0]) or 1.0
    found: I64 = np.minimum((columns * (t_s - t_s[0]) / span).astype(np.int64), columns - 1)
    return found


def hole_rows(t_s: F64, unknown: Bool, width_s: float) -> I64:
    """The first row of each run of ``unknown`` rows that lasts at least ``width_s``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], unknown.astype(np.int8), [0]])))
    runs = edges.reshape(-1, 2)
    lasts = t_s[np.minimum(runs[:, 1], len(t_s) - 1)] - t_s[runs[:, 0]] >= width_s
    found: I64 = runs[lasts, 0].astype(np.int64)
    return found


def path_rows(x_m: F64, y_m: F64, keep: Bool) -> I64:
    """Rows, ascending, that draw a path: each a pixel or more from the one before; those of ``keep`` stay."""
    known = np.isfinite(x_m) & np.isfinite(y_m)
    rows = np.flatnonzero(known)
    if not len(rows):
        return rows
    extent = float(max(np.ptp(x_m[rows]), np.ptp(y_m[rows]))) or 1.0
    apart = extent / FINEST
    while True:
        travelled = np.cumsum(
            np.hypot(np.diff(x_m[rows], prepend=x_m[rows[0]]), np.diff(y_m[rows], prepend=y_m[rows[0]]))
        )
        chosen = np.diff((travelled / apart).astype(np.int64), prepend=-1) > 0
        chosen[-1] = True
        chosen |= keep[rows]
        if chosen.sum() <= MOST_POINTS + keep.sum() or apart > extent:
            return rows[chosen]
        apart *= 1.5


def shares(t_s: F64, code: I64, codes: list[int], columns: int = COLUMNS) -> tuple[F64, F64]:
    """By column, how large a share of its rows each of ``codes`` has: edges (m + 1,), shares (m, codes).

    Columns without a row are left out of ``edges`` by giving them the shares of the column before.
    """
    column = column_of(t_s, columns)
    counts = np.stack([np.bincount(column, code == one, minlength=columns) for one in codes], axis=1)
    total = counts.sum(axis=1, keepdims=True)
    filled = np.divide(counts, total, out=np.zeros_like(counts), where=total > 0)
    source = np.maximum.accumulate(np.where(total[:, 0] > 0, np.arange(columns), 0))
    return np.linspace(t_s[0], t_s[-1], columns + 1), filled[source]


def means(t_s: F64, value: F64, columns: int = COLUMNS) -> tuple[F64, F64]:
    """Mean time and mean of ``value`` (n, k), NaN left out, of each column that has a row."""
    if len(t_s) <= columns:
        return t_s, value
    column = column_of(t_s, columns)
    known = np.isfinite(value)
    n = np.stack([np.bincount(column, k, minlength=columns) for k in known.T], axis=1)
    total = np.stack(
        [np.bincount(column, v, minlength=columns) for v in np.where(known, value, 0.0).T], axis=1
    )
    rows = np.bincount(column, minlength=columns)
    there = rows > 0
    at = np.bincount(column, t_s, minlength=columns)[there] / rows[there]
    return at, np.divide(total, n, out=np.full_like(total, np.nan), where=n > 0)[there]
