"""An MCAP writer that writes whatever it is told, so that a file may contradict itself."""

import struct
from collections.abc import Iterable

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
T0_NS = 1_700_000_000_000_000_000
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, METADATA, DATA_END = 1, 2, 3, 4, 5, 6, 12, 15


def record(opcode: int, content: bytes) -> bytes:
    """A record: opcode, length, content."""
    return struct.pack("<BQ", opcode, len(content)) + content


def text(content: str | bytes) -> bytes:
    """A string with its length in front."""
    raw = content if isinstance(content, bytes) else content.encode()
    return struct.pack("<I", len(raw)) + raw


def schema(schema_id: int, name: str, encoding: str, definition: bytes) -> bytes:
    """A schema record."""
    return record(SCHEMA, struct.pack("<H", schema_id) + text(name) + text(encoding) + text(definition))


def channel(channel_id: int, schema_id: int, topic: str, encoding: str) -> bytes:
    """A channel record without metadata."""
    return record(
        CHANNEL, struct.pack("<HH", channel_id, schema_id) + text(topic) + text(encoding) + text("")
    )


def message(channel_id: int, t_ns: int, data: bytes) -> bytes:
    """A message record, logged and published at ``t_ns``."""
    return record(MESSAGE, struct.pack("<HIQQ", channel_id, 0, t_ns, t_ns) + data)


def metadata(name: str, values: dict[str, str | bytes]) -> bytes:
    """A metadata record."""
    pairs = b"".join(text(key) + text(value) for key, value in values.items())
    return record(METADATA, text(name) + text(pairs))


def chunk(records: bytes, compression: str = "zstd") -> bytes:
    """A chunk record without a checksum."""
    packed = {
        "": lambda: records,
        "zstd": lambda: zstandard.ZstdCompressor(level=3).compress(records),
        "lz4": lambda: lz4.frame.compress(records, compression_level=0),
    }[compression]()
    head = struct.pack("<QQQI", T0_NS, T0_NS + 10**10, len(records), 0)
    return record(CHUNK, head + text(compression) + struct.pack("<Q", len(packed)) + packed)


def log(*records: bytes) -> bytes:
    """A file of these records, without a summary."""
    return log_of(records)


def log_of(records: Iterable[bytes]) -> bytes:
    """A file of these records, without a summary."""
    header = record(HEADER, text("ros2") + text("made up"))
    end = record(DATA_END, bytes(4)) + record(FOOTER, bytes(20))
    return b"".join((MAGIC, header, *records, end, MAGIC))
