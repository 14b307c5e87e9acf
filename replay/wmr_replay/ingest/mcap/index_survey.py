"""A survey from the file's own index: a few small reads, for files of which every read is a request.

The index is used only if its checksum holds, its records fit, and its counts add up to the file's statistics.
Its description of a chunk is checked again when the chunk is read.
"""

import struct
import zlib
from array import array
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
from wmr_schemas.arrays import I64
from wmr_schemas.errors import LogUnusable

FOOTER = struct.Struct("<BQQQI")
_HEADER_BYTES = 1 << 10
MOST_RECORDS = 1 << 21
"""Of a summary: an index of a million chunks has half of it."""


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
        for start, length in places[opcode].tolist():
            yield summary[start : start + length]

    for content in contents(Opcode.STATISTICS):
        found.statistics = parse_channel_counts(content)
    for content in contents(Opcode.METADATA_INDEX):
        name, metadata = _metadata(file, content, found.size_bytes)
        found.metadata.setdefault(name, metadata)
    starts, lengths = places[Opcode.CHUNK_INDEX].T
    found.spans = chunk_index(summary, starts, lengths, found.size_bytes)
    described = np.concatenate([places[Opcode.SCHEMA][:, 0], places[Opcode.CHANNEL][:, 0]])
    heads = np.sort(described) - HEAD.size
    found.catalogue.enter(np.frombuffer(summary, np.uint8), heads, summary=True)


def _record_places(summary: bytes) -> dict[Opcode, I64]:
    """Start and length (n, 2) of the contents of all records, by opcode. Raises Malformed, struct.error."""
    found, stop, n_left = {int(opcode): array("q") for opcode in Opcode}, len(summary), MOST_RECORDS
    position, unpack, head_bytes = 0, HEAD.unpack_from, HEAD.size
    while position < stop:
        opcode, length = unpack(summary, position)
        position += head_bytes
        if opcode in found:
            found[opcode].extend((position, min(length, stop)))
        position, n_left = position + length, n_left - 1
        if not n_left:
            raise Malformed(f"more than {MOST_RECORDS:,} records in the summary")
    if position > stop:
        raise Malformed("a record runs over the end of the summary")
    return {Opcode(opcode): np.array(places, np.int64).reshape(-1, 2) for opcode, places in found.items()}


def _metadata(file: BinaryIO, content: bytes, size_bytes: int) -> tuple[str, dict[str, str]]:
    """Name and content of the metadata record to which an index record points. Raises Malformed."""
    cursor = Cursor(content)
    offset, length = cursor.uint(8), cursor.uint(8)
    if length > BUDGETS.most_record_bytes:
        raise Malformed(f"metadata of {length:,} bytes")
    if offset >= size_bytes:
        raise Malformed("the index points behind the end of the file")
    file.seek(offset)
    record = file.read(length)
    if len(record) < HEAD.size or record[0] != Opcode.METADATA:
        raise Malformed("the index points to no metadata")
    return parse_metadata(record[HEAD.size :])
