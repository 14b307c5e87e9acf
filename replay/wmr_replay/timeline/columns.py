"""Out of arrays, the columns that Rerun takes: time columns, and lines that break where nothing is known."""

import math

import numpy as np
import rerun as rr

from wmr_schemas.arrays import F64, I64, Bool

DURATION, STAMP = "log_t", "stamp"


def time_columns(t_ns: I64, start_ns: int) -> list[rr.TimeColumn]:
    """The two timelines of rows stamped ``t_ns`` in a log that starts at ``start_ns``."""
    return [
        rr.TimeColumn(DURATION, duration=(t_ns - start_ns).view("timedelta64[ns]")),
        rr.TimeColumn(STAMP, timestamp=t_ns.view("datetime64[ns]")),
    ]


def stride_for(rate_hz: float, max_rate_hz: float) -> int:
    """The smallest whole stride that brings ``rate_hz`` down to ``max_rate_hz``; 1 for an unknown rate."""
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        return 1
    return max(1, math.ceil(round(rate_hz / max_rate_hz, 3)))


def rows_to_draw(finite: Bool, before: bool) -> Bool:
    """Which rows of a line to send: the finite ones, and the first of each hole, whose NaN breaks the line.

    ``before`` says whether the row in front of the first was finite.
    """
    follows_finite = np.concatenate(([before], finite[:-1]))
    drawn: Bool = finite | follows_finite
    return drawn


def blank_holes(values: F64) -> tuple[F64, Bool]:
    """``values`` (n, k), rows that are not finite made NaN throughout; the mask (n,) of the finite rows."""
    finite: Bool = np.logical_and.reduce(np.isfinite(values), axis=1)
    blanked: F64 = np.where(finite[:, None], values, np.nan)
    return blanked, finite
