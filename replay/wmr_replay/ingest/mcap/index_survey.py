"""A survey from the file's own index: a few small reads, for files of which every read is a request.

The index is used only if its checksum holds, its records fit, and its counts add up to the file's statistics.
Its description of a chunk is checked again when the chunk is read.
"""

import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np

from wmr_replay.ingest.budgets import BUDGETS
from wmr_replay.ingest.mcap.chunk_index import chunk_index
from wmr_replay.ingest.mcap.chunk_selection import index_adds_up
from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.mcap.records import (
    HEAD,
    MAGIC,
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
_HEADER_BYTES = 1 << 10


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
    places = _record_places(summary)

    def contents(opcode: Opcode) -> Iterator[bytes]:
        for start, length in places.get(opcode, ()):
            yield summary[start : start + length]

    for content in contents(Opcode.STATISTICS):
        found.statistics = parse_channel_counts(content)
    for content in contents(Opcode.METADATA_INDEX):
        name, metadata = _metadata(file, content)
        found.metadata.setdefault(name, metadata)
    chunks = np.array(places.get(Opcode.CHUNK_INDEX, ()), np.int64).reshape(-1, 2)
    found.spans = chunk_index(summary, chunks[:, 0], chunks[:, 1], found.size_bytes)
    described = places.get(Opcode.SCHEMA, []) + places.get(Opcode.CHANNEL, [])
    starts = np.array(sorted(start - HEAD.size for start, _ in described), np.int64)
    found.catalogue.enter(np.frombuffer(summary, np.uint8), starts, summary=True)


def _record_places(summary: bytes) -> dict[int, list[tuple[int, int]]]:
    """Start and length of the contents of all records, by opcode. Raises Malformed, struct.error."""
    found: dict[int, list[tuple[int, int]]] = defaultdict(list)
    position, unpack = 0, HEAD.unpack_from
    while position < len(summary):
        opcode, length = unpack(summary, position)
        position += HEAD.size
        found[opcode].append((position, length))
        position += length
    if position > len(summary):
        raise Malformed("a record runs over the end of the summary")
    return found


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
