"""Findings: the rate of the pose has changed, or is too low for the motion."""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.stretches import Stretches
from wmr_schemas.arrays import F64, I8
from wmr_schemas.findings import Finding, Severity, finding
from wmr_schemas.status import Status

LONGEST_STEP_S = 0.4
"""Poses that come more rarely miss skids of a second. Measured on made-up logs with skids and slips of .5 to
8 s (bench/quality_rate.py): of the rows told as skids, 40 % are skids at 1 Hz, 53 % at 2 Hz, 65 % at 3 Hz and
77 % at 10 Hz; at 1 Hz fewer rows are right than if all were called ideal."""


class SlowPose:
    """Stage: rows that come every ``step_s`` → ``RATE_TOO_LOW`` where that is too rare for the motion."""

    def __init__(self) -> None:
        self._stretches, self._slowest_s = Stretches(), 0.0

    def push(self, t_s: F64, step_s: float) -> I8:
        """The status (n,) of the next rows."""
        is_slow = step_s > LONGEST_STEP_S
        self._stretches.push(t_s, np.full(len(t_s), is_slow))
        if is_slow:
            self._slowest_s = max(self._slowest_s, step_s)
        return np.full(len(t_s), Status.RATE_TOO_LOW if is_slow else Status.OK, np.int8)

    def findings(self) -> list[Finding]:
        """What was found so far."""
        n = self._stretches.n
        if not n:
            return []
        text = (
            f"one pose every {self._slowest_s:.2g} s; a skid is seen from one every {LONGEST_STEP_S:g} s on"
        )
        return [finding("rate_too_low", Severity.BARS, text, n, self._stretches.where)]


class RateChange(NamedTuple):
    """From ``t_s`` on the pose comes every ``step_s``, every ``before_s`` before; the window is another."""

    t_s: float
    before_s: float
    step_s: float
    window_before_s: float
    window_s: float


def rate_findings(changes: list[RateChange]) -> list[Finding]:
    """A note on all changes of the rate."""
    if not changes:
        return []
    first = changes[0]
    text = (
        f"{1 / first.step_s:.3g} Hz from {first.t_s:.3g} s on, {1 / first.before_s:.3g} Hz before: "
        f"window {first.window_s:.2g} s in place of {first.window_before_s:.2g} s"
    )
    more = f", and {len(changes) - 1} more changes" if len(changes) > 1 else ""
    where = [(change.t_s, change.t_s) for change in changes[:8]]
    return [finding("rate_changed", Severity.NOTE, text + more, len(changes), where)]
