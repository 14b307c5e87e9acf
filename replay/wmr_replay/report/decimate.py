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
    if np.any(np.diff(column) < 0):
        order = np.argsort(column, kind="stable")
        known, column = known[order], column[order]
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    kept = [first_equal(value[known], starts, best) for best in (np.minimum, np.maximum)]
    ends = [known.min(), known.max()]
    return np.unique(np.concatenate([*(known[rows] for rows in kept), ends, holes]))


def first_equal(value: F64, starts: I64, best: np.ufunc) -> I64:
    """The first row of each group that holds its least or largest value; groups begin at ``starts``."""
    group = np.zeros(len(value), np.int64)
    group[starts[1:]] = 1
    group = np.cumsum(group)
    rows = np.flatnonzero(value == best.reduceat(value, starts)[group])
    first: I64 = rows[np.diff(group[rows], prepend=-1) > 0]
    return first


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
    """Rows, ascending, that draw a path: each a pixel or more from the one before; those of ``keep`` stay.

    Where noise alone moves the path by pixels, the distance grows until MOST_POINTS are left.
    """
    known = np.flatnonzero(np.isfinite(x_m) & np.isfinite(y_m))
    if not len(known):
        return known
    if len(known) > 20 * MOST_POINTS:
        at = known.astype(np.float64)
        parts = [known[extremes(at, one[known], 5 * MOST_POINTS)] for one in (x_m, y_m)]
        known = np.union1d(np.concatenate(parts), np.flatnonzero(keep))
    x, y, stay = x_m[known].tolist(), y_m[known].tolist(), keep[known].tolist()
    extent = max(max(x) - min(x), max(y) - min(y)) or 1.0
    apart = extent / FINEST
    most = MOST_POINTS + sum(stay)
    while len(rows := spaced(x, y, stay, apart)) > most and apart < extent:
        apart *= 1.5
    return known[rows]


def spaced(x: list[float], y: list[float], stay: list[bool], apart: float) -> list[int]:
    """Rows at least ``apart`` from the one kept before, those that stay, the first and the last."""
    rows, square, last_x, last_y = [0], apart * apart, x[0], y[0]
    for k in range(1, len(x)):
        dx, dy = x[k] - last_x, y[k] - last_y
        if stay[k] or dx * dx + dy * dy >= square:
            rows.append(k)
            last_x, last_y = x[k], y[k]
    if rows[-1] != len(x) - 1:
        rows.append(len(x) - 1)
    return rows


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
