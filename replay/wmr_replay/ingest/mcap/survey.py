"""Survey of a file by the heads of its records: no chunk is opened, and no summary is needed.

One pass in file order. Where a record's length cannot be true, reading goes on at the next chunk that the
summary points to, if there is one; what lies between is reported.
"""

import struct
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from wmr_replay.ingest.budgets import BUDGETS
from wmr_replay.ingest.mcap.catalogue import Catalogue
from wmr_replay.ingest.mcap.checksums import data_section_differs, is_covered
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.records import (
    HEAD,
    MAGIC,
    Malformed,
    Opcode,
    parse_channel_counts,
    parse_chunk_head,
    parse_header,
    parse_metadata,
)
from wmr_replay.ingest.mcap.stray_records import StrayRecords, is_in_order
from wmr_replay.ingest.mcap.walk import walk
from wmr_replay.ingest.storage.source import LogPath, size_of

WINDOW_BYTES = 2 << 20
"""Records outside chunks are read in pieces of about this size."""
_CHUNK_HEAD_BYTES = 1 << 12
"""Enough for a chunk's head with any sensible name of a compression."""
_MOST_TOLD = 100
"""Chunks of which only the index knows that are named."""
_MOST_METADATA = 1000
"""Metadata records of different names that are kept."""
_FOOTER = struct.Struct("<BQQQI")
_DESCRIBING = {Opcode.HEADER, Opcode.METADATA, Opcode.STATISTICS}
_PLAIN = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE}


@dataclass
class Survey:
    """Spans to read, what is known of the channels, metadata by name, what is wrong with the file's frame."""

    size_bytes: int
    profile: str = ""
    library: str = ""
    catalogue: Catalogue = field(default_factory=Catalogue)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    spans: Sequence[Span] = ()
    statistics: dict[int, int] | None = None
    truncated: bool = False
    n_chunks_damaged: int = 0
    strays: StrayRecords = field(default_factory=StrayRecords)
    data_end: tuple[int, int] | None = None
    """Where the data section ends, and its checksum (0: none)."""
    notes: list[str] = field(default_factory=list)

    @property
    def by_rows(self) -> bool:
        """Whether all spans are ranges of numbered rows: some of them tell about how many messages there
        are in all.
        """
        return bool(self.spans) and not self.truncated and all(span.n_rows for span in self.spans)


def survey(path: LogPath) -> Survey:
    """Survey a file that starts with MCAP's magic."""
    with path.open("rb") as file:
        return Surveyor(file, size_of(path)).run()


class Surveyor:
    """Goes from record head to record head."""

    def __init__(self, file: BinaryIO, size_bytes: int) -> None:
        self.file, self.size = file, size_bytes
        self.spans: list[Span] = []
        self.result = Survey(size_bytes, spans=self.spans)
        self.in_summary = False
        self.claimed = sorted(set(indexed_chunks(file, size_bytes)))
        self.landmarks = sorted(
            mark for mark, n_bytes in self.claimed if mark < size_bytes and is_chunk(file, mark, n_bytes)
        )

    def run(self) -> Survey:
        """Survey the whole file, from its first record to its footer."""
        position: int | None = len(MAGIC)
        n_left = most = BUDGETS.most_records(self.size)
        while position is not None and position < self.size and n_left:
            position, n_left = self._step(position), n_left - 1
        if not n_left and position is not None and position < self.size:
            left = f"{self.size - position} bytes are left in the file"
            self._ends_early(f"byte {position}: more than {most:,} records, which are read at most; {left}")
            position = None
        if position is not None:
            self._ends_early("the file ends without a footer")
        self._check_index()
        self._check_data()
        return self.result

    def _check_index(self) -> None:
        """Every chunk of the summary's index was met."""
        met = {span.offset for span in self.spans}
        missing = [mark for mark, _ in self.claimed if mark not in met]
        self.result.n_chunks_damaged += len(missing)
        self.result.notes += [
            f"the chunk at byte {mark} is left out: only the index knows of it"
            for mark in missing[:_MOST_TOLD]
        ]
        if (more := len(missing) - _MOST_TOLD) > 0:
            self.result.notes.append(f"{more:,} more chunks are left out: only the index knows of them")

    def _check_data(self) -> None:
        """The data section has the checksum that is stated behind it, where no other covers the messages."""
        stop, crc = self.result.data_end or (0, 0)
        if not crc or all(is_covered(span) for span in self.spans):
            return
        if data_section_differs(self.file, stop, crc):
            self.result.notes.append(
                "the checksum of the data section does not match: something in it was changed"
            )

    def _step(self, position: int) -> int | None:
        """Take in the record at ``position``; the start of the next, or None at the end."""
        head = self._read(position, HEAD.size)
        if len(head) < HEAD.size:
            return self._lost(position, "the file ends inside a record's head")
        opcode, length = HEAD.unpack(head)
        stop: int = position + HEAD.size + length
        fits = opcode != 0 and stop <= min(self.size, self._next_landmark(position))
        if fits and opcode in _PLAIN and length <= BUDGETS.most_chunk_bytes:
            return self._plain(position, stop)
        if fits and opcode in _PLAIN:
            self.result.n_chunks_damaged += 1
            self.result.notes.append(
                f"byte {position}: a record of {length:,} bytes is left out, more than is read"
            )
            return stop
        if fits and opcode == Opcode.FOOTER:
            self._footer(stop)
            return None
        if fits or opcode == Opcode.CHUNK:
            self._enter(opcode, position, length, fits)
        return stop if fits else self._lost(position, f"a record of type {opcode:#04x} claims {length} bytes")

    def _enter(self, opcode: int, position: int, length: int, fits: bool) -> None:
        """Take in a record; a malformed one is noted."""
        try:
            self._take(opcode, position, length, fits)
        except Malformed as error:
            self.result.n_chunks_damaged += opcode == Opcode.CHUNK
            self.result.notes.append(f"byte {position}: a malformed record of type {opcode:#04x} ({error})")

    def _take(self, opcode: int, position: int, length: int, fits: bool) -> None:
        """Take in a record by its type. Raises Malformed."""
        self._place(opcode, position)
        if opcode in _DESCRIBING and length > BUDGETS.most_record_bytes:
            raise Malformed(f"{length:,} bytes, of which {BUDGETS.most_record_bytes:,} are read at most")
        if opcode == Opcode.CHUNK:
            self._chunk(position, length, fits)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._message_index(position, length)
        elif opcode == Opcode.METADATA:
            name, content = parse_metadata(self._content(position, length))
            if len(self.result.metadata) < _MOST_METADATA:
                self.result.metadata.setdefault(name, content)
        elif opcode == Opcode.STATISTICS:
            self.result.statistics = parse_channel_counts(self._content(position, length))
        elif opcode == Opcode.DATA_END:
            self.in_summary = True
            self.result.data_end = position, int.from_bytes(self._content(position, min(length, 4)), "little")
        elif opcode == Opcode.HEADER:
            self.result.profile, self.result.library = parse_header(self._content(position, length))

    def _place(self, opcode: int, position: int) -> None:
        """Count a record that may not stand there."""
        spans, first = self.spans, position == len(MAGIC)
        behind_chunk = bool(spans) and spans[-1].head is not None
        in_order = is_in_order(opcode, first=first, in_summary=self.in_summary, behind_chunk=behind_chunk)
        self.result.strays.meet(opcode, in_order=in_order)

    def _chunk(self, position: int, length: int, fits: bool) -> None:
        """Add the span of a chunk record. Raises Malformed."""
        available = min(length, self.size - position - HEAD.size)
        head = parse_chunk_head(self._content(position, min(available, _CHUNK_HEAD_BYTES)))
        start = position + HEAD.size + head.head_bytes
        stored = min(head.stored_bytes, available - head.head_bytes)
        self.spans.append(
            Span(
                position,
                start,
                stored,
                head,
                whole=fits or stored == head.stored_bytes,
                times_ns=(head.start_ns, head.end_ns),
            )
        )

    def _message_index(self, position: int, length: int) -> None:
        """Count the last chunk's messages of one channel, by the length of their index."""
        channel_id = int.from_bytes(self._content(position, min(length, 2)), "little")
        if self.spans and self.spans[-1].head is not None:
            self.spans[-1].counts[channel_id] = max(length - 6, 0) // 16

    def _plain(self, position: int, stop: int) -> int:
        """Walk over records outside chunks; return where the walk ended."""
        data = np.frombuffer(self._read(position, max(WINDOW_BYTES, stop - position)), np.uint8)
        found = walk(data, plain=True)
        self.result.catalogue.enter(data, found.others, summary=self.in_summary)
        if len(found.messages):
            self.spans.append(
                Span(
                    position,
                    position,
                    found.stop,
                    counts=found.messages.counts(),
                    times_ns=(int(found.messages.log_ns.min()), int(found.messages.log_ns.max())),
                )
            )
        return position + found.stop

    def _footer(self, stop: int) -> None:
        """Note a missing closing magic."""
        if self._read(stop, len(MAGIC)) != MAGIC:
            self._ends_early("the closing magic is missing")

    def _lost(self, position: int, what: str) -> int | None:
        """Note a record that cannot be read; return the next chunk's offset, or None at the end."""
        resume = self._next_landmark(position)
        if resume < self.size:
            self.result.notes.append(
                f"byte {position}: {what}; reading goes on with the chunk at byte {resume}"
            )
            return resume
        self._ends_early(f"byte {position}: {what}; {self.size - position} bytes are left in the file")
        return None

    def _ends_early(self, what: str) -> None:
        """Note that the file is truncated, and where."""
        self.result.truncated = True
        self.result.notes.append(what)

    def _next_landmark(self, position: int) -> int:
        """Offset of the next chunk by the summary, or the file's size."""
        k = bisect_right(self.landmarks, position)
        return self.landmarks[k] if k < len(self.landmarks) else self.size

    def _read(self, position: int, n_bytes: int) -> bytes:
        """At most ``n_bytes`` from ``position`` on."""
        self.file.seek(position)
        return self.file.read(n_bytes)

    def _content(self, position: int, length: int) -> bytes:
        """At most ``length`` bytes of the content of the record at ``position``."""
        return self._read(position + HEAD.size, length)


def indexed_chunks(file: BinaryIO, size: int) -> list[tuple[int, int]]:
    """Starts and lengths of the chunks according to the summary."""
    tail = _FOOTER.size + len(MAGIC)
    file.seek(max(size - tail, 0))
    end = file.read(tail)
    if len(end) < tail or end[_FOOTER.size :] != MAGIC or end[0] != Opcode.FOOTER:
        return []
    _, length, summary_start, _, _ = _FOOTER.unpack_from(end)
    if length != _FOOTER.size - HEAD.size or not 0 < summary_start < size - tail:
        return []
    if size - tail - summary_start > BUDGETS.most_summary_bytes:
        return []
    file.seek(summary_start)
    return _chunk_indexes(file.read(size - tail - summary_start), BUDGETS.most_records(size))


def _chunk_indexes(summary: bytes, most: int) -> list[tuple[int, int]]:
    """Starts and lengths in bytes out of the chunk index records among the summary's first ``most``."""
    found, position, n_left = [], 0, most
    while position + HEAD.size <= len(summary) and n_left:
        n_left -= 1
        opcode, length = HEAD.unpack_from(summary, position)
        body = position + HEAD.size
        if opcode == Opcode.CHUNK_INDEX and body + 32 <= len(summary):
            found.append(struct.unpack_from("<QQ", summary, body + 16))
        position = body + length
    return found


def is_chunk(file: BinaryIO, start: int, n_bytes: int) -> bool:
    """Whether a chunk record of ``n_bytes`` starts there."""
    if n_bytes < HEAD.size:
        return False
    file.seek(start)
    return file.read(HEAD.size) == HEAD.pack(Opcode.CHUNK, n_bytes - HEAD.size)
