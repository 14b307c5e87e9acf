"""Finding: the tracker repeats its last pose under new stamps."""

import numpy as np

from wmr_replay.quality.stretches import Stretches
from wmr_schemas.arrays import I64, NS_PER_S, Bool
from wmr_schemas.findings import Finding, Severity, finding

LEAST_IN_A_ROW, LEAST_SHARE = 3, 0.02
"""Shorter and rarer repeats happen by chance, where noise is no larger than the resolution of the pose."""
REGULAR = 0.9
"""So large a share of runs of one length is a rate, and not a loss of the robot."""
LEAST_RUNS = 20
"""Fewer runs say nothing about regularity."""
LONGEST_COUNTED = 64


class RepeatedRows:
    """``push(t_ns, frozen)`` rows in order; counts the frozen ones, their runs and the longest of these."""

    def __init__(self) -> None:
        self._stretches = Stretches()
        self._start_ns: int | None = None
        self._n = 0
        self._measured_ns = 0
        self._open = 0
        self._longest, self._longest_ns = 0, 0
        self._runs = np.zeros(LONGEST_COUNTED + 1, np.int64)

    def push(self, t_ns: I64, frozen: Bool) -> None:
        """The next rows (n,) and which of them repeat a frozen pose."""
        if not len(t_ns):
            return
        if self._start_ns is None:
            self._start_ns = self._measured_ns = int(t_ns[0])
        self._n += len(t_ns)
        if not self._open and not frozen.any():
            self._measured_ns = int(t_ns[-1])
            return
        self._stretches.push((t_ns - self._start_ns) / NS_PER_S, frozen)
        self._count_runs(t_ns, frozen)

    def _count_runs(self, t_ns: I64, frozen: Bool) -> None:
        """Count runs by their length; one that is open at the end is carried on."""
        measured = np.flatnonzero(~frozen)
        before = np.concatenate([[-1 - self._open], measured])
        lengths = np.diff(before) - 1
        self._runs += np.bincount(
            np.minimum(lengths[lengths > 0], LONGEST_COUNTED), minlength=len(self._runs)
        )
        last = len(frozen) - 1 - int(before[-1])
        self._longest = max(self._longest, int(lengths.max(initial=0)), last)
        stamps = np.concatenate([np.array([self._measured_ns], np.int64), t_ns[measured]])
        since_ns = stamps[np.cumsum(~frozen)]
        self._longest_ns = max(self._longest_ns, int((t_ns - since_ns).max(initial=0, where=frozen)))
        self._measured_ns, self._open = int(stamps[-1]), last

    def findings(self, bridged_s: float, n_position: int, n_yaw: int) -> list[Finding]:
        """What was found so far: rows further than ``bridged_s`` from a measured pose have no answer;
        ``n_position`` and ``n_yaw`` rows repeat the position or the yaw alone.
        """
        n, share = self._stretches.n, self._stretches.n / max(self._n, 1)
        if self._longest < LEAST_IN_A_ROW and share < LEAST_SHARE:
            return []
        times = self._every()
        if times:
            text = f"every pose comes {times} times: the tracker is slower than its messages"
            advice = "none is needed; the repeats are left out"
            return [finding("frozen_pose", Severity.NOTE, text, n, advice=advice)]
        longest_s = self._longest_ns / NS_PER_S
        text = f"{n} of {self._n} poses ({share:.0%}) repeat the one before"
        text += f" to the bit while the robot moves, up to {self._longest} in a row ({longest_s:.2g} s)"
        parts = [f"{k} the {name} alone" for k, name in ((n_position, "position"), (n_yaw, "yaw")) if k]
        text += f"; {' and '.join(parts)}" if parts else ""
        bars = longest_s > bridged_s
        severity = Severity.BARS if bars else Severity.WARNING
        return [finding("frozen_pose", severity, text, n, self._stretches.where)]

    def _every(self) -> int:
        """How many times every pose comes, 0 where repeats are irregular."""
        n_runs = int(self._runs.sum())
        length = int(np.argmax(self._runs))
        regular = n_runs >= LEAST_RUNS and self._runs[length] >= REGULAR * n_runs and length < LONGEST_COUNTED
        often = self._stretches.n >= REGULAR * length / (length + 1) * self._n * 0.5
        return length + 1 if regular and often else 0
