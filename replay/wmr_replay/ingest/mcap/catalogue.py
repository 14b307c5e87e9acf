"""The schemas and channels of a file, by id."""

from dataclasses import dataclass, field
from typing import TypeVar

from wmr_replay.ingest.mcap.records import (
    HEAD,
    Channel,
    Malformed,
    Opcode,
    Schema,
    parse_channel,
    parse_schema,
)
from wmr_schemas.arrays import I64, U8

Entry = TypeVar("Entry", Schema, Channel)


@dataclass
class Catalogue:
    """Schemas and channels by id, wherever in the file they stand.

    The first description of an id holds; one from the summary, which no chunk's checksum covers, gives way to
    one from the data.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    from_data: set[tuple[type, int]] = field(default_factory=set)
    n_malformed: int = 0

    def enter(self, data: U8, starts: I64, *, summary: bool = False) -> None:
        """Add the schema and channel records that start at ``starts``."""
        for start in starts.tolist():
            opcode, length = HEAD.unpack(data[start : start + HEAD.size].tobytes())
            content = data[start + HEAD.size : start + HEAD.size + length].tobytes()
            try:
                self._enter(opcode, content, summary)
            except Malformed:
                self.n_malformed += 1

    def _enter(self, opcode: int, content: bytes, summary: bool) -> None:
        """Add one schema or channel record. Raises Malformed."""
        if opcode == Opcode.SCHEMA:
            self._put(self.schemas, parse_schema(content), summary)
        elif opcode == Opcode.CHANNEL:
            self._put(self.channels, parse_channel(content), summary)
        elif opcode == Opcode.MESSAGE:
            raise Malformed("message too short")

    def _put(self, shelf: dict[int, Entry], entry: Entry, summary: bool) -> None:
        """Add a description unless a better one of the same id is there."""
        key = type(entry), entry.id
        if key in self.from_data or (summary and entry.id in shelf):
            return
        shelf[entry.id] = entry
        if not summary:
            self.from_data.add(key)
