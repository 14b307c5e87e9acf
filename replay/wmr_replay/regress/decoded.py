"""Two logs by their decoded columns: the same within rounding, as on another platform."""

from pathlib import Path

import numpy as np

from wmr_replay.ingest import Rows, open_log
from wmr_schemas.arrays import F64
from wmr_schemas.errors import LogUnusable
from wmr_schemas.mapping_file import LogMapping

ABSOLUTE, RELATIVE = 1e-9, 1e-9
"""|a − b| ≤ max(ABSOLUTE, RELATIVE·|b|) for every value, in the units of the log."""
STAMP_NS = 2
"""Stamps are rounded to ns, and may fall to either side."""
SIGNALS = ("pose", "torque", "wheels", "command", "mode")

Signals = dict[str, tuple[F64, F64]]


def first_difference(path: Path, other: Path) -> str | None:
    """What first differs between two logs beyond rounding, in words; None where nothing does."""
    ours, theirs = decoded(path), decoded(other)
    if isinstance(ours, str) or isinstance(theirs, str):
        return None if ours == theirs else f"one is unusable: {ours if isinstance(ours, str) else theirs}"
    for name in SIGNALS:
        (t_a, a), (t_b, b) = ours[name], theirs[name]
        if a.shape != b.shape:
            return f"{name}: {a.shape[1]} rows, not {b.shape[1]}"
        if t_a.size and np.abs(t_a - t_b).max() > STAMP_NS:
            return f"{name}: stamps differ at row {int(np.abs(t_a - t_b).argmax())}"
        close = np.isclose(a, b, rtol=RELATIVE, atol=ABSOLUTE, equal_nan=True)
        if not close.all():
            column, row = np.argwhere(~close)[0].tolist()
            return f"{name}: column {column} at row {row} is {a[column, row]!r}, not {b[column, row]!r}"
    return None


def decoded(path: Path) -> Signals | str:
    """Stamps and values of every signal; the problem, without its path, of an unusable log."""
    try:
        batches = list(open_log(path, LogMapping(), also=("wheel_speed", "command")).batches())
    except LogUnusable as error:
        return error.problem
    return {name: joined([getattr(batch, name) for batch in batches]) for name in SIGNALS}


def joined(rows: list[Rows]) -> tuple[F64, F64]:
    """Stamps (n,) and values (k, n) of all batches."""
    if not rows:
        return np.empty(0), np.empty((0, 0))
    return np.concatenate([r.t_ns for r in rows]), np.concatenate([r.values for r in rows], axis=1)
