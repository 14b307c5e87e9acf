"""The records of an MCAP file that say what the messages are: schemas, channels, metadata, chunk headers.

Layouts: the MCAP specification, section "Records". Lengths are checked before anything is read, so that a
damaged record raises :class:`Malformed` and nothing else.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

from wmr_replay.ingest.storage.file_check import MCAP_MAGIC

MAGIC = MCAP_MAGIC
"""The first and the last bytes of every file."""
HEAD = struct.Struct("<BQ")
"""Opcode and content length, before every record."""
_CHUNK = struct.Struct("<QQQI")


class Opcode(IntEnum):
    """Record types of the specification; others are skipped, as it demands."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


class Malformed(ValueError):
    """A record whose content does not fit its own length."""


@dataclass(frozen=True)
class Schema:
    """A message definition: ``data`` in the language named by ``encoding``."""

    id: int
    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class Channel:
    """A stream of messages. Two channels may share a topic; the ``id`` tells them apart."""

    id: int
    schema_id: int
    topic: str
    message_encoding: str


@dataclass(frozen=True)
class ChunkHead:
    """A chunk's header; the compressed records start ``head_bytes`` after the record's content."""

    start_ns: int
    end_ns: int
    uncompressed_bytes: int
    uncompressed_crc: int
    compression: str
    stored_bytes: int
    head_bytes: int


class Cursor:
    """Reads little-endian fields from the front of a record's content."""

    def __init__(self, data: bytes) -> None:
        self.data, self.position = data, 0

    def take(self, n_bytes: int) -> bytes:
        """The next bytes. Raises Malformed when there are fewer."""
        stop = self.position + n_bytes
        if stop > len(self.data):
            raise Malformed(f"{n_bytes} bytes wanted, {len(self.data) - self.position} left")
        piece = self.data[self.position : stop]
        self.position = stop
        return piece

    def uint(self, n_bytes: int) -> int:
        """An unsigned integer of ``n_bytes``. Raises Malformed."""
        return int.from_bytes(self.take(n_bytes), "little")

    def text(self) -> str:
        """A string with a 32-bit length; bytes that are not UTF-8 are replaced."""
        return self.take(self.uint(4)).decode(errors="replace")

    def text_map(self) -> dict[str, str]:
        """A map of strings, with its length in bytes in front."""
        stop = self.uint(4) + self.position
        pairs = {}
        while self.position < stop:
            key = self.text()
            pairs[key] = self.text()
        return pairs


def parse_header(data: bytes) -> tuple[str, str]:
    """Profile and library of the file."""
    cursor = Cursor(data)
    return cursor.text(), cursor.text()


def parse_schema(data: bytes) -> Schema:
    """A Schema record's content. Raises Malformed."""
    cursor = Cursor(data)
    return Schema(cursor.uint(2), cursor.text(), cursor.text(), cursor.take(cursor.uint(4)))


def parse_channel(data: bytes) -> Channel:
    """A Channel record's content. Raises Malformed."""
    cursor = Cursor(data)
    return Channel(cursor.uint(2), cursor.uint(2), cursor.text(), cursor.text())


def parse_metadata(data: bytes) -> tuple[str, dict[str, str]]:
    """Name and content of a Metadata record."""
    cursor = Cursor(data)
    return cursor.text(), cursor.text_map()


def parse_chunk_head(data: bytes) -> ChunkHead:
    """The part of a Chunk record before its compressed records."""
    cursor = Cursor(data)
    start_ns, end_ns, size, crc = _CHUNK.unpack(cursor.take(_CHUNK.size))
    compression, stored = cursor.text(), cursor.uint(8)
    return ChunkHead(start_ns, end_ns, size, crc, compression, stored, cursor.position)


def parse_channel_counts(data: bytes) -> dict[int, int]:
    """Messages by channel id, out of a Statistics record."""
    cursor = Cursor(data)
    cursor.take(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8)
    stop = cursor.uint(4) + cursor.position
    counts = {}
    while cursor.position < stop:
        channel_id = cursor.uint(2)
        counts[channel_id] = cursor.uint(8)
    return counts
