"""The records of a ROS 1 bag, format 2.0: a header of named fields, then data, each behind its length."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

from wmr_replay.ingest.mcap.records import Malformed

MOST_HEADER_BYTES = 1 << 20
"""No writer makes headers of this size; a length beyond it is damaged."""
_U32, _TIME = struct.Struct("<I"), struct.Struct("<II")
NS_PER_S = 1_000_000_000


class Op(IntEnum):
    """Types of records."""

    MESSAGE = 2
    BAG_HEADER = 3
    INDEX = 4
    CHUNK = 5
    CHUNK_INFO = 6
    CONNECTION = 7


@dataclass(frozen=True)
class Record:
    """A record: the fields of its header by name, and the bounds of its data in the buffer."""

    fields: dict[bytes, bytes]
    start: int
    stop: int

    @property
    def op(self) -> int:
        """The type; 0 where the field is missing."""
        return self.fields.get(b"op", b"\0")[0] if self.fields.get(b"op") else 0

    def u32(self, name: bytes) -> int:
        """A field of four bytes. Raises Malformed."""
        return self._number(name, 4)

    def u64(self, name: bytes) -> int:
        """A field of eight bytes. Raises Malformed."""
        return self._number(name, 8)

    def time_ns(self, name: bytes) -> int:
        """A time in ns. Raises Malformed."""
        seconds, nanoseconds = _TIME.unpack(self._number(name, 8).to_bytes(8, "little"))
        return int(seconds) * NS_PER_S + int(nanoseconds)

    def text(self, name: bytes) -> str:
        """A text; bytes that are not UTF-8 are replaced. Raises Malformed."""
        if name not in self.fields:
            raise Malformed(f"no field {name.decode()}")
        return self.fields[name].decode(errors="replace")

    def _number(self, name: bytes, n_bytes: int) -> int:
        """A little-endian field. Raises Malformed."""
        value = self.fields.get(name, b"")
        if len(value) != n_bytes:
            raise Malformed(f"field {name.decode()} has {len(value)} bytes instead of {n_bytes}")
        return int.from_bytes(value, "little")


def parse_fields(data: bytes) -> dict[bytes, bytes]:
    """The fields of a header. Raises Malformed."""
    found, position = {}, 0
    while position < len(data):
        size = u32_at(data, position)
        field = data[position + 4 : position + 4 + size]
        name, equals, value = field.partition(b"=")
        if len(field) < size or not equals:
            raise Malformed("a field of a header does not fit")
        found[name] = value
        position += 4 + size
    return found


def record_at(data: bytes | memoryview, position: int) -> Record:
    """The record at a place in a buffer; its data may reach beyond the buffer's end. Raises Malformed."""
    header_bytes = u32_at(data, position)
    start = position + 8 + header_bytes
    if header_bytes > MOST_HEADER_BYTES or start > len(data):
        raise Malformed(f"a header of {header_bytes} bytes")
    fields = parse_fields(bytes(data[position + 4 : position + 4 + header_bytes]))
    return Record(fields, start, start + u32_at(data, start - 4))


def records_in(data: bytes | memoryview, position: int = 0) -> Iterator[Record]:
    """The whole records of a buffer; ends in front of one that is cut or malformed."""
    while position < len(data):
        try:
            record = record_at(data, position)
        except Malformed:
            return
        if record.stop > len(data):
            return
        yield record
        position = record.stop


def u32_at(data: bytes | memoryview, position: int) -> int:
    """A number of four bytes. Raises Malformed."""
    if position + 4 > len(data):
        raise Malformed("the data end inside a length")
    return int(_U32.unpack_from(data, position)[0])
