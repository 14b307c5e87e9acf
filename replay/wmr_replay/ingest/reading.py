"""One pass over a log: blocks in, batches of rows out, with an account of what was met on the way."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from wmr_replay.ingest.between import within
from wmr_replay.ingest.census import Census
from wmr_replay.ingest.chunks import Span, load
from wmr_replay.ingest.clocks import Clock
from wmr_replay.ingest.decode import Columns, Decoded, Decoder
from wmr_replay.ingest.detect import Use
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.parts import N_CHANNEL_IDS, Parts
from wmr_replay.ingest.shares import Share, share_out
from wmr_replay.ingest.signals import MODE_COLUMNS, POSE_COLUMNS, TORQUE_COLUMNS, RawBatch, Rows
from wmr_replay.ingest.walk import Messages, walk
from wmr_replay.ingest.workspace import Workspace
from wmr_schemas.arrays import F64

COLUMNS = {"pose": POSE_COLUMNS, "torque": TORQUE_COLUMNS, "truth": MODE_COLUMNS}


@dataclass(frozen=True, eq=False)
class Begun:
    """A span on its way: its messages, and by role which of them are wanted and their columns so far.

    The records themselves, ``n_bytes``, are gone; ``stop`` is where the walk over them ended.
    """

    span: Span
    problem: str
    n_bytes: int
    stop: int
    messages: Messages
    n_used: int
    shares: dict[str, Share]
    columns: dict[str, Columns]


class Reading:
    """``push(begun) -> RawBatch`` and ``finish()``, like every stage, with ``begin(file, span)`` before."""

    def __init__(
        self,
        uses: Mapping[str, Use],
        clocks: Mapping[str, Clock],
        parts: Parts,
        losses: Losses,
        limits: tuple[int, int] | None = None,
    ) -> None:
        self.uses, self.clocks, self.losses = uses, clocks, losses
        self.parts, self.book, self.limits = parts, parts.survey.book, limits
        self.decoders = {role: Decoder(use.definition, use.binding) for role, use in uses.items()}
        self.role_of = np.full(N_CHANNEL_IDS, -1)
        self.role_of[[use.channel.id for use in uses.values()]] = range(len(uses))
        self.census = Census()
        self.n_used = 0
        self.undecodable: Counter[str] = Counter()
        self.not_concerned: Counter[str] = Counter()

    def begin(self, file: BinaryIO, span: Span, workspace: Workspace) -> Begun:
        """Read a span, find its messages, decode what can be decoded at once; any thread may do it."""
        block = load(file, span, workspace)
        found = walk(block.data, n_expected=sum(span.counts.values()))
        messages = self._chosen(found.messages, span)
        n_used, each = share_out(messages, self.role_of, len(self.uses))
        shares = dict(zip(self.uses, each, strict=True))
        columns = {
            role: self.decoders[role].begin(block.data, share.offset, share.length)
            for role, share in shares.items()
        }
        return Begun(span, block.problem, len(block.data), found.stop, messages, n_used, shares, columns)

    def _chosen(self, messages: Messages, span: Span) -> Messages:
        """The messages within the limits, under the channels' common ids."""
        ids, inside = self.parts.ids[span.part], within(messages.log_ns, self.limits)
        if inside is not None and not inside.all():
            messages = messages.take(inside)
        return messages if ids is None else replace(messages, channel=ids[messages.channel])

    def push(self, begun: Begun) -> RawBatch:
        """The rows of one block, in the order of the file."""
        self._judge(begun)
        self.census.add(begun.messages)
        rows = {role: self._rows(role, begun) for role in self.uses}
        self.n_used += begun.n_used
        return RawBatch(*(rows.get(role, Rows.empty(len(names))) for role, names in COLUMNS.items()))

    def _rows(self, role: str, begun: Begun) -> Rows:
        share, decoded = begun.shares[role], self.decoders[role].finish(begun.columns[role])
        t_ns, values, order = decoded.stamp_ns, decoded.values, share.order + self.n_used
        publish_ns, log_ns = share.publish_ns, share.log_ns
        if not decoded.all_used:
            self._count(role, decoded)
        kept = self.clocks[role].stamped(t_ns, decoded.used)
        if not kept.all():
            t_ns, values, order = t_ns[kept], values[:, kept], order[kept]
            publish_ns, log_ns = publish_ns[kept], log_ns[kept]
        if role == "torque":
            self.losses.n_torque_empty += n_unknown(values[:2])
        return Rows(self.clocks[role].stamps(t_ns, publish_ns, log_ns), order, values)

    def _count(self, role: str, decoded: Decoded) -> None:
        n_undecodable = int(decoded.undecodable.sum())
        self.undecodable[role] += n_undecodable
        self.not_concerned[role] += int((~decoded.used).sum()) - n_undecodable

    def _judge(self, begun: Begun) -> None:
        """Note what is wrong with a block."""
        where, n_messages = self._where(begun.span), len(begun.messages)
        if begun.problem and begun.span.whole:
            self.losses.n_chunks_damaged += 1
            self.losses.note(f"{where} is left out: {begun.problem}{_expected(begun.span)}")
        elif begun.problem:
            self.losses.note(f"{where}: {begun.problem}; {n_messages} messages of it were recovered")
        elif begun.stop < begun.n_bytes:
            self.losses.n_chunks_damaged += 1
            self.losses.note(
                f"{where} is damaged {begun.stop} bytes in; the {n_messages} messages before that were used"
            )

    def _where(self, span: Span) -> str:
        place = f"the chunk at byte {span.offset}"
        return place if len(self.parts.paths) == 1 else f"{self.parts.paths[span.part].name}: {place}"

    def finish(self, n_expected: int | None = None) -> None:
        """Complete the account; ``n_expected`` messages are in the file by its own statistics."""
        for role, n in self.undecodable.items():
            self.losses.n_undecodable += n
            if n:
                self.losses.note(f"{self.uses[role].channel.topic}: {n} messages do not fit their schema")
        for channel_id in sorted(self.census.tallies.keys() - self.book.channels.keys()):
            n = self.census.tallies[channel_id].n
            self.losses.note(f"{n} messages of channel {channel_id}, which the file does not describe")
        n_found = sum(tally.n for tally in self.census.tallies.values())
        if n_expected is not None and n_expected != n_found and not self.losses.any():
            self.losses.note(f"the file's statistics count {n_expected} messages, {n_found} were found")
        if self.book.n_malformed:
            self.losses.note(f"{self.book.n_malformed} malformed records of schemas, channels or messages")

    @property
    def remarks(self) -> list[str]:
        """What a user may want to know though nothing was lost."""
        topics = {role: use.channel.topic for role, use in self.uses.items()}
        found = [
            f"{topics[role]}: {clock.n_unstamped} messages carry no stamp and are left out"
            for role, clock in self.clocks.items()
            if clock.n_unstamped
        ]
        n = self.not_concerned["torque"]
        return [*found, f"{topics['torque']}: {n} messages name no wheel joint"] if n else found


def _expected(span: Span) -> str:
    n = sum(span.counts.values())
    return f" ({n} messages by its index)" if n else ""


def n_unknown(torques: F64) -> int:
    """In how many columns of (2, n) a value is missing."""
    missing = np.isnan(torques)
    return int(missing.any(axis=0).sum()) if missing.any() else 0
