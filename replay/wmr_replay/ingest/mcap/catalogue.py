"""The schemas and channels of a file, by id."""

from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from wmr_replay.ingest.budgets import BUDGETS
from wmr_replay.ingest.mcap.records import (
    HEAD,
    Channel,
    Malformed,
    Opcode,
    Schema,
    parse_channel,
    parse_schema,
)
from wmr_schemas.arrays import I64, U8, Bool

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
    n_left: int = BUDGETS.most_descriptions
    """Records that may still be parsed."""
    n_refused: int = 0
    """Records beyond that."""
    n_schema_bytes: int = 0
    """Bytes of the definitions that are kept."""
    n_sample_bytes: int = 0
    """Bytes of the messages that are kept as samples."""
    _known: Bool = field(default_factory=lambda: np.zeros((2, 1 << 16), np.bool_))
    """Which ids of schemas and of channels the data have described."""

    def enter(self, data: U8, starts: I64, *, summary: bool = False) -> None:
        """Add the schema and channel records that start at ``starts``; those of ids that the data described
        before are passed over.
        """
        new = starts[self._is_new(data, starts)].tolist()
        for start in new[: self.n_left]:
            opcode, length = HEAD.unpack(data[start : start + HEAD.size].tobytes())
            content = data[start + HEAD.size : start + HEAD.size + length].tobytes()
            try:
                self._enter(opcode, content, summary)
            except Malformed:
                self.n_malformed += 1
        self.n_refused += max(len(new) - self.n_left, 0)
        self.n_left = max(self.n_left - len(new), 0)

    def _is_new(self, data: U8, starts: I64) -> Bool:
        """Mask of the records whose id the data did not describe before."""
        places = np.minimum(starts[:, None] + [0, HEAD.size, HEAD.size + 1], len(data) - 1)
        opcode, low, high = data[places].T.astype(np.int64)
        is_schema, is_channel = opcode == Opcode.SCHEMA, opcode == Opcode.CHANNEL
        ids = low + 256 * high
        known = is_schema & self._known[0, ids] | is_channel & self._known[1, ids]
        return np.asarray(~known)

    def _enter(self, opcode: int, content: bytes, summary: bool) -> None:
        """Add one schema or channel record. Raises Malformed."""
        if opcode == Opcode.SCHEMA:
            self._put(self.schemas, parse_schema(content), summary)
        elif opcode == Opcode.CHANNEL:
            self._put(self.channels, parse_channel(content), summary)
        elif opcode == Opcode.MESSAGE:
            raise Malformed("message too short")

    def may_keep(self, n_bytes: int) -> bool:
        """Whether a message of that size may be kept as a sample of its channel; it is accounted for."""
        if n_bytes > min(BUDGETS.most_sample_bytes, BUDGETS.most_samples_bytes - self.n_sample_bytes):
            return False
        self.n_sample_bytes += n_bytes
        return True

    def _has_room(self, shelf: dict[int, Entry], entry: Entry) -> bool:
        """Whether one more description may be kept."""
        if isinstance(entry, Schema):
            self.n_schema_bytes += len(entry.data)
            return self.n_schema_bytes <= BUDGETS.most_schema_bytes
        return entry.id in shelf or len(shelf) < BUDGETS.most_channels

    def _put(self, shelf: dict[int, Entry], entry: Entry, summary: bool) -> None:
        """Add a description unless a better one of the same id is there."""
        key = type(entry), entry.id
        if key in self.from_data or (summary and entry.id in shelf):
            return
        if not self._has_room(shelf, entry):
            self.n_refused += 1
            return
        shelf[entry.id] = entry
        if not summary:
            self.from_data.add(key)
            self._known[int(isinstance(entry, Channel)), entry.id] = True
