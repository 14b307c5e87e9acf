"""One pass over a log: blocks in, batches of rows out, with an account of what was met on the way."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from wmr_replay.ingest.book import Book
from wmr_replay.ingest.census import Census
from wmr_replay.ingest.chunks import Block
from wmr_replay.ingest.clocks import Clock
from wmr_replay.ingest.decode import Decoded, Decoder
from wmr_replay.ingest.detect import Use
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.signals import MODE_COLUMNS, POSE_COLUMNS, TORQUE_COLUMNS, RawBatch, Rows
from wmr_replay.ingest.walk import Messages, walk
from wmr_schemas.arrays import I64, U8

COLUMNS = {"pose": POSE_COLUMNS, "torque": TORQUE_COLUMNS, "truth": MODE_COLUMNS}

_N_CHANNEL_IDS = 1 << 16


class Reading:
    """``push(block) -> RawBatch`` and ``finish()``, like every stage."""

    def __init__(
        self, uses: Mapping[str, Use], clocks: Mapping[str, Clock], book: Book, losses: Losses
    ) -> None:
        self.uses, self.clocks, self.book, self.losses = uses, clocks, book, losses
        self.decoders = {role: Decoder(use.definition, use.binding) for role, use in uses.items()}
        self.is_used = np.zeros(_N_CHANNEL_IDS, np.bool_)
        self.is_used[[use.channel.id for use in uses.values()]] = True
        self.census = Census()
        self.n_used = 0
        self.undecodable: Counter[str] = Counter()
        self.not_concerned: Counter[str] = Counter()

    def push(self, block: Block) -> RawBatch:
        """The rows of one block."""
        found = walk(block.data)
        self._judge(block, found.stop, len(found.messages))
        self.census.add(found.messages)
        used = self.is_used[found.messages.channel]
        order = self.n_used + np.cumsum(used) - 1
        self.n_used += int(used.sum())
        rows = {role: self._rows(role, block.data, found.messages, order) for role in self.uses}
        return RawBatch(*(rows.get(role, Rows.empty(len(names))) for role, names in COLUMNS.items()))

    def _rows(self, role: str, data: U8, messages: Messages, order: I64) -> Rows:
        mine = np.flatnonzero(messages.channel == self.uses[role].channel.id)
        decoded = self.decoders[role].decode(data, messages.offset[mine], messages.length[mine])
        keep = decoded.used
        kept = mine[keep]
        self._count(role, decoded)
        t_ns = self.clocks[role].stamps(
            decoded.stamp_ns[keep], messages.publish_ns[kept], messages.log_ns[kept]
        )
        return Rows(t_ns, order[kept], decoded.values[:, keep])

    def _count(self, role: str, decoded: Decoded) -> None:
        self.undecodable[role] += int(decoded.undecodable.sum())
        self.not_concerned[role] += int((~decoded.used & ~decoded.undecodable).sum())
        if role == "torque":
            self.losses.n_torque_empty += int(np.isnan(decoded.values[:2, decoded.used]).any(axis=0).sum())

    def _judge(self, block: Block, stop: int, n_messages: int) -> None:
        """Note what is wrong with a block."""
        where = f"the chunk at byte {block.span.offset}"
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
