"""Motion moved to the instant that it describes: from rows at t about t − delay to rows about t."""

from typing import NamedTuple

import numpy as np

from wmr_replay.pipeline.hindsight.spool import Table
from wmr_schemas.arrays import F64, I64, NS_PER_S

FAR_APART_S = 1.0
"""Between two described instants further apart nothing is interpolated: there lies a hole."""


class AtInstants(NamedTuple):
    """Rows ready to be told: ``rows`` (n,) of the first pass, their ``described`` columns (k, n) at their own
    stamps, and the causal ``mode`` and ``mode_set`` (n,) of the first row whose window is about that stamp.
    """

    rows: Table
    described: F64
    later: Table


class Shift:
    """Stage: rows of the first pass, in order → the same rows with what later rows say about their stamps."""

    def __init__(self) -> None:
        self._waiting: list[Table] = []
        self._known: list[Table] = []
        self._delay_s = np.nan

    def push(self, rows: Table) -> AtInstants | None:
        """Rows up to the last instant that has been described."""
        self._waiting.append(rows)
        self._known.append(rows)
        return self._advance(self._described_until())

    def finish(self) -> AtInstants | None:
        """The rest; nothing later describes it."""
        return self._advance(np.iinfo(np.int64).max)

    def _described_until(self) -> int:
        """The last instant that the last row describes."""
        rows = self._known[-1]
        known = rows["delay_s"][np.isfinite(rows["delay_s"])]
        self._delay_s = float(known[-1]) if len(known) else self._delay_s
        delay_s = 0.0 if np.isnan(self._delay_s) else self._delay_s
        return int(rows["t_ns"][-1]) - round(delay_s * NS_PER_S)

    def _advance(self, until_ns: int) -> AtInstants | None:
        waiting = np.concatenate(self._waiting) if self._waiting else None
        if waiting is None or not len(waiting):
            return None
        n = int(np.searchsorted(waiting["t_ns"], until_ns, side="right"))
        ready, self._waiting = waiting[:n], [waiting[n:]]
        if not n:
            return None
        known = np.concatenate(self._known)
        about_ns = described_instants(known)
        described = interpolated(ready["t_ns"], about_ns, known["described"].T)
        later = known[np.minimum(np.searchsorted(about_ns, ready["t_ns"]), len(known) - 1)]
        keep = max(int(np.searchsorted(about_ns, ready["t_ns"][-1])) - 1, 0)
        self._known = [known[keep:]]
        return AtInstants(ready, described, later)


def described_instants(rows: Table) -> I64:
    """The instants (n,) in ns that rows are about, never decreasing; a row without a window is about its own
    stamp less the delay before it.
    """
    delay_s = rows["delay_s"].copy()
    last = np.maximum.accumulate(np.where(np.isfinite(delay_s), np.arange(len(rows)), -1))
    delay_s = np.where(last >= 0, delay_s[last], 0.0)
    about = rows["t_ns"] - np.rint(delay_s * NS_PER_S).astype(np.int64)
    return np.asarray(np.maximum.accumulate(about))


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
