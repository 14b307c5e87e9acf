"""Which clock a channel goes by, and how far that clock is from the recorder's.

The header's stamp is the clock of choice. A channel goes by the publish time, or where that is missing too by
the log time, when most of the stamps of its first messages are missing or zero, or stand still or run
backwards in the order of recording, or count another unit than seconds. The choice is made on the first
N_WANTED messages (20, as many as the initial stretch has poses at least) and then kept.
"""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from wmr_replay.ingest.channels import stamp_unit
from wmr_replay.ingest.channels.detect import Use
from wmr_replay.ingest.channels.first_rows import first_rows
from wmr_replay.ingest.channels.stamp_steps import StampSteps
from wmr_replay.ingest.mcap.sampling import N_WANTED
from wmr_schemas.absurd import is_possible_stamp
from wmr_schemas.arrays import I64, NS_PER_S, Bool

_STRETCH, _N_OFFSETS = 256, 64
_FAR_FROM_ZERO_NS = 3600 * NS_PER_S
_LEAST_FORWARD = 3
"""One step in so many has to go forward; stamps in pairs are common."""
ClockName = Literal["header stamp", "publish time", "log time"]


@dataclass
class Clock:
    """The clock of one channel: ``name``, and why it is not the header's stamp if it is not."""

    name: ClockName
    reason: str = ""
    offsets_ns: list[float] = field(default_factory=list)
    """Typical stamp − log time, stretch by stretch."""
    steps: StampSteps = field(default_factory=StampSteps)
    log_unit: str = ""
    """What the log time counts in place of nanoseconds, where the stamps show it."""
    zero_is_none: bool = False
    """A stamp of zero means that there is none: the first stamps are far from it."""
    n_unstamped: int = 0

    @classmethod
    def choose(cls, use: Use, first: "FirstMessages") -> "Clock":
        """The clock for a channel, from its first messages."""
        if use.clock == "log":
            return cls("log time", "as wanted")
        if use.clock == "publish":
            return cls("publish time", "as wanted")
        if use.clock == "header" and use.binding.stamp:
            return cls("header stamp", "as wanted")
        stamp_ns = first.stamp_ns
        reason = what_is_wrong(stamp_ns, first.log_ns) if use.binding.stamp else "its messages carry no stamp"
        if not reason:
            far = int(stamp_ns[stamp_ns != 0].min()) > _FAR_FROM_ZERO_NS
            unit = stamp_unit.log_time_unit(stamp_ns, first.log_ns)
            return cls("header stamp", log_unit=unit, zero_is_none=far)
        published = any(sample.publish_ns for sample in use.samples[:N_WANTED])
        return cls("publish time" if published else "log time", reason)

    def stamped(self, header_ns: I64, publish_ns: I64, log_ns: I64, used: Bool) -> Bool:
        """Which of the messages in use (n,) carry a stamp by this clock; others are counted.

        A stamp that is no possible time is none.
        """
        t_ns = self._chosen(header_ns, publish_ns, log_ns)
        stamped = is_possible_stamp(t_ns)
        if self.zero_is_none:
            stamped &= t_ns != 0
        if stamped.all():
            return used
        kept: Bool = used & stamped
        self.n_unstamped += int(used.sum()) - int(kept.sum())
        return kept

    def _chosen(self, header_ns: I64, publish_ns: I64, log_ns: I64) -> I64:
        """The times by this clock."""
        return {"header stamp": header_ns, "publish time": publish_ns, "log time": log_ns}[self.name]

    def stamps(self, header_ns: I64, publish_ns: I64, log_ns: I64) -> I64:
        """Stamps (n,) in ns of one block's messages by this clock."""
        t_ns = self._chosen(header_ns, publish_ns, log_ns)
        if len(t_ns):
            self.offsets_ns += _typical_offsets(t_ns, log_ns)
            self.steps.push(t_ns)
        return t_ns

    @property
    def offset_s(self) -> float | None:
        """Median of the stretches' median offsets against the log time."""
        return float(np.median(self.offsets_ns)) / NS_PER_S if self.offsets_ns else None

    def describe(self) -> str:
        """One line of text: the clock, the reason, its offset from the log time and the offset's drift."""
        text = self.name + (f" ({self.reason})" if self.reason else "")
        if self.offset_s is None or self.name == "log time":
            return text
        drift_s = (max(self.offsets_ns) - min(self.offsets_ns)) / NS_PER_S
        drift = f", varying by {short_time(drift_s).lstrip('+')}" if drift_s > 0 else ""
        return f"{text}, {short_time(self.offset_s)} off log time{drift}"


def _typical_offsets(t_ns: I64, log_ns: I64) -> list[float]:
    """Medians of stamp − log time over a few messages of each stretch of a block."""
    n = max(len(t_ns) // _STRETCH, 1)
    length = len(t_ns) // n
    few = slice(None, None, -(-length // _N_OFFSETS))
    stamped, logged = (times[: n * length].reshape(n, length)[:, few] for times in (t_ns, log_ns))
    offsets = np.sort(stamped - logged, axis=1)
    return offsets[:, offsets.shape[1] // 2].astype(np.float64).tolist()  # type: ignore[no-any-return]


class FirstMessages(NamedTuple):
    """Header stamps, publish times and log times (n,) in ns of the first messages of a channel that concern
    its signal, ``N_WANTED`` at most.
    """

    stamp_ns: I64
    publish_ns: I64
    log_ns: I64

    def times_ns(self, name: ClockName) -> I64:
        """Their times (n,) by one clock."""
        return {"header stamp": self.stamp_ns, "publish time": self.publish_ns, "log time": self.log_ns}[name]


def first_messages(use: Use) -> FirstMessages:
    """Times of the first messages that concern the signal."""
    rows = first_rows(use.definition, use.binding, use.samples)
    publish_ns = np.array([sample.publish_ns for sample in use.samples], np.int64)
    log_ns = np.array([sample.log_ns for sample in use.samples], np.int64)
    return FirstMessages(*(t_ns[rows.used][:N_WANTED] for t_ns in (rows.stamp_ns, publish_ns, log_ns)))


def what_is_wrong(stamp_ns: I64, log_ns: I64) -> str:
    """Why stamps do not serve as a clock; nothing when they do."""
    if 2 * np.count_nonzero(stamp_ns) < len(stamp_ns) or not stamp_ns.any():
        return "its first stamps are zero"
    if unit := stamp_unit.reason(stamp_ns, log_ns):
        return unit
    steps = np.diff(stamp_ns[np.argsort(log_ns, kind="stable")])
    if len(steps) > 1 and _LEAST_FORWARD * np.count_nonzero(steps > 0) < len(steps):
        return "its first stamps stand still or run backwards"
    return ""


def short_time(seconds: float) -> str:
    """A signed duration in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if abs(seconds) >= size:
            return f"{seconds / size:+.4g} {unit}" if abs(seconds) < 1e4 else f"{seconds:+.0f} s"
    return f"{seconds * 1e9:+.0f} ns" if seconds else "0 s"
