"""ROS 1 bags (``.bag``, format 2.0), presented as spans of message records: a chunk with its index each.

Connections of one topic and type, such as those of several publishers of ``/tf``, are one channel. A bag that
was not closed has no index; its chunks are found one after another, and each is opened for its connections.
"""

import os
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from wmr_replay.ingest.bags.ros1_chunk import chunk_records, unpacked_chunk
from wmr_replay.ingest.bags.ros1_index import bag_index
from wmr_replay.ingest.bags.ros1_records import (
    MOST_HEADER_BYTES,
    Op,
    Record,
    parse_fields,
    record_at,
    records_in,
    u32_at,
)
from wmr_replay.ingest.mcap.chunk_selection import counts_of
from wmr_replay.ingest.mcap.chunks import NO_BYTES, Block, Span, SpanFile, Unreadable
from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.mcap.records import Channel, Malformed, Schema
from wmr_replay.ingest.mcap.survey import Survey
from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_replay.ingest.storage.file_check import ROS1_MAGIC
from wmr_schemas.errors import LogUnusable

_NOT_CLOSED = "it has no index, since its recording was not closed or its end is missing"


class Ros1Bag(Container):
    """A ``.bag`` file."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.channels = Channels()

    def open(self, mode: str = "rb") -> "Ros1File":
        """A handle of its own for the calling thread."""
        return Ros1File(self)

    def survey(self) -> Survey:
        """Connections and chunks by the bag's index, or by a walk over its records. Raises LogUnusable."""
        found = Survey(self.size_bytes, "ros1", "rosbag 2.0")
        with self.path.open("rb") as file:
            try:
                header = read_record(file, len(ROS1_MAGIC))
                index_start = header.u64(b"index_pos")
            except Malformed as error:
                raise LogUnusable(self.path, f"its header is damaged ({error})", "Copy it again.") from None
            if encryptor := header.fields.get(b"encryptor", b"").decode(errors="replace"):
                raise LogUnusable(self.path, f"it is encrypted ({encryptor})", "Decrypt it: rosbag decrypt")
            if not self._by_index(found, file, header, index_start):
                self._by_walk(found, file, header.stop)
        for channel, schema in self.channels.described.values():
            found.catalogue.channels[channel.id] = channel
            found.catalogue.schemas[schema.id] = schema
        return found

    def _by_index(self, found: Survey, file: BinaryIO, header: Record, start: int) -> bool:
        """Fill in connections and chunks from the index; False where it is missing or damaged."""
        if not header.stop <= start <= found.size_bytes:
            return False
        file.seek(start)
        data = file.read()
        try:
            n_connections = header.u32(b"conn_count")
            for record in islice(records_in(data), n_connections):
                if record.op != Op.CONNECTION:
                    raise Malformed("a connection that is not in the index")
                self.channels.enter(record, data[record.start : record.stop])
            n_chunks = header.u32(b"chunk_count")
            found.spans = bag_index(data, self.channels.of_connection, start) if n_chunks else []
            if len(found.spans) != n_chunks:
                raise Malformed("chunks that are not in the index")
        except Malformed:
            self.channels.clear()
            return False
        ids, n, _ = counts_of(found.spans)
        summed = np.bincount(ids, n, N_CHANNEL_IDS)
        found.statistics = {int(k): int(summed[k]) for k in np.flatnonzero(summed)}
        return True

    def _by_walk(self, found: Survey, file: BinaryIO, position: int) -> None:
        """Fill in the chunks one after another, and the connections that stand in them."""
        spans = list[Span]()
        found.truncated, found.spans = True, spans
        found.notes.append(_NOT_CLOSED)
        while position < found.size_bytes:
            try:
                record = read_record(file, position)
            except Malformed as error:
                found.notes.append(f"byte {position}: {error}; {found.size_bytes - position} bytes are left")
                return
            if record.op == Op.CHUNK:
                spans.append(self._chunk(found.size_bytes, file, position, record))
            elif record.op == Op.INDEX and spans:
                last = spans[-1]
                length = record.stop - last.offset
                spans[-1] = Span(last.offset, last.offset, length, whole=last.whole, times_ns=last.times_ns)
            elif record.op == Op.CONNECTION:
                self._enter_connection(record, read_bytes(file, record.start, record.stop))
            position = record.stop

    def _chunk(self, size_bytes: int, file: BinaryIO, position: int, record: Record) -> Span:
        """The span of a chunk; its connections are entered."""
        stop = min(record.stop, size_bytes)
        data = read_bytes(file, position, stop)
        try:
            content, _ = unpacked_chunk(data, Workspace())
        except (Unreadable, Malformed):
            content = b""
        content, first_ns = memoryview(content), None
        for inner in records_in(content):
            if inner.op == Op.CONNECTION:
                self._enter_connection(inner, bytes(content[inner.start : inner.stop]))
            elif inner.op == Op.MESSAGE and first_ns is None:
                first_ns = inner.time_ns(b"time")
        times_ns = None if first_ns is None else (first_ns, first_ns)
        whole = record.stop <= size_bytes
        return Span(position, position, stop - position, whole=whole, times_ns=times_ns)

    def _enter_connection(self, record: Record, description: bytes) -> None:
        """Add a connection; a malformed one is left out, and its messages belong to no channel."""
        with suppress(Malformed):
            self.channels.enter(record, description)


class Channels:
    """Channels by topic and type, and the channel of each connection."""

    def __init__(self) -> None:
        self.described: dict[tuple[str, str, bytes], tuple[Channel, Schema]] = {}
        self.of_connection: dict[int, int] = {}

    def clear(self) -> None:
        """Forget all of them."""
        self.described.clear()
        self.of_connection.clear()

    def enter(self, record: Record, description: bytes) -> None:
        """Add a connection record with its data, which are fields as well. Raises Malformed."""
        described = Record(parse_fields(description), 0, 0)
        topic, kind = record.text(b"topic"), described.text(b"type")
        text = described.fields.get(b"message_definition", b"")
        identity, new_id = (topic, kind, text), len(self.described) + 1
        if identity not in self.described:
            if new_id >= N_CHANNEL_IDS:
                raise Malformed("too many connections")
            self.described[identity] = (
                Channel(new_id, new_id, topic, "ros1"),
                Schema(new_id, kind, "ros1msg", text),
            )
        self.of_connection[record.u32(b"conn")] = self.described[identity][0].id

    def id_of(self, connection: int) -> int:
        """The channel of a connection; 0 for one that the bag does not describe."""
        return self.of_connection.get(connection, 0)


class Ros1File(SpanFile):
    """A ``.bag`` file as one thread reads it."""

    def __init__(self, bag: Ros1Bag) -> None:
        self.bag, self.file = bag, bag.path.open("rb")

    def load(self, span: Span, workspace: Workspace) -> Block:
        """The messages of one chunk; those before a damaged place are kept."""
        stored = read_bytes(self.file, span.offset, span.offset + span.data_bytes)
        try:
            data, problem = chunk_records(stored, self.bag.channels.of_connection, workspace)
        except (Unreadable, Malformed) as error:
            return Block(span, NO_BYTES, str(error))
        return Block(span, data, problem)

    def close(self) -> None:
        """Close the handle."""
        self.file.close()


def read_record(file: BinaryIO, position: int) -> Record:
    """The record at a place of the file, with bounds in the file. Raises Malformed."""
    head = read_bytes(file, position, position + 4)
    size = u32_at(head, 0)
    if size > MOST_HEADER_BYTES:
        raise Malformed(f"a header of {size} bytes")
    record = record_at(read_bytes(file, position, position + 8 + size), 0)
    return Record(record.fields, position + record.start, position + record.stop)


def read_bytes(file: BinaryIO, start: int, stop: int) -> bytes:
    """The bytes of the file between two places, fewer at its end."""
    file.seek(start, os.SEEK_SET)
    return file.read(stop - start)
