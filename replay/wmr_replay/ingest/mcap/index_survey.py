"""A survey from the file's own index: a few small reads, for files of which every read is a request.

The index is used only if its checksum holds, its records fit, and its counts add up to the file's statistics.
Its description of a chunk is checked again when the chunk is read.
"""

import struct
import zlib
from itertools import pairwise
from typing import BinaryIO

import numpy as np

from wmr_replay.ingest.budgets import BUDGETS
from wmr_replay.ingest.mcap.chunk_selection import index_adds_up
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.mcap.records import (
    HEAD,
    MAGIC,
    ChunkHead,
    Cursor,
    Malformed,
    Opcode,
    parse_channel_counts,
    parse_header,
    parse_metadata,
)
from wmr_replay.ingest.mcap.survey import Survey, survey
from wmr_replay.ingest.storage.source import LogPath, RemotePath, size_of
from wmr_schemas.errors import LogUnusable

FOOTER = struct.Struct("<BQQQI")
_TIMES_AND_PLACE, _PLACE = struct.Struct("<QQQQ"), struct.Struct("<HQ")
"""The start of a chunk index record, and one entry of its map: a channel's id and its index's place."""
_HEADER_BYTES = 1 << 10
_FIXED_HEAD_BYTES = 40
"""A chunk's head without the name of its compression."""
_INDEX_HEAD_BYTES, _INDEX_ENTRY_BYTES = HEAD.size + 6, 16


def surveyed(path: LogPath | Container, *, by_index: bool = False) -> Survey:
    """The survey of a file: on this machine by all its records, behind a URL by its index.

    ``by_index``: by its index wherever it is, if there is one that adds up.

    Raises LogUnusable when a URL's index is of no use; see
    :func:`wmr_replay.ingest.mcap.remote.readable_file`.
    """
    if isinstance(path, Container):
        return path.survey()
    if not by_index and not isinstance(path, RemotePath):
        return survey(path)
    with path.open("rb") as file:
        found = indexed_survey(file, size_of(path))
    if found is None and not isinstance(path, RemotePath):
        return survey(path)
    if found is None:
        raise LogUnusable(path, "the file has no index that could be used", "Download it first.")
    return found


def indexed_survey(file: BinaryIO, size_bytes: int) -> Survey | None:
    """The survey by the file's summary; None without a summary, or with one that fails a check."""
    summary = read_summary(file, size_bytes)
    if not summary:
        return None
    found = Survey(size_bytes)
    try:
        _enter_header(found, file)
        _enter_summary(found, file, summary)
    except (Malformed, struct.error):
        return None
    found.spans.sort(key=lambda span: span.offset)
    return found if index_adds_up(found) and not found.catalogue.n_malformed else None


def read_summary(file: BinaryIO, size_bytes: int) -> bytes:
    """The summary section, nothing where it is missing or its checksum is wrong."""
    tail_bytes = FOOTER.size + len(MAGIC)
    file.seek(max(size_bytes - tail_bytes, 0))
    tail = file.read(tail_bytes)
    if len(tail) < tail_bytes or tail[FOOTER.size :] != MAGIC or tail[0] != Opcode.FOOTER:
        return b""
    _, _, start, _, crc = FOOTER.unpack_from(tail)
    if not 0 < start < size_bytes - tail_bytes or size_bytes - start > BUDGETS.most_summary_bytes:
        return b""
    file.seek(start)
    summary = file.read(size_bytes - tail_bytes - start)
    covered = tail[: FOOTER.size - 4]
    return summary if not crc or zlib.crc32(covered, zlib.crc32(summary)) == crc else b""


def _enter_header(found: Survey, file: BinaryIO) -> None:
    """Profile and library out of the file's first record. Raises Malformed."""
    file.seek(0)
    data = file.read(_HEADER_BYTES)
    opcode, length = HEAD.unpack_from(data, len(MAGIC))
    if not data.startswith(MAGIC) or opcode != Opcode.HEADER:
        raise Malformed("no header")
    start = len(MAGIC) + HEAD.size
    found.profile, found.library = parse_header(data[start : start + length])


def _enter_summary(found: Survey, file: BinaryIO, summary: bytes) -> None:
    """Statistics, chunk indexes, metadata and descriptions out of the summary. Raises Malformed,
    struct.error.
    """
    position, starts = 0, []
    while position < len(summary):
        opcode, length = HEAD.unpack_from(summary, position)
        content = summary[position + HEAD.size : position + HEAD.size + length]
        if len(content) < length:
            raise Malformed("a record runs over the end of the summary")
        if opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
            starts.append(position)
        elif opcode == Opcode.STATISTICS:
            found.statistics = parse_channel_counts(content)
        elif opcode == Opcode.CHUNK_INDEX:
            found.spans.append(indexed_chunk(content, found.size_bytes))
        elif opcode == Opcode.METADATA_INDEX:
            name, metadata = _metadata(file, content)
            found.metadata.setdefault(name, metadata)
        position += HEAD.size + length
    found.catalogue.enter(np.frombuffer(summary, np.uint8), np.array(starts, np.int64), summary=True)


def _metadata(file: BinaryIO, content: bytes) -> tuple[str, dict[str, str]]:
    """Name and content of the metadata record to which an index record points. Raises Malformed."""
    cursor = Cursor(content)
    offset, length = cursor.uint(8), cursor.uint(8)
    if length > BUDGETS.most_record_bytes:
        raise Malformed(f"metadata of {length:,} bytes")
    file.seek(offset)
    record = file.read(length)
    if len(record) < HEAD.size or record[0] != Opcode.METADATA:
        raise Malformed("the index points to no metadata")
    return parse_metadata(record[HEAD.size :])


def indexed_chunk(content: bytes, size_bytes: int) -> Span:
    """A chunk by its index record, its checksum still unknown. Raises Malformed."""
    cursor = Cursor(content)
    start_ns, end_ns, offset, length = _TIMES_AND_PLACE.unpack(cursor.take(_TIMES_AND_PLACE.size))
    map_bytes = cursor.uint(4)
    if map_bytes % _PLACE.size:
        raise Malformed(f"{map_bytes} bytes of places")
    places = dict(_PLACE.iter_unpack(cursor.take(map_bytes)))
    index_bytes, compression = cursor.uint(8), cursor.text()
    stored, uncompressed = cursor.uint(8), cursor.uint(8)
    head_bytes = _FIXED_HEAD_BYTES + len(compression.encode())
    if length != HEAD.size + head_bytes + stored or offset + length + index_bytes > size_bytes:
        raise Malformed(f"the index does not describe the chunk at byte {offset}")
    return Span(
        offset,
        offset + HEAD.size + head_bytes,
        stored,
        ChunkHead(start_ns, end_ns, uncompressed, 0, compression, stored, head_bytes),
        counts=_counts(places, offset + length + index_bytes),
        times_ns=(start_ns, end_ns),
        by_index=True,
    )


def _counts(places: dict[int, int], stop: int) -> dict[int, int]:
    """Messages by channel: how long each channel's index record is, up to the next one's start."""
    sizes = {start: end - start for start, end in pairwise([*sorted(places.values()), stop])}
    return {k: max(sizes[start] - _INDEX_HEAD_BYTES, 0) // _INDEX_ENTRY_BYTES for k, start in places.items()}
