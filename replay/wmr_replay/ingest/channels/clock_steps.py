"""A clock that is set while the log is recorded: the stamps of one channel step against the log time.

A correction shows where the offset ``stamp − log time`` of a channel changes by more than ``BOUND_S`` from
one message to the next, away from the other channel's offset. Transport does not look like that. A stalled
link shows as a step of the log time alone, while the other channel goes on; a stalled recorder delays both; a
message that comes late is followed by one in time; a queue that empties changes its offset all the time.
Where both channels step alike, they belong together as before.

Once the new offset has held for ``HOLDS_S``, the log time is used for both channels, each by its own offset
before the step, so that neither jumps: the stamps belong together no longer, and a next correction is likely.
Until then a stamp ahead of the log time is replaced alike, since it would make every other message late. A
stamp behind it is left as it is. No message depends on a later one, and nothing on the batches.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from wmr_replay.ingest.channels.clocks import Clock, short_time
from wmr_replay.ingest.channels.clocks_apart import BOUND_S, REMEDY
from wmr_replay.ingest.channels.detect import Use
from wmr_schemas.arrays import I64, NS_PER_S, Bool
from wmr_schemas.batches import Rows
from wmr_schemas.findings import Finding, Severity, finding

WATCHED = ("pose", "torque")
HOLDS_S, LEAST_MESSAGES = 1.0, 5
"""So long and for so many messages a new offset has to hold."""
AGREE_S = 0.25
"""Offsets that differ by less are the same: transport takes .01 to .3 s."""
N_TYPICAL = 16
"""The offset before a step is the median over so many messages."""
MOST_RUNS = 1000
"""A channel with more steps that did not hold has several clocks throughout; it is watched no longer."""
_BOUND_NS, _AGREE_NS, _HOLDS_NS = (round(s * NS_PER_S) for s in (BOUND_S, AGREE_S, HOLDS_S))


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Messages of a channel in file order, (n,) each: stamps, log times and ordinals among all channels."""

    t_ns: I64
    log_ns: I64
    order: I64

    def __len__(self) -> int:
        return len(self.t_ns)

    @classmethod
    def none(cls) -> "Arrivals":
        """No messages."""
        return cls(*(np.empty(0, np.int64) for _ in range(3)))

    @property
    def offsets_ns(self) -> I64:
        """Stamp − log time."""
        return self.t_ns - self.log_ns

    def after(self, other: "Arrivals") -> "Arrivals":
        """Those of ``other``, then these."""
        return Arrivals(*(np.concatenate([getattr(a, n) for a in (other, self)]) for n in vars(self)))

    def last(self, n: int) -> "Arrivals":
        """The last ``n``."""
        return Arrivals(self.t_ns[-n:], self.log_ns[-n:], self.order[-n:])


@dataclass(frozen=True)
class Run:
    """Messages after a step that has not held long enough yet: the first log time, the typical offset before
    it and the first one after it, whether the stamps have stepped ahead, and how many messages there are.
    """

    log_ns: int
    before_ns: int
    after_ns: int
    ahead: bool
    n: int = 0


@dataclass(frozen=True)
class Step:
    """A step that has held: of which channel, its run, and the ordinal of the message that shows it."""

    role: str
    run: Run
    order: int


@dataclass
class Channel:
    """What is carried on of a channel: its last messages, a run that is open, how many were not."""

    last: Arrivals = field(default_factory=Arrivals.none)
    run: Run | None = None
    n_runs: int = 0

    def opened(self, known: Arrivals, starts: I64) -> int:
        """Open a run at the first of ``starts``; its row, or the number of rows without one."""
        if not len(starts) or self.n_runs == MOST_RUNS:
            return len(known)
        at, offsets_ns = int(starts[0]), known.offsets_ns
        before_ns = int(np.median(offsets_ns[max(at - N_TYPICAL, 0) : at]))
        ahead = bool(known.t_ns[at] - known.t_ns[at - 1] > _BOUND_NS)
        self.run = Run(int(known.log_ns[at]), before_ns, int(offsets_ns[at]), ahead)
        self.n_runs += 1
        return at

    def followed(self, known: Arrivals, away: Bool, at: int, t_ns: I64) -> tuple[int, int | None]:
        """Follow the open run from row ``at`` on, and restamp it in ``t_ns`` where it is ahead.

        Returns the row after it, and the row at which it has held for long enough, None where it has not.
        It ends where the offset changes again, or the other channel has followed (``away`` (n,) is false).
        """
        run = self.run
        assert run is not None
        end = at + first_of((np.abs(known.offsets_ns[at:] - run.after_ns) > _AGREE_NS) | ~away[at:])
        n = run.n + 1 + np.arange(end - at)
        held = at + first_of((known.log_ns[at:end] - run.log_ns >= _HOLDS_NS) & (n >= LEAST_MESSAGES))
        if run.ahead:
            t_ns[at:held] = known.log_ns[at:held] + run.before_ns
        if held < end:
            return end, held
        self.run = replace(run, n=run.n + end - at) if end == len(known) else None
        return end, None


def watch_of(uses: Mapping[str, Use], clocks: Mapping[str, Clock]) -> "ClockSteps | None":
    """The watch over pose and torque; None where one is missing, a clock was given or log time is used."""
    if not uses.keys() >= set(WATCHED):
        return None
    if any(uses[role].clock or clocks[role].name == "log time" for role in WATCHED):
        return None
    return ClockSteps({role: uses[role].channel.topic for role in WATCHED})


class ClockSteps:
    """Stage: rows of pose and torque with their log times → the same rows, stamped by the log time from the
    message on that shows that a clock was set.
    """

    def __init__(self, topics: dict[str, str]) -> None:
        self._topics = topics
        self._channels = {role: Channel() for role in topics}
        self._step: Step | None = None
        self._typical_ns: dict[str, int] = {}
        self._first_ns: int | None = None

    def push(self, new: dict[str, tuple[Rows, I64]]) -> dict[str, Rows]:
        """The next rows of both channels with their log times; their messages have one common order."""
        if self._step is not None:
            return {role: self._by_log(role, r, log_ns, 0) for role, (r, log_ns) in new.items()}
        rows = {role: r for role, (r, _) in new.items()}
        arrived = {role: Arrivals(r.t_ns, log_ns, r.order) for role, (r, log_ns) in new.items()}
        firsts = [(int(a.order[0]), int(a.log_ns[0])) for a in arrived.values() if len(a)]
        if self._first_ns is None and firsts:
            self._first_ns = min(firsts)[1]
        changed, steps = {}, []
        for role, other in ((role, other) for role in rows for other in rows if other != role):
            t_ns, step = self._watch(role, arrived[role], arrived[other].after(self._channels[other].last))
            changed[role] = Rows(t_ns, rows[role].order, rows[role].values)
            steps += [step] if step else []
        if steps:
            self._step = min(steps, key=lambda step: step.order)
            changed = {role: self._switch(role, rows, changed, arrived) for role in rows}
        for role, arrivals in arrived.items():
            channel = self._channels[role]
            channel.last = arrivals.after(channel.last).last(N_TYPICAL)
        return changed

    def _watch(self, role: str, new: Arrivals, other: Arrivals) -> tuple[I64, Step | None]:
        """Stamps (n,) of a channel's new messages, and the step that has held, if one has."""
        channel = self._channels[role]
        known, n_old = new.after(channel.last), len(channel.last)
        jumps = np.flatnonzero(np.abs(np.diff(known.offsets_ns)) > _BOUND_NS) + 1
        if channel.run is None and not (jumps >= n_old).any():
            return new.t_ns, None
        away = away_from(other, known)
        starts = jumps[(jumps >= n_old) & away[jumps] & ~link_stalled(other, known, jumps)]
        t_ns, at, held = known.t_ns.copy(), n_old, None
        while held is None and at < len(known):
            if channel.run is None:
                at = channel.opened(known, starts[starts >= at])
            if channel.run is not None:
                at, held = channel.followed(known, away, at, t_ns)
        run = channel.run
        step = Step(role, run, int(known.order[held])) if run is not None and held is not None else None
        return t_ns[n_old:], step

    def _switch(
        self, role: str, rows: dict[str, Rows], changed: dict[str, Rows], arrived: dict[str, Arrivals]
    ) -> Rows:
        """The rows of the batch in which the step has held: as they were up to it, then by the log time."""
        step = self._step
        assert step is not None
        n_before = int(np.searchsorted(rows[role].order, step.order))
        known = arrived[role].after(self._channels[role].last)
        before = known.offsets_ns[known.order < step.order][-N_TYPICAL:]
        own = int(np.median(before)) if len(before) else 0
        self._typical_ns[role] = step.run.before_ns if role == step.role else own
        return self._by_log(role, changed[role], arrived[role].log_ns, n_before)

    def _by_log(self, role: str, rows: Rows, log_ns: I64, start: int) -> Rows:
        """The rows, from ``start`` on by the log time and the channel's own offset before the step."""
        later = log_ns[start:] + self._typical_ns[role]
        return Rows(np.concatenate([rows.t_ns[:start], later]), rows.order, rows.values)

    def findings(self) -> list[Finding]:
        """The step, if a clock was set."""
        step = self._step
        if step is None:
            return []
        size_s = (step.run.after_ns - step.run.before_ns) / NS_PER_S
        at_s = (step.run.log_ns - (self._first_ns or 0)) / NS_PER_S
        others = " and ".join(topic for role, topic in self._topics.items() if role != step.role)
        text = (
            f"{at_s:.1f} s after the first message the stamps of {self._topics[step.role]} step by "
            f"{short_time(size_s)} against log time, those of {others} do not: "
            "from there on log time is used for both"
        )
        return [
            finding("clocks_apart", Severity.WARNING, text, advice=f"{REMEDY}; nothing may set them later")
        ]


def latest_before(other: Arrivals, known: Arrivals) -> tuple[I64, Bool]:
    """For each message the last one of the other channel before it (n,), and whether there is one."""
    n_before = np.searchsorted(other.order, known.order)
    return np.maximum(n_before - 1, 0), n_before > 0


def away_from(other: Arrivals, known: Arrivals) -> Bool:
    """Messages (n,) whose offset is away from the other channel's."""
    latest, is_known = latest_before(other, known)
    if not len(other):
        return is_known
    return np.asarray(is_known & (np.abs(known.offsets_ns - other.offsets_ns[latest]) > _BOUND_NS))


def link_stalled(other: Arrivals, known: Arrivals, jumps: I64) -> Bool:
    """Which of the messages ``jumps`` (m,) come late in log time, while the other channel went on."""
    if not len(other):
        return np.zeros(len(jumps), bool)
    latest = latest_before(other, known)[0][jumps]
    passed_ns = known.log_ns[jumps] - known.log_ns[jumps - 1]
    silent_ns = known.log_ns[jumps] - np.maximum(known.log_ns[jumps - 1], other.log_ns[latest])
    return np.asarray((passed_ns >= _BOUND_NS) & (silent_ns <= _BOUND_NS))


def first_of(mask: Bool) -> int:
    """Index of the first true element, the length without one."""
    index = int(np.argmax(mask)) if mask.size else 0
    return index if mask.size and mask[index] else len(mask)
