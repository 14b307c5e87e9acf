"""Stamps or log times that count another unit than they should, such as milliseconds in place of seconds.

The first messages tell: their stamps run 1000 times, or a power of that, as fast as the recorder's clock; or
they give a date of today in another unit; or their nanoseconds hold microseconds or milliseconds.
"""

import numpy as np

from wmr_schemas.arrays import I64, NS_PER_S
from wmr_schemas.findings import Finding, Severity, finding

LEAST_STEPS = 10
NEAR_DECADES = 0.15, 0.05
"""The median step within 40 %, of which transport may be as uneven, and the whole span within 12 %. No replay
at another speed, and no burst of the recorder, hits a power of 1000 so well twice.
"""
LONGEST_STEP_NS = 60 * NS_PER_S
"""Stamps further apart are in another unit, whatever date they show."""
DATES_NS = 946_684_800 * NS_PER_S, 4_102_444_800 * NS_PER_S
"""From 2000 to 2100: what a wall clock shows, and the seconds of no simulation."""
SAME_DAY_NS = 86_400 * NS_PER_S
STANDS = 0.01
"""Stamps that hold a wrong fraction of the second hardly move within it."""
RUN, COUNT, FRACTION = "its first stamps run at ", "its first stamps count ", "its stamps' nanoseconds hold "
"""How the reasons begin for which a clock is not the header's stamp."""
WORDS = {
    3: "milliseconds in place of seconds",
    6: "microseconds in place of seconds",
    9: "nanoseconds in place of seconds",
    -3: "microseconds in place of nanoseconds",
    -6: "milliseconds in place of nanoseconds",
    -9: "seconds in place of nanoseconds",
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
    near = all(abs(d - power) <= most for d, most in zip(decades, NEAR_DECADES, strict=True))
    return power if near else 0


def reason(stamp_ns: I64, log_ns: I64) -> str:
    """Why such stamps do not serve as a clock; empty when their unit is right."""
    if not len(stamp_ns):
        return ""
    if power := power_by_date(stamp_ns, log_ns):
        return f"{COUNT}{WORDS[power]}"
    if held := fraction_unit(stamp_ns, log_ns):
        return f"{FRACTION}{held}"
    power = power_of_ten(stamp_ns, log_ns)
    if not power or log_is_at_fault(stamp_ns, log_ns):
        return ""
    words = WORDS.get(power, "")
    return f"{RUN}{10.0**power:g} times the log time{': ' if words else ''}{words}"


def power_by_date(stamp_ns: I64, log_ns: I64) -> int:
    """−3, −6 or −9 where stamps (n,) in that unit show the day of the log times; else 0."""
    stamp, logged = float(np.median(stamp_ns)), float(np.median(log_ns))
    near = [power for power in (-3, -6, -9) if abs(stamp * 10.0**-power - logged) < SAME_DAY_NS]
    return near[0] if near and is_date(log_ns) else 0


def fraction_unit(stamp_ns: I64, log_ns: I64) -> str:
    """The unit that the nanoseconds of stamps (n,) hold; empty where they hold nanoseconds.

    A fraction below a thousandth of a second throughout comes by chance where messages come on the second;
    then the stamps advance as the log time does.
    """
    fraction, steps, logged = stamp_ns % NS_PER_S, np.abs(np.diff(stamp_ns)), np.abs(np.diff(log_ns))
    if len(steps) < LEAST_STEPS or fraction.max() >= 10**6 or len(np.unique(fraction)) < LEAST_STEPS // 2:
        return ""
    if np.median(steps) > STANDS * np.median(logged):
        return ""
    return "milliseconds" if fraction.max() < 10**3 else "microseconds"


def log_is_at_fault(stamp_ns: I64, log_ns: I64) -> bool:
    """Whether the stamps (n,) show dates at sensible steps, and the log times none."""
    sensible = bool(np.median(np.abs(np.diff(stamp_ns))) < LONGEST_STEP_NS)
    return sensible and is_date(stamp_ns) and not is_date(log_ns)


def is_date(t_ns: I64) -> bool:
    """Whether times lie in this century."""
    return bool(len(t_ns)) and DATES_NS[0] <= float(np.median(t_ns)) <= DATES_NS[1]


def log_time_unit(stamp_ns: I64, log_ns: I64) -> str:
    """What the log times (n,) count in place of nanoseconds; empty where nothing shows it."""
    power = power_of_ten(stamp_ns, log_ns) or -power_by_date(log_ns, stamp_ns)
    return WORDS.get(-power, "") if power > 0 and log_is_at_fault(stamp_ns, log_ns) else ""


def stamp_unit_findings(reasons: dict[str, str]) -> list[Finding]:
    """A finding for each topic whose clock's reason says that its stamps count another unit."""
    return [
        finding("stamp_unit", Severity.WARNING, f"{topic}: {why}; the log time is used in their place")
        for topic, why in reasons.items()
        if why.startswith((RUN, COUNT, FRACTION))
    ]


def log_time_findings(units: dict[str, str]) -> list[Finding]:
    """A finding for the topics beside which the log time counts ``units`` in place of nanoseconds."""
    found = {topic: unit for topic, unit in units.items() if unit}
    if not found:
        return []
    text = f"{', '.join(found)}: the log time counts {next(iter(found.values()))}; the stamps are used"
    return [finding("stamp_unit", Severity.WARNING, text, advice="write log times in nanoseconds")]
