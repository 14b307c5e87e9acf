"""One pass over a log: groups of spans in, batches of rows out, messages and losses counted."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest.budgets import BUDGETS
from wmr_replay.ingest.channels.clock_steps import WATCHED, watch_of
from wmr_replay.ingest.channels.clocks import Clock
from wmr_replay.ingest.channels.composed_transforms import composer_of
from wmr_replay.ingest.channels.detect import Use
from wmr_replay.ingest.channels.planarity import Planarity
from wmr_replay.ingest.channels.position_steps import steps_of
from wmr_replay.ingest.decoding.bindings import attitude_of
from wmr_replay.ingest.decoding.column_builder import ColumnBuilder
from wmr_replay.ingest.decoding.decoder import Decoded, Decoder
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.mcap.chunks import OpenFile, Span, load
from wmr_replay.ingest.mcap.log_files import LogFiles
from wmr_replay.ingest.mcap.message_counts import MessageCounts, differing_counts
from wmr_replay.ingest.mcap.message_table import MessageTable
from wmr_replay.ingest.mcap.sequence_numbers import SequenceNumbers
from wmr_replay.ingest.mcap.stray_records import StrayRecords
from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS, NO_LIMITS
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_schemas.absurd import MOST, n_absurd, without_absurd
from wmr_schemas.arrays import F64, I64, U8, Bool
from wmr_schemas.batches import (
    COMMAND_COLUMNS,
    MODE_COLUMNS,
    POSE_COLUMNS,
    TORQUE_COLUMNS,
    WHEEL_COLUMNS,
    RawBatch,
    Rows,
)

COLUMNS = {"pose": POSE_COLUMNS, "torque": TORQUE_COLUMNS, "truth": MODE_COLUMNS}
PARTS = {
    "pose": POSE_COLUMNS,
    "torque": TORQUE_COLUMNS,
    "mode": MODE_COLUMNS,
    "wheels": WHEEL_COLUMNS,
    "command": COMMAND_COLUMNS,
}
"""The fields of a batch, with their columns."""
_FIELD_OF = {"wheel_speed": "wheels", "command": "command"}
_TRUSTED_MESSAGES = 1 << 20


@dataclass(frozen=True, eq=False)
class ReadSpan:
    """A span that was read: its size in bytes, its messages within the limits, and where the walk ended."""

    span: Span
    problem: str
    n_bytes: int
    n_messages: int
    stop: int


@dataclass(frozen=True, eq=False)
class GroupInProgress:
    """A group of spans: places of the wanted messages, and columns by role. The bytes may be gone."""

    found: list[ReadSpan]
    messages: MessageTable
    columns: list[ColumnBuilder]

    @property
    def last(self) -> Span:
        """The last span of the group."""
        return self.found[-1].span


class Reading:
    """A stage with ``push(group) -> RawBatch`` and ``finish()``; ``begin(file, spans)`` makes the group."""

    def __init__(
        self,
        uses: Mapping[str, Use],
        clocks: Mapping[str, Clock],
        files: LogFiles,
        losses: Losses,
        limits: tuple[int, int] | None = None,
    ) -> None:
        self.uses, self.clocks, self.losses = uses, clocks, losses
        self.files, self.catalogue = files, files.survey.catalogue
        self.decoders = {
            role: Decoder(use.definition, use.binding, composer_of(use.binding)) for role, use in uses.items()
        }
        channels = list(dict.fromkeys(use.channel.id for use in uses.values()))
        self.source_of = {role: channels.index(use.channel.id) for role, use in uses.items()}
        """The place of each role's channel among the channels: one may serve in two roles."""
        self.n_sources = len(channels)
        self.role_of = np.full(N_CHANNEL_IDS, -1)
        self.role_of[channels] = range(len(channels))
        steps = {role: steps_of(use.binding) for role, use in uses.items()}
        self.steps = {role: stage for role, stage in steps.items() if stage is not None}
        self.limits_ns = NO_LIMITS if limits is None else np.array(limits, np.int64)
        self.same_ids = np.arange(N_CHANNEL_IDS)
        self.counts_by_workspace = defaultdict[Workspace, MessageCounts](MessageCounts)
        self.clock_steps = watch_of(uses, clocks)
        self.planarity = Planarity()
        self.n_used = 0
        self.strays = StrayRecords()
        self.strays.add(files.survey.strays)
        self.sequences = defaultdict[tuple[str, int], SequenceNumbers](SequenceNumbers)
        self.indexed: Counter[int] | None = Counter() if limits is None else None
        """Messages by channel of the spans read, as the index counts them; None where it does not."""
        self.most_messages = BUDGETS.most_messages(files.survey.size_bytes)
        self.undecodable: Counter[str] = Counter()
        self.not_concerned: Counter[str] = Counter()
        self.absurd: Counter[str] = Counter()

    def begin(self, file: OpenFile, spans: Sequence[Span], workspace: Workspace) -> GroupInProgress:
        """Read spans of a file and decode the messages of known layouts. Safe to call in any thread."""
        n_expected = self._n_expected(spans)
        table = MessageTable(self.n_sources, max(n_expected, default=0))
        group = GroupInProgress([], table, self._columns(n_expected))
        ids = self.files.ids[spans[0].file_index]
        ids = self.same_ids if ids is None else ids
        message_counts = self.counts_by_workspace[workspace]
        for span in spans:
            block = load(file, span, workspace)
            n, stop = group.messages.add(block.data, ids, self.role_of, self.limits_ns, message_counts)
            group.found.append(ReadSpan(span, block.problem, len(block.data), n, stop))
            self._read(group, block.data)
        for decoder, columns in zip(self.decoders.values(), group.columns, strict=True):
            decoder.close(columns)
        return group

    def _n_expected(self, spans: Sequence[Span]) -> list[int]:
        """Number of messages of each role by the index, at most about a million each."""
        counts = (sum(span.counts.get(use.channel.id, 0) for span in spans) for use in self.uses.values())
        return [min(count, _TRUSTED_MESSAGES) for count in counts]

    def _columns(self, n_expected: list[int]) -> list[ColumnBuilder]:
        """Empty columns for each role, with room for the messages of a group."""
        return [decoder.begin(n) for decoder, n in zip(self.decoders.values(), n_expected, strict=True)]

    def _read(self, group: GroupInProgress, data: U8) -> None:
        """Decode the block that was added last."""
        counts = group.messages.counts.tolist()
        for columns, (role, decoder) in zip(group.columns, self.decoders.items(), strict=True):
            source = self.source_of[role]
            if counts[source] > columns.n:
                decoder.read(columns, data, *group.messages.places(source, columns.n, counts[source]))

    @property
    def message_counts(self) -> MessageCounts:
        """The messages that were read, of all channels."""
        total = MessageCounts()
        for message_counts in self.counts_by_workspace.values():
            total.add(message_counts)
        return total

    def push(self, group: GroupInProgress) -> RawBatch:
        """The rows of a group, in the order of the file."""
        for found in group.found:
            self._judge(found)
        self.strays.add(group.messages.strays)
        n = int(group.messages.counts.sum())
        if self.n_used + n > self.most_messages:
            return self._refuse(group, n)
        found_rows = {role: self._rows(k, role, group) for k, role in enumerate(self.uses)}
        rows = {role: arrived for role, (arrived, _) in found_rows.items()}
        if self.clock_steps is not None:
            rows |= self.clock_steps.push({role: found_rows[role] for role in WATCHED})
        self.n_used += int(group.messages.counts.sum())
        signals = (rows.get(role, Rows.empty(len(names))) for role, names in COLUMNS.items())
        further = {name: rows[role] for role, name in _FIELD_OF.items() if role in rows}
        return RawBatch(*signals, bars=self.planarity.take_bars(), **further)

    def _refuse(self, group: GroupInProgress, n: int) -> RawBatch:
        """No rows of a group with more messages than the log may hold."""
        self.losses.n_chunks_damaged += len(group.found)
        self.losses.note(
            f"{self._where(group.found[0].span)}: {n:,} messages are left out; of the channels in use, "
            f"{self.most_messages:,} are read at most from a log of this size"
        )
        return RawBatch(*(Rows.empty(len(names)) for names in COLUMNS.values()))

    def _rows(self, k: int, role: str, group: GroupInProgress) -> tuple[Rows, I64]:
        """The rows of one role out of a group, with their log times, and an account of its messages."""
        decoded, messages = self.decoders[role].finish(group.columns[k]), group.messages
        source = self.source_of[role]
        t_ns, values, order = decoded.stamp_ns, decoded.values, messages.order(source) + self.n_used
        publish_ns, log_ns = messages.publish_ns(source), messages.log_ns(source)
        self.sequences[role, group.last.file_index].push(messages.sequence(source))
        if not decoded.all_used:
            self._count(role, decoded)
        kept = self.clocks[role].stamped(t_ns, publish_ns, log_ns, decoded.used)
        if not (decoded.all_used and kept is decoded.used):
            t_ns, values, order = t_ns[kept], values[:, kept], order[kept]
            publish_ns, log_ns = publish_ns[kept], log_ns[kept]
        self.absurd[role] += n_absurd(values)
        stamps_ns = self.clocks[role].stamps(t_ns, publish_ns, log_ns)
        if role in self.steps:
            values = self.steps[role].push(stamps_ns, values)
        if role == "pose":
            self._watch(stamps_ns, decoded, kept)
        if role == "torque":
            self.losses.n_torque_empty += n_unknown(values[:2])
        return Rows(stamps_ns, order, values), log_ns

    def _watch(self, t_ns: I64, decoded: Decoded, kept: Bool) -> None:
        """Look at roll, pitch and height of ten poses a second."""
        chosen = self.planarity.choose(t_ns)
        rows = np.flatnonzero(kept)[chosen]
        attitude = attitude_of(self.uses["pose"].binding, decoded.raw[:, rows])
        if attitude is not None:
            seen = np.concatenate([attitude, decoded.values[:2, rows]])
            self.planarity.push(t_ns, chosen, without_absurd(seen))

    def _count(self, role: str, decoded: Decoded) -> None:
        """Count the messages of a role that are undecodable or do not concern it."""
        self.undecodable[role] += decoded.n_undecodable
        self.not_concerned[role] += int((~decoded.used).sum()) - decoded.n_undecodable

    def _judge(self, found: ReadSpan) -> None:
        """Note what is wrong with a span."""
        if not found.problem and found.stop == found.n_bytes:
            self._compare_with_index(found)
            return
        self.indexed = None
        where = self._where(found.span)
        if found.problem and found.span.whole:
            self.losses.n_chunks_damaged += 1
            kept = f"; {found.n_messages} messages of it were recovered" if found.n_messages else ""
            fate = f": {found.problem}{kept}" if kept else f" is left out: {found.problem}"
            self.losses.note(f"{where}{fate}{_expected(found.span)}")
        elif found.problem:
            self.losses.note(f"{where}: {found.problem}; {found.n_messages} messages of it were recovered")
        else:
            self.losses.n_chunks_damaged += 1
            self.losses.note(
                f"{where} is damaged {found.stop} bytes in; "
                f"the {found.n_messages} messages before that were used"
            )

    def _compare_with_index(self, found: ReadSpan) -> None:
        """Note a chunk that holds other messages than its index counts."""
        if self.indexed is None:
            return
        n_indexed = sum(found.span.counts.values())
        if not n_indexed:
            self.indexed = None
        elif n_indexed == found.n_messages:
            self.indexed.update(found.span.counts)
        else:
            self.indexed = None
            self.losses.note(
                f"{self._where(found.span)}: its index counts {n_indexed} messages, "
                f"{found.n_messages} were found"
            )

    def _where(self, span: Span) -> str:
        """Where a span is, as a text."""
        place = span.name or f"the chunk at byte {span.offset}"
        return place if len(self.files.paths) == 1 else f"{self.files.paths[span.file_index].name}: {place}"

    def finish(self, statistics: Mapping[int, int] | None = None) -> None:
        """Note all losses; ``statistics``: messages by channel as the file counts them, if all was read."""
        for role, n in self.undecodable.items():
            self.losses.n_undecodable += n
            if n:
                self.losses.note(f"{self.uses[role].channel.topic}: {n} messages do not fit their schema")
        if any(use.definition.allowance.is_spent for use in self.uses.values()):
            self.losses.note("their layouts vary more than a log of this size may: the rest was not decoded")
        by_channel = self.message_counts.by_channel
        for channel_id in sorted(by_channel.keys() - self.catalogue.channels.keys()):
            n = by_channel[channel_id].n
            self.losses.note(f"{n} messages of channel {channel_id}, which the file does not describe")
        if self.catalogue.n_refused:
            n = self.catalogue.n_refused
            self.losses.note(f"{n:,} records of schemas and channels are left out; no log needs so many")
        for lost in self.strays.losses():
            self.losses.note(lost)
        claims = {"its index": self.indexed, "its statistics": statistics}
        if not (self.losses.n_chunks_damaged or self.losses.truncated):
            known = {name: counts for name, counts in claims.items() if counts is not None}
            for channel_id, text in differing_counts(by_channel, known, self.catalogue.channels):
                self.losses.note(f"{self.catalogue.channels[channel_id].topic}: {text}")
        if self.catalogue.n_malformed:
            n = self.catalogue.n_malformed
            self.losses.note(f"{n} malformed records of schemas, channels or messages")

    @property
    def remarks(self) -> list[str]:
        """Facts about the channels in use that are no losses."""
        topics = {role: use.channel.topic for role, use in self.uses.items()}
        found = [
            f"{topics[role]}: {clock.n_unstamped} messages carry no stamp and are left out"
            for role, clock in self.clocks.items()
            if clock.n_unstamped
        ]
        found += self.strays.remarks()
        if self.limits_ns is NO_LIMITS:
            skipped = ((topics[role], numbers.describe()) for (role, _), numbers in self.sequences.items())
            found += [f"{topic}: {text}" for topic, text in skipped if text]
        found += [
            f"{topics[role]}: {n} messages hold numbers beyond {MOST:g}, which are taken as unknown"
            for role, n in self.absurd.items()
            if n
        ]
        n = self.not_concerned["torque"]
        found += [f"{topics['torque']}: {n} messages name no wheel joint"] if n else []
        return list(dict.fromkeys(found))


def joined(batches: Sequence[RawBatch]) -> RawBatch:
    """One batch of several that follow one another."""

    def whole(name: str) -> Rows:
        return concatenated([getattr(batch, name) for batch in batches], len(PARTS[name]))

    signals = (whole(name) for name in ("pose", "torque", "mode"))
    bars = tuple(bar for batch in batches for bar in batch.bars)
    return RawBatch(*signals, bars=bars, wheels=whole("wheels"), command=whole("command"))


def concatenated(pieces: Sequence[Rows], n_columns: int) -> Rows:
    """The rows of one signal; ``n_columns`` is needed when there are none."""
    pieces = [Rows.empty(n_columns), *pieces]
    return Rows(
        np.concatenate([rows.t_ns for rows in pieces]),
        np.concatenate([rows.order for rows in pieces]),
        np.concatenate([rows.values for rows in pieces], axis=1),
    )


def _expected(span: Span) -> str:
    """How many messages a span has by its index, as a text; empty without an index."""
    n = sum(span.counts.values())
    return f" ({n} messages by its index)" if n else ""


def n_unknown(torques: F64) -> int:
    """Number of columns of (2, n) in which a value is NaN."""
    missing = np.isnan(torques)
    return int(missing.any(axis=0).sum()) if missing.any() else 0
