"""Motion moved to the instant that it describes: from rows at t about t − delay to rows about t."""

from typing import NamedTuple

import numpy as np

from wmr_replay.pipeline.hindsight.spool import Table
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.status import Status

FAR_APART_S = 1.0
"""Between two described instants further apart nothing is interpolated: there lies a hole."""


class AtInstants(NamedTuple):
    """Rows ready to be told: ``rows`` (n,) of the first pass, their ``described`` columns (k, n) at their own
    stamps, and ``later`` (n,), the first row of the first pass whose window is about that stamp.
    """

    rows: Table
    described: F64
    later: Table


class Shift:
    """Stage: rows of the first pass, in order → the same rows with what later rows say about their stamps.

    A row without a window is about its own stamp less the last delay; before the first window that is
    ``first_delay_s``. Outliers describe nothing: their neighbours' windows pass over them.
    """

    def __init__(self, first_delay_s: float) -> None:
        self._delay_s, self._about_until = first_delay_s, int(np.iinfo(np.int64).min)
        self._waiting: list[Table] = []
        self._known: list[Table] = []
        self._about: list[I64] = []

    def push(self, rows: Table) -> AtInstants | None:
        """Rows up to the last instant that has been described."""
        self._waiting.append(rows)
        describing = rows[rows["status"] != Status.OUTLIER]
        if len(describing):
            self._known.append(describing)
            self._about.append(self._instants(describing))
        return self._advance(self._about_until)

    def finish(self) -> AtInstants | None:
        """The rest; nothing later describes it."""
        return self._advance(int(np.iinfo(np.int64).max))

    def _instants(self, rows: Table) -> I64:
        """The instants (n,) in ns that the next rows are about, never decreasing."""
        delay_s = np.concatenate([[self._delay_s], rows["delay_s"]])
        delay_s = delay_s[np.maximum.accumulate(np.where(np.isnan(delay_s), 0, np.arange(len(delay_s))))]
        about = rows["t_ns"] - np.rint(delay_s[1:] * NS_PER_S).astype(np.int64)
        about = np.maximum.accumulate(np.maximum(about, self._about_until))
        self._delay_s, self._about_until = float(delay_s[-1]), int(about[-1])
        return np.asarray(about)

    def _advance(self, until_ns: int) -> AtInstants | None:
        """The waiting rows up to ``until_ns``; of the known rows those are kept that later ones need."""
        if not self._waiting:
            return None
        waiting: Table = np.concatenate(self._waiting)
        n = int(np.searchsorted(waiting["t_ns"], until_ns, side="right"))
        if not n:
            return None
        ready, self._waiting = waiting[:n], [waiting[n:]]
        known: Table = np.concatenate(self._known)
        about = np.concatenate(self._about)
        described = interpolated(ready["t_ns"], about, known["described"].T)
        later = known[np.minimum(np.searchsorted(about, ready["t_ns"]), len(known) - 1)]
        keep = max(int(np.searchsorted(about, ready["t_ns"][-1])) - 1, 0)
        self._known, self._about = [known[keep:]], [about[keep:]]
        return AtInstants(ready, described, later)


def interpolated(t_ns: I64, about_ns: I64, values: F64) -> F64:
    """``values`` (k, m), which are about ``about_ns`` (m,), at ``t_ns`` (n,) by straight lines: (k, n), NaN
    before the first, after the last, and across holes.
    """
    right = np.searchsorted(about_ns, t_ns)
    left = np.clip(right - 1, 0, len(about_ns) - 1)
    right = np.clip(right, 0, len(about_ns) - 1)
    exact = about_ns[right] == t_ns
    left = np.where(exact, right, left)
    span = about_ns[right] - about_ns[left]
    share = np.where(span > 0, (t_ns - about_ns[left]) / np.maximum(span, 1), 0.0)
    inside = (about_ns[left] <= t_ns) & (t_ns <= about_ns[right]) & (span <= FAR_APART_S * NS_PER_S)
    first = values[:, left]
    return np.asarray(np.where(inside, first + share * (values[:, right] - first), np.nan))
