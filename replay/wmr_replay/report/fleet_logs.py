"""The logs of a batch: their numbers, their dates, and which of them are odd."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np

from wmr_replay.timeline.colours import mode_name
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.gap_file import GapFile
from wmr_schemas.modes import MODES, ContactMode

ODD_SCORE = 3.5
LEAST_LOGS = 5
TO_SD = 1.4826
"""Median absolute deviation to standard deviation, for normal numbers."""
RULE = (
    f"Odd: a number whose distance from the median of all logs is more than {ODD_SCORE:g} times the scaled "
    f"median absolute deviation (a robust z-score; from {LEAST_LOGS} logs on), or data that bar an answer."
)
DAY_NS = 86_400 * 1_000_000_000
"""Stamps before this count from some start, not from 1970."""


@dataclass(frozen=True)
class Judged:
    """A number that is judged: name of the column, heading, format, and the least deviation that counts."""

    name: str
    heading: str
    form: str
    least: float
    relative: bool = False


JUDGED = (
    Judged("alpha", "α", ".4g", 0.01, relative=True),
    Judged("wheel_scale", "wheel scale", ".4f", 0.002, relative=True),
    *(
        Judged(f"share_{mode.label}", mode_name(mode), ".1%", 0.02)
        for mode in (*MODES, ContactMode.UNDECIDED)
    ),
    Judged("accuracy", "accuracy", ".1%", 0.01),
    Judged("rate_hz", "rate [Hz]", ".4g", 0.01, relative=True),
    Judged("gap_mm", "gap [mm]", ".3g", 0.1, relative=True),
    Judged("gap_left_mm", "gap left [mm]", ".3g", 0.1, relative=True),
)


@dataclass(frozen=True)
class FleetLog:
    """A log of the batch: its row of the fleet table, start in ns since 1970, the file of its report, and its
    gap analysis where there is one.
    """

    row: Mapping[str, Any]
    start_ns: int | None = None
    report: str | None = None
    gap: GapFile | None = None
    findings: Sequence[Mapping[str, Any]] = field(default_factory=tuple)

    def number(self, name: str) -> float | None:
        """A number of the log by its column."""
        if name in ("gap_mm", "gap_left_mm"):
            held = None if self.gap is None else self.gap.gap.held_out
            value = None if held is None else held.before if name == "gap_mm" else held.after
            return None if value is None else 1e3 * value
        found = self.row.get(name)
        return None if found is None else float(found)


def odd_ones(logs: Sequence[FleetLog], shown: Sequence[Judged]) -> list[list[str]]:
    """What is odd about each log, by the rule: headings with their robust z-scores, and findings."""
    odd: list[list[str]] = [[] for _ in logs]
    for one in shown:
        values = numbers_of(logs, one.name)
        for k, score in enumerate(robust_scores(values, one)):
            if abs(score) > ODD_SCORE:
                odd[k].append(f"{one.heading} {'high' if score > 0 else 'low'} (z {score:+.1f})")
    for k, log in enumerate(logs):
        odd[k] += [f"{found['code']} bars an answer" for found in log.findings if found["severity"] == "bars"]
    return odd


def robust_scores(values: F64, judged: Judged) -> F64:
    """Distances from the median in scaled median absolute deviations; 0 where there are too few logs.

    The deviation is at least ``least``, of the median where ``relative``: logs that agree to the last digit
    make no log odd.
    """
    known = values[np.isfinite(values)]
    if len(known) < LEAST_LOGS:
        return np.zeros(len(values))
    centre = float(np.median(known))
    least = judged.least * (abs(centre) if judged.relative else 1.0)
    spread = max(TO_SD * float(np.median(np.abs(known - centre))), least) or 1.0
    return np.nan_to_num((values - centre) / spread)


def numbers_of(logs: Sequence[FleetLog], name: str) -> F64:
    """A number of each log, NaN where it has none."""
    return np.array([np.nan if (value := log.number(name)) is None else value for log in logs])


def is_odd(values: F64, judged: Judged) -> Bool:
    """Which of these numbers are odd by the rule."""
    found: Bool = np.abs(robust_scores(values, judged)) > ODD_SCORE
    return found


def short_name(log: FleetLog) -> str:
    """The log's file name."""
    return str(log.row["path"] or log.row["log"]).rstrip("/").replace("\\", "/").rpartition("/")[2]


def date_of(log: FleetLog) -> str:
    """The log's start, in UTC; empty where its clock has no date."""
    if log.start_ns is None or log.start_ns <= DAY_NS:
        return ""
    try:
        return datetime.fromtimestamp(log.start_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M")
    except (OverflowError, ValueError, OSError):
        return ""


def have_dates(logs: Sequence[FleetLog]) -> bool:
    """Whether the logs can be drawn over their dates: half of them have one, and not all the same."""
    dated = [log.start_ns for log in logs if date_of(log)]
    return 2 * len(dated) >= len(logs) and len(set(dated)) > 1


def date_ms(log: FleetLog) -> float:
    """The start in milliseconds since 1970, as the page's script takes a date."""
    return (log.start_ns or 0) / 1e6
