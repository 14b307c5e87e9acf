"""A range of log time, as the user gives it with ``--start`` and ``--end``; and ranges that hold nothing."""

import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.errors import InvalidSetting, LogUnusable

_FIRST_ABSOLUTE_S, _FIRST_ABSOLUTE_NS = 1e8, 1e17
"""Larger numbers are seconds, or nanoseconds, since 1970; smaller ones are seconds from the log's start."""
_FURTHEST_S = 1e11
_EARLIEST_NS, _LATEST_NS = -(1 << 63), (1 << 63) - 1
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
Span = tuple[int, int]
"""First and last log time in ns."""


@dataclass(frozen=True)
class Between:
    """Log times from ``start`` to ``end``, both included, as the user wrote them; None: no limit.

    A number is in seconds from the log's first message; one above 1e8 in seconds since 1970, above 1e17 in
    nanoseconds; anything else is a date and time of ISO 8601, in UTC unless it says otherwise.
    """

    start: str | None = None
    end: str | None = None

    def __bool__(self) -> bool:
        return self.start is not None or self.end is not None

    def __str__(self) -> str:
        start = "the first message" if self.start is None else self.start
        return f"from {start} to {'the last message' if self.end is None else self.end}"

    def limits_ns(self, span_ns: Span) -> Span | None:
        """First and last log time in ns that are wanted of a log with this span; None without limits.

        Raises InvalidSetting for an end before the start.
        """
        if not self:
            return None
        first_ns, _ = span_ns
        start = first_ns if self.start is None else instant_ns(self.start, first_ns)
        end = _LATEST_NS if self.end is None else instant_ns(self.end, first_ns)
        if end < start and self.start is not None and self.end is not None:
            raise InvalidSetting(
                f"the end ({self.end}) lies before the start ({self.start}); {span_in_words(span_ns)}"
            )
        return start, end


def check_overlap(path: object, between: Between, limits_ns: Span | None, span_ns: Span) -> None:
    """Raises LogUnusable where the limits lie wholly before or behind the log."""
    if limits_ns is not None and (limits_ns[0] > span_ns[1] or limits_ns[1] < span_ns[0]):
        raise nothing_between(path, between, span_ns, "nothing was logged")


def nothing_between(path: object, between: Between, span_ns: Span, what: str) -> LogUnusable:
    """The error for a range of log time of which no result can be made; ``what`` says why."""
    advice = "Choose --start and --end within that; plain numbers are seconds from the first message."
    return LogUnusable(path, f"{what} {between}; {span_in_words(span_ns)}", advice)


def span_in_words(span_ns: Span) -> str:
    """How long a log is, and when it was recorded."""
    first_ns, last_ns = span_ns
    try:
        first, last = (_EPOCH + timedelta(microseconds=t_ns // 1000) for t_ns in span_ns)
    except OverflowError:
        return f"the log spans {(last_ns - first_ns) / NS_PER_S:.6g} s"
    form = "%Y-%m-%dT%H:%M:%S"
    return (
        f"the log spans {(last_ns - first_ns) / NS_PER_S:.6g} s, "
        f"{first.strftime(form)} to {last.strftime(form)} UTC"
    )


def instant_ns(text: str, first_ns: int) -> int:
    """Log time in ns of one instant as the user wrote it, within 64 bits. Raises InvalidSetting."""
    if text.strip().lstrip("+-").isdecimal() and abs(int(text)) >= _FIRST_ABSOLUTE_NS:
        return _held(int(text))
    try:
        seconds = float(text)
    except ValueError:
        return _held(_iso_ns(text))
    if not math.isfinite(seconds):
        raise _no_time(text)
    seconds = min(max(seconds, -_FURTHEST_S), _FURTHEST_S)
    return _held(round(seconds * NS_PER_S) + (0 if seconds >= _FIRST_ABSOLUTE_S else first_ns))


def _held(t_ns: int) -> int:
    """The instant, or the nearest that 64 bits hold."""
    return min(max(t_ns, _EARLIEST_NS), _LATEST_NS)


def _iso_ns(text: str) -> int:
    """Nanoseconds since 1970 of an ISO 8601 text; UTC unless it says otherwise. Raises InvalidSetting."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise _no_time(text) from None
    since = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)) - _EPOCH
    return (since.days * 86_400 + since.seconds) * NS_PER_S + since.microseconds * 1000


def _no_time(text: str) -> InvalidSetting:
    """The error for a text that names no instant."""
    return InvalidSetting(
        f"{text!r} is no time: seconds from the log's start, ns since 1970 or 2026-01-31T12:00:00"
    )
