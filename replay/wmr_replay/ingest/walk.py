"""One compiled pass over the records of a chunk: where its messages are, with no object for any."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from wmr_replay.ingest.lean import lean
from wmr_replay.ingest.records import Opcode
from wmr_schemas.arrays import I64, U8, Bool

HEAD_BYTES = 9
MESSAGE_HEAD_BYTES = 22
_SCHEMA, _CHANNEL, _MESSAGE = int(Opcode.SCHEMA), int(Opcode.CHANNEL), int(Opcode.MESSAGE)
_FIRST_PRIVATE = 0x80
_N_OTHERS = 64
"""Schemas and channels of a chunk that are found in the first pass."""
CHANNEL, OFFSET, LENGTH, LOG_NS, PUBLISH_NS, SEQUENCE = range(6)


@dataclass(frozen=True, eq=False)
class Messages:
    """Messages of one buffer in file order, int64 (n,): ``offset`` and ``length`` bound their data."""

    channel: I64
    offset: I64
    length: I64
    log_ns: I64
    publish_ns: I64
    sequence: I64

    def __len__(self) -> int:
        return len(self.channel)

    def take(self, index: Bool) -> "Messages":
        """Some of them."""
        return Messages(*(getattr(self, field.name)[index] for field in fields(self)))

    def counts(self) -> dict[int, int]:
        """How many of each channel."""
        counts = np.bincount(self.channel)
        return {channel_id: int(counts[channel_id]) for channel_id in np.flatnonzero(counts).tolist()}


@dataclass(frozen=True, eq=False)
class Walk:
    """What a walk found: messages, starts of other records, and where it stopped for want of a whole one."""

    messages: Messages
    others: I64
    stop: int


@lean
def _uint(data: Any, start: int, n_bytes: int) -> Any:
    value = np.int64(0)
    for k in range(n_bytes):
        value |= np.int64(data[start + k]) << (8 * k)
    return value


@lean
def _fill(data: U8, plain: bool, table: Any, others: Any) -> tuple[int, int, int]:
    """Messages and other records found, and where the walk stopped; what has no room is only counted."""
    position, row, other = 0, 0, 0
    while position + HEAD_BYTES <= len(data):
        opcode = data[position]
        if plain and opcode < _FIRST_PRIVATE and (opcode < _SCHEMA or opcode > _MESSAGE):
            break
        length = _uint(data, position + 1, 8)
        body = position + HEAD_BYTES
        if length < 0 or length > len(data) - body:
            break
        if opcode == _MESSAGE and length >= MESSAGE_HEAD_BYTES:
            if row < table.shape[1]:
                table[0, row] = _uint(data, body, 2)
                table[1, row] = body + MESSAGE_HEAD_BYTES
                table[2, row] = length - MESSAGE_HEAD_BYTES
                table[3, row] = _uint(data, body + 6, 8)
                table[4, row] = _uint(data, body + 14, 8)
                table[5, row] = _uint(data, body + 2, 4)
            row += 1
        else:
            if other < len(others):
                others[other] = position
            other += 1
        position = body + length
    return row, other, position


def walk(data: U8, *, plain: bool = False, n_expected: int = 0) -> Walk:
    """Walk the records in ``data`` (bytes as a uint8 array).

    ``plain``: the bytes come from outside a chunk, so stop in front of records that are no schema, channel
    or message. A record that does not fit in ``data`` ends the walk; ``stop`` is where it starts, or the
    end of the data. One pass suffices when there are no more than ``n_expected`` messages.
    """
    table, others = np.empty((6, n_expected), np.int64), np.empty(_N_OTHERS, np.int64)
    n_messages, n_others, stop = _fill(data, plain, table, others)
    if n_messages > table.shape[1] or n_others > len(others):
        table, others = np.empty((6, n_messages), np.int64), np.empty(n_others, np.int64)
        _fill(data, plain, table, others)
    return Walk(Messages(*table[:, :n_messages]), others[:n_others], stop)
