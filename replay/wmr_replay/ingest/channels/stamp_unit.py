"""Stamps that count another unit than they should: milliseconds in place of seconds, and the like.

The first messages tell: their stamps run 1000 times, or a power of that, as fast as the recorder's clock.
"""

import numpy as np

from wmr_schemas.arrays import I64
from wmr_schemas.findings import Finding, Severity, finding

LEAST_STEPS = 10
NEAR_DECADES = 0.05
"""12 %. No replay at another speed, and no burst of the recorder, hits a power of 1000 so well twice."""
RUN = "its first stamps run at "
"""How the reason begins for which a clock is not the header's stamp."""
WORDS = {
    3: "milliseconds in place of seconds",
    6: "microseconds in place of seconds",
    9: "nanoseconds in place of seconds",
}


def power_of_ten(stamp_ns: I64, log_ns: I64) -> int:
    """Exponent, a multiple of 3, of how many times too fast the stamps (n,) run; 0 where they run well.

    By the median step and by the whole span, which have to agree.
    """
    order = np.argsort(log_ns, kind="stable")
    stamps, logged = np.diff(stamp_ns[order]), np.diff(log_ns[order])
    if len(stamps) < LEAST_STEPS:
        return 0
    pairs = (np.median(stamps), np.median(logged)), (stamps.sum(), logged.sum())
    if min(value for pair in pairs for value in pair) <= 0:
        return 0
    decades = [float(np.log10(above / below)) for above, below in pairs]
    power = 3 * round(decades[0] / 3)
    return power if all(abs(d - power) <= NEAR_DECADES for d in decades) else 0


def reason(stamp_ns: I64, log_ns: I64) -> str:
    """Why such stamps do not serve as a clock; empty when their unit is right."""
    power = power_of_ten(stamp_ns, log_ns)
    if not power:
        return ""
    words = WORDS.get(power, "")
    return f"{RUN}{10.0**power:g} times the log time{': ' if words else ''}{words}"


def stamp_unit_findings(reasons: dict[str, str]) -> list[Finding]:
    """A finding for each topic whose clock's reason says that its stamps count another unit."""
    return [
        finding("stamp_unit", Severity.WARNING, f"{topic}: {why}; the log time is used in their place")
        for topic, why in reasons.items()
        if why.startswith(RUN)
    ]
