"""A range of log time, as the user gives it with ``--start`` and ``--end``."""

from dataclasses import dataclass
from datetime import UTC, datetime

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.errors import InvalidSetting

_FIRST_ABSOLUTE_S, _FIRST_ABSOLUTE_NS = 1e8, 1e17
"""Larger numbers are seconds, or nanoseconds, since 1970; smaller ones are seconds from the log's start."""


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

    def limits_ns(self, first_ns: int) -> tuple[int, int] | None:
        """First and last log time in ns, for a log that starts at ``first_ns``; None without limits.
        Raises InvalidSetting.
        """
        if not self:
            return None
        start = first_ns if self.start is None else instant_ns(self.start, first_ns)
        end = (1 << 63) - 1 if self.end is None else instant_ns(self.end, first_ns)
        if end < start:
            raise InvalidSetting(f"the end ({self.end}) lies before the start ({self.start})")
        return start, end


def instant_ns(text: str, first_ns: int) -> int:
    """Log time in ns of one instant as the user wrote it. Raises InvalidSetting."""
    if text.strip().lstrip("+-").isdecimal() and abs(int(text)) >= _FIRST_ABSOLUTE_NS:
        return int(text)
    try:
        seconds = float(text)
    except ValueError:
        return _iso_ns(text)
    return round(seconds * NS_PER_S) + (0 if seconds >= _FIRST_ABSOLUTE_S else first_ns)


def _iso_ns(text: str) -> int:
    """Nanoseconds since 1970 of an ISO 8601 text; UTC unless it says otherwise. Raises InvalidSetting."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise InvalidSetting(
            f"{text!r} is no time: seconds from the log's start, ns since 1970 or 2026-01-31T12:00:00"
        ) from None
    since = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)) - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * NS_PER_S + since.microseconds * 1000
