"""The chunks of a ROS 1 bag's index in columns.

A record of the index names its chunk's place and times in its header, and has an entry of connection and
number of messages for each connection of the chunk. A writer puts the fields of all headers in one order, so
that they are read from the same places in every record.
"""

import struct

import numpy as np

from wmr_replay.ingest.bags.ros1_records import NS_PER_S, Op, record_at
from wmr_replay.ingest.mcap.chunk_index import ChunkIndex, demand, numbers_at
from wmr_schemas.arrays import I64, U8

_U32 = struct.Struct("<I")
_FIELDS = {b"chunk_pos": 8, b"start_time": 8, b"end_time": 8, b"count": 4}
_ENTRY_BYTES = 8
_AT_ONCE = 1 << 16


def bag_index(data: bytes, channel_of: dict[int, int], index_start: int) -> ChunkIndex:
    """The chunks by the index records that ``data``, the bag from ``index_start`` on, ends with. Raises
    Malformed where they do not describe chunks in front of the index, or not in the usual form.

    ``channel_of`` names the channels of connections; others have the channel 0.
    """
    heads, header_bytes = info_records(data)
    places = field_places(data, heads, header_bytes)
    found = np.frombuffer(data, np.uint8)
    offset = numbers_at(found, heads + places[b"chunk_pos"], 8).astype(np.int64)
    times_ns = [_times_ns(found, heads + places[name]) for name in (b"start_time", b"end_time")]
    n_entries = numbers_at(found, heads + places[b"count"], 4).astype(np.int64)
    bodies = heads + header_bytes + 4
    stops = numbers_at(found, bodies - 4, 4).astype(np.int64)
    demand((n_entries * _ENTRY_BYTES == stops).all(), "entries that do not fill their record")
    order = np.argsort(offset, kind="stable")
    length = np.diff(offset[order], append=index_start)
    demand(bool((offset > 0).all() and (length > 0).all()), "places that are none of a chunk")
    counts = _counts(found, bodies[order], n_entries[order], channel_of)
    return ChunkIndex(
        offset=offset[order],
        data_offset=offset[order],
        stored=length,
        uncompressed=np.zeros(len(order), np.uint64),
        start_ns=times_ns[0][order].astype(np.uint64),
        end_ns=times_ns[1][order].astype(np.uint64),
        file_index=np.zeros(len(order), np.int64),
        compression=np.zeros(len(order), np.int64),
        names=("",),
        **counts,
    )


def info_records(data: bytes) -> tuple[I64, int]:
    """Where the headers (n,) of the chunks' records start, and their common length. Raises Malformed."""
    starts, position, header_bytes, size = list[int](), 0, -1, len(data)
    read, append = _U32.unpack_from, starts.append
    while position < size - 8:
        length = read(data, position)[0]
        head = position + 4
        if length == header_bytes:
            append(head)
        elif record_at(data, position).op == Op.CHUNK_INFO:
            demand(header_bytes < 0, "headers of several lengths")
            header_bytes = length
            append(head)
        after = head + length
        demand(after + 4 <= size, "a record that is cut")
        position = after + 4 + read(data, after)[0]
    demand(position == size, "a record that is cut")
    return np.array(starts, np.int64), max(header_bytes, 0)


def field_places(data: bytes, heads: I64, header_bytes: int) -> dict[bytes, int]:
    """Where the values of the fields lie in each header. Raises Malformed unless all are of one form."""
    demand(len(heads) > 0, "no chunk")
    first = int(heads[0])
    header, found = data[first : first + header_bytes], np.frombuffer(data, np.uint8)
    places, is_value, at = dict[bytes, int](), np.zeros(header_bytes, np.bool_), 0
    while at < header_bytes:
        size = _U32.unpack_from(header, at)[0]
        name = header[at + 4 : at + 4 + size].partition(b"=")[0]
        value = at + 5 + len(name)
        if name in _FIELDS:
            demand(at + 4 + size - value == _FIELDS[name], "a field of another length")
            places[name], is_value[value : at + 4 + size] = value, True
        at += 4 + size
    demand(places.keys() == _FIELDS.keys(), "a field that is missing")
    fixed = np.flatnonzero(~is_value)
    template = np.frombuffer(header, np.uint8)[fixed]
    for some in range(0, len(heads), _AT_ONCE):
        alike = found[heads[some : some + _AT_ONCE, None] + fixed] == template
        demand(bool(alike.all()), "headers of several forms")
    return places


def _times_ns(data: U8, at: I64) -> I64:
    """Times (n,) of seconds and nanoseconds."""
    seconds, nanoseconds = (numbers_at(data, at + k, 4).astype(np.int64) for k in (0, 4))
    return np.asarray(seconds * NS_PER_S + nanoseconds)


def _counts(data: U8, at: I64, n_entries: I64, channel_of: dict[int, int]) -> dict[str, I64]:
    """``first``, ``ids`` and ``n`` of the index: messages by channel, of all its connections in a chunk."""
    before = np.cumsum(n_entries) - n_entries
    ordinal = np.repeat(np.arange(len(at)), n_entries)
    places = at[ordinal] + _ENTRY_BYTES * (np.arange(len(ordinal)) - before[ordinal])
    connections, n = (numbers_at(data, places + k, 4).astype(np.int64) for k in (0, 4))
    known, rows = np.unique(connections, return_inverse=True)
    channels = np.array([channel_of.get(k, 0) for k in known.tolist()], np.int64)[rows]
    keys, rows = np.unique(ordinal << 16 | channels, return_inverse=True)
    summed = np.zeros(len(keys), np.int64)
    np.add.at(summed, rows, n)
    first = np.searchsorted(keys >> 16, np.arange(len(at) + 1))
    return {"first": first.astype(np.int64), "ids": keys & 0xFFFF, "n": summed}
