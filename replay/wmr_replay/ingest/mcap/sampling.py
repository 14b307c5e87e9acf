"""The first messages of every channel, and the descriptions of all, from as few chunks as possible."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wmr_replay.ingest.mcap.chunk_index import ChunkIndex
from wmr_replay.ingest.mcap.chunk_selection import counts_of, index_adds_up
from wmr_replay.ingest.mcap.chunks import Span, load
from wmr_replay.ingest.mcap.container import Container, SampledFile
from wmr_replay.ingest.mcap.stretches import stretches
from wmr_replay.ingest.mcap.survey import Survey
from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS, Messages, walk_pieces
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_replay.ingest.storage.source import LogPath
from wmr_schemas.arrays import I64, U8

N_WANTED, N_WANTED_LATER = 20, 2
"""Messages of a channel that are worth opening another chunk for: within the log's first bytes, and later."""
_FIRST_BYTES = 8 << 20
_N_KEPT = 32
_KEPT_BYTES = 1 << 18


@dataclass(frozen=True)
class Sample:
    """The data of one message, and its times in ns."""

    data: bytes
    log_ns: int
    publish_ns: int


class Sampler:
    """Opens a span only while something that it may hold is missing."""

    def __init__(self, survey: Survey) -> None:
        self.survey, self.catalogue = survey, survey.catalogue
        self.samples: dict[int, list[Sample]] = {}
        self.seen: dict[int, int] = {}
        self.n_bytes = 0
        self._adds_up = index_adds_up(survey)
        self._lacking = self._all_lacking()

    def run(self, path: LogPath | Container, *, in_part: bool = False) -> None:
        """Collect the samples; the survey's catalogue then knows every channel that has a message.

        ``in_part``: of a large table, messages of channels that begin later are looked for in a few
        stretches alone.
        """
        workspace = Workspace()
        with path.open("rb") as file:
            if isinstance(file, SampledFile):
                within = [s for run in stretches(self.survey.spans) for s in run] if in_part else None
                self._take(file.first_messages(self.survey, N_WANTED_LATER, within))
                return
            for span in self._needed():
                self._take(load(file, span, workspace).data)

    def n_messages(self, channel_id: int) -> int:
        """Messages of a channel, as far as known without reading them all."""
        in_file = (self.survey.statistics or {}).get(channel_id, 0)
        if self._adds_up:
            return in_file
        indexed = sum(span.counts.get(channel_id, 0) for span in self.survey.spans)
        return max(indexed, in_file, self.seen.get(channel_id, 0))

    def _needed(self) -> Iterator[Span]:
        """The spans to open, one after another; which one is next depends on what was found in the last."""
        spans = self.survey.spans
        if not isinstance(spans, ChunkIndex) or not self._adds_up:
            yield from (span for span in spans if self._needs(span))
            return
        at, lacking = 0, np.zeros(N_CHANNEL_IDS, np.bool_)
        while self._lacking:
            lacking[:] = False
            lacking[list(self._lacking)] = True
            hits = np.flatnonzero(lacking[spans.ids[at:]])
            if not len(hits):
                return
            k = int(np.searchsorted(spans.first, at + hits[0], side="right")) - 1
            yield spans[k]
            at = int(spans.first[k + 1])

    def _needs(self, span: Span) -> bool:
        """Whether the span may hold a message or a description that is missing."""
        if self._adds_up:
            return not self._lacking.isdisjoint(span.counts)
        in_file = self.survey.statistics or {}
        if not span.counts:
            while self._waiting and not self._lacks(*self._waiting[-1]):
                self._waiting.pop()
            return not in_file or bool(self._waiting)
        return any(
            self._lacks(channel_id, max(n, in_file.get(channel_id, N_WANTED)))
            for channel_id, n in span.counts.items()
        )

    def _all_lacking(self) -> set[int]:
        """The channels of the statistics of which something is missing."""
        return {k for k, n in (self.survey.statistics or {}).items() if self._lacks(k, n)}

    def _lacks(self, channel_id: int, n_messages: int) -> bool:
        """Whether a channel is not described yet, or has fewer samples than wanted."""
        wanted = N_WANTED if self.n_bytes < _FIRST_BYTES else N_WANTED_LATER
        few = self.seen.get(channel_id, 0) < min(wanted, n_messages)
        return few or channel_id not in self.catalogue.channels

    def _take(self, data: U8) -> None:
        """Enter the descriptions and the messages of a span's records."""
        self.n_bytes += len(data)
        for found in walk_pieces(data):
            self.catalogue.enter(data, found.others)
            messages = found.messages
            counts, by_channel = messages.counts(), np.argsort(messages.channel, kind="stable")
            rows = np.split(by_channel, np.cumsum(list(counts.values()), dtype=np.int64))
            for (channel_id, count), own in zip(counts.items(), rows, strict=False):
                self._keep(data, messages, channel_id, own)
                self.seen[channel_id] = self.seen.get(channel_id, 0) + count
        self._lacking = self._all_lacking()

    def _keep(self, data: U8, messages: Messages, channel_id: int, rows: I64) -> None:
        """Keep a channel's first messages, which are in ``rows``, within the limits of number and size."""
        kept = self.samples.setdefault(channel_id, [])
        for row in rows[: _N_KEPT - len(kept)].tolist():
            start, length = int(messages.offset[row]), int(messages.length[row])
            if kept and length * len(kept) > _KEPT_BYTES:
                return
            if not self.catalogue.may_keep(length):
                return
            content = data[start : start + length].tobytes()
            kept.append(Sample(content, int(messages.log_ns[row]), int(messages.publish_ns[row])))

    @cached_property
    def _waiting(self) -> list[tuple[int, int]]:
        """Channels of the statistics that may lack something; one that lacks nothing never does again."""
        return list((self.survey.statistics or {}).items())

    def known_messages(self) -> dict[int, int]:
        """:meth:`n_messages` of all channels that are described, in one pass over the spans."""
        ids, n, _ = counts_of(self.survey.spans)
        indexed = np.bincount(ids, n, N_CHANNEL_IDS).astype(np.int64)
        in_file, seen = self.survey.statistics or {}, self.seen
        return {k: max(int(indexed[k]), in_file.get(k, 0), seen.get(k, 0)) for k in self.catalogue.channels}
