"""One pass over a log: blocks in, batches of rows out, with an account of what was met on the way."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from wmr_replay.ingest.between import within
from wmr_replay.ingest.census import Census
from wmr_replay.ingest.chunks import Block, Span, load
from wmr_replay.ingest.clocks import Clock
from wmr_replay.ingest.decode import Columns, Decoded, Decoder
from wmr_replay.ingest.detect import Use
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.parts import N_CHANNEL_IDS, Parts
from wmr_replay.ingest.signals import MODE_COLUMNS, POSE_COLUMNS, TORQUE_COLUMNS, RawBatch, Rows
from wmr_replay.ingest.walk import Messages, walk
from wmr_schemas.arrays import I64

COLUMNS = {"pose": POSE_COLUMNS, "torque": TORQUE_COLUMNS, "truth": MODE_COLUMNS}


@dataclass(frozen=True, eq=False)
class Begun:
    """A block on its way: its messages, and by role which of them are wanted and their columns so far."""

    block: Block
    stop: int
    messages: Messages
    mine: dict[str, I64]
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
        self.is_used = np.zeros(N_CHANNEL_IDS, np.bool_)
        self.is_used[[use.channel.id for use in uses.values()]] = True
        self.census = Census()
        self.n_used = 0
        self.undecodable: Counter[str] = Counter()
        self.not_concerned: Counter[str] = Counter()

    def begin(self, file: BinaryIO, span: Span) -> "Begun":
        """Read a span, find its messages, decode what can be decoded at once; any thread may do it."""
        block = load(file, span)
        found = walk(block.data, n_expected=sum(span.counts.values()))
        messages = self._chosen(found.messages, span)
        mine = {role: np.flatnonzero(messages.channel == use.channel.id) for role, use in self.uses.items()}
        columns = {
            role: self.decoders[role].begin(block.data, messages.offset[rows], messages.length[rows])
            for role, rows in mine.items()
        }
        return Begun(block, found.stop, messages, mine, columns)

    def _chosen(self, messages: Messages, span: Span) -> Messages:
        """The messages within the limits, under the channels' common ids."""
        ids, inside = self.parts.ids[span.part], within(messages.log_ns, self.limits)
        if inside is not None and not inside.all():
            messages = messages.take(inside)
        return messages if ids is None else replace(messages, channel=ids[messages.channel])

    def push(self, begun: "Begun") -> RawBatch:
        """The rows of one block, in the order of the file."""
        messages = begun.messages
        self._judge(begun.block, begun.stop, len(messages))
        self.census.add(messages)
        used = self.is_used[messages.channel]
        order = self.n_used + np.cumsum(used) - 1
        self.n_used += int(order[-1]) + 1 - self.n_used if len(order) else 0
        rows = {role: self._rows(role, begun, order) for role in self.uses}
        return RawBatch(*(rows.get(role, Rows.empty(len(names))) for role, names in COLUMNS.items()))

    def _rows(self, role: str, begun: "Begun", order: I64) -> Rows:
        messages, mine = begun.messages, begun.mine[role]
        decoded = self.decoders[role].finish(begun.columns[role])
        self._count(role, decoded)
        stamp_ns, values = decoded.stamp_ns, decoded.values
        if not decoded.used.all():
            mine, stamp_ns, values = mine[decoded.used], stamp_ns[decoded.used], values[:, decoded.used]
        t_ns = self.clocks[role].stamps(stamp_ns, messages.publish_ns[mine], messages.log_ns[mine])
        return Rows(t_ns, order[mine], values)

    def _count(self, role: str, decoded: Decoded) -> None:
        if not decoded.used.all():
            self.undecodable[role] += int(decoded.undecodable.sum())
            self.not_concerned[role] += int((~decoded.used & ~decoded.undecodable).sum())
        if role == "torque":
            empty = np.isnan(decoded.values[0]) | np.isnan(decoded.values[1])
            self.losses.n_torque_empty += int((empty & decoded.used).sum())

    def _judge(self, block: Block, stop: int, n_messages: int) -> None:
        """Note what is wrong with a block."""
        where = self._where(block.span)
        if block.problem and block.span.whole:
            self.losses.n_chunks_damaged += 1
            self.losses.note(f"{where} is left out: {block.problem}{_expected(block)}")
        elif block.problem:
            self.losses.note(f"{where}: {block.problem}; {n_messages} messages of it were recovered")
        elif stop < len(block.data):
            self.losses.n_chunks_damaged += 1
            self.losses.note(
                f"{where} is damaged {stop} bytes in; the {n_messages} messages before that were used"
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
        return [
            f"{self.uses[role].channel.topic}: {n} messages name no wheel joint"
            for role, n in self.not_concerned.items()
            if n
        ]


def _expected(block: Block) -> str:
    n = sum(block.span.counts.values())
    return f" ({n} messages by its index)" if n else ""
