"""A chunk of a ROS 1 bag as message records: decompressed, and framed where its messages lie.

The index records behind a chunk tell where its messages start. Each message has its own header there, which
is longer than the head of an MCAP message and is overwritten by it; the messages' data are not moved.
"""

import bz2
from collections.abc import Mapping

import numpy as np

from wmr_replay.ingest.bags.message_records import ROOM_BYTES, framed
from wmr_replay.ingest.bags.ros1_records import NS_PER_S, Op, Record, record_at, records_in
from wmr_replay.ingest.mcap.chunks import Buffer, Unreadable, open_chunk
from wmr_replay.ingest.mcap.records import ChunkHead, Malformed
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_schemas.arrays import I64, U8

_ENTRY = np.dtype([("seconds", "<u4"), ("nanoseconds", "<u4"), ("offset", "<u4")])
_COMPRESSIONS = {"none": "", "lz4": "lz4"}
_LENGTHS_BYTES = 8
"""The two lengths around a header."""
_LEAST_HEADER = ROOM_BYTES - _LENGTHS_BYTES


class Places:
    """Messages of a chunk in order: connections, times in ns, starts and lengths of their data (n,)."""

    def __init__(self, connection: I64, time_ns: I64, start: I64, length: I64) -> None:
        self.connection, self.time_ns, self.start, self.length = connection, time_ns, start, length


def chunk_records(stored: bytes, channel_of: Mapping[int, int], workspace: Workspace) -> tuple[U8, str]:
    """The records of a stored chunk and its index, and what is wrong with it. Raises Unreadable, Malformed.

    Messages of connections that ``channel_of`` lacks get the channel 0.
    """
    content, stop = unpacked_chunk(stored, workspace)
    data = np.frombuffer(bytearray(content), np.uint8)
    places, problem = _by_index(data, stored, stop), ""
    if places is None:
        places, problem = _by_walk(bytes(content))
    known, rows = np.unique(places.connection, return_inverse=True)
    channels = np.array([channel_of.get(int(k), 0) for k in known], np.int64)
    channel = channels[rows] if len(known) else places.connection
    return framed(data, channel, places.time_ns, places.start, places.length), problem


def unpacked_chunk(stored: bytes, workspace: Workspace) -> tuple[Buffer, int]:
    """The content of a chunk record, and where the record ends in ``stored``. Raises Unreadable, Malformed.

    Of a chunk that is cut, what can be unpacked is given.
    """
    record = record_at(stored, 0)
    if record.op != Op.CHUNK:
        raise Unreadable("there is no chunk where the index says")
    packed, whole = stored[record.start : record.stop], record.stop <= len(stored)
    size, name = record.u32(b"size"), record.text(b"compression")
    if name == "bz2":
        return _bz2(packed, size, whole=whole), record.stop
    if name not in _COMPRESSIONS:
        raise Unreadable(f"unknown compression {name[:40]!r}")
    head = ChunkHead(0, 0, size, 0, _COMPRESSIONS[name], len(packed), 0)
    return open_chunk(head, packed, workspace, whole=whole), record.stop


def _bz2(packed: bytes, size: int, *, whole: bool) -> bytes:
    """At most ``size`` bytes of a bz2 stream. Raises Unreadable."""
    try:
        content = bz2.BZ2Decompressor().decompress(packed, size + 1)
    except (OSError, ValueError, EOFError) as error:
        raise Unreadable(f"bz2 data are damaged ({error})") from None
    if whole and len(content) != size:
        raise Unreadable(f"holds {len(content)} bytes where its header claims {size}")
    return content[:size]


def _by_index(data: U8, stored: bytes, position: int) -> Places | None:
    """The messages by the index records that follow at ``position``; None unless they fit the data."""
    entries, connections = [], []
    for record in records_in(stored, position):
        if record.op != Op.INDEX or (record.stop - record.start) % _ENTRY.itemsize:
            return None
        some = np.frombuffer(stored[record.start : record.stop], _ENTRY)
        entries.append(some)
        connections.append(np.full(len(some), record.u32(b"conn"), np.int64))
    if not entries:
        return None
    found = np.concatenate(entries)
    offset = found["offset"].astype(np.int64)
    order = np.argsort(offset, kind="stable")
    time_ns = found["seconds"].astype(np.int64) * NS_PER_S + found["nanoseconds"]
    bounds = _bounds(data, offset[order])
    if bounds is None:
        return None
    return Places(np.concatenate(connections)[order], time_ns[order], *bounds)


def _bounds(data: U8, offset: I64) -> tuple[I64, I64] | None:
    """Starts and lengths of the data of the message records at ``offset``, in order; None unless they fit."""
    header = _u32(data, offset)
    if header is None or not ((header >= _LEAST_HEADER) & (header <= len(data))).all():
        return None
    start = offset + _LENGTHS_BYTES + header
    length = _u32(data, start - 4)
    if length is None:
        return None
    stop = start + length
    fits = (stop <= len(data)).all() and (offset[1:] >= stop[:-1]).all()
    return (start, length) if fits else None


def _u32(data: U8, position: I64) -> I64 | None:
    """Numbers of four bytes at ``position`` (n,); None where one lies beyond the data."""
    if len(position) and (position.min() < 0 or position.max() + 4 > len(data)):
        return None
    raw = np.ascontiguousarray(data[position[:, None] + np.arange(4)])
    return raw.view("<u4")[:, 0].astype(np.int64)


def _by_walk(content: bytes) -> tuple[Places, str]:
    """The messages by a walk over the records, for chunks without an index that fits."""
    found: list[tuple[int, int, int, int]] = []
    position = 0
    for record in records_in(content):
        position = record.stop
        if record.op == Op.MESSAGE and (place := _place(record, found)) is not None:
            found.append(place)
    columns = np.array(found, np.int64).reshape(-1, 4).T
    problem = "" if position == len(content) else f"it ends or is damaged {position} bytes in"
    return Places(*columns), problem


def _place(record: Record, before: list[tuple[int, int, int, int]]) -> tuple[int, int, int, int] | None:
    """Connection, time, start and length of one message; None for a header that is malformed or too short."""
    room = record.start - (before[-1][2] + before[-1][3] if before else 0)
    try:
        connection, time_ns = record.u32(b"conn"), record.time_ns(b"time")
    except Malformed:
        return None
    return (connection, time_ns, record.start, record.stop - record.start) if room >= ROOM_BYTES else None
