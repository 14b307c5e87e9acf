"""One compiled pass over the records of a chunk: where its messages are, with no object for any."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.mcap.records import Opcode
from wmr_schemas.arrays import I64, U8
from wmr_schemas.compiled.lean import lean
from wmr_schemas.compiled.unaligned import load_i64, load_u16, load_u32

HEAD_BYTES = 9
MESSAGE_HEAD_BYTES = 22
_SCHEMA, MESSAGE = int(Opcode.SCHEMA), int(Opcode.MESSAGE)
_FIRST_PRIVATE = 0x80
_N_OTHERS = 64
"""Schemas and channels of a chunk that are found in the first pass."""


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
def next_record(data: U8, position: int) -> Any:
    """Opcode of the record at ``position``, where its content starts and stops; −1 if it is not whole.

    A message that is too short for its own head is told as a record of opcode 0.
    """
    body = position + HEAD_BYTES
    if body > len(data):
        return 0, body, -1
    length = load_i64(data, position + 1)
    if length < 0 or length > len(data) - body:
        return 0, body, -1
    opcode = np.int64(data[position])
    if opcode == MESSAGE and length < MESSAGE_HEAD_BYTES:
        opcode = np.int64(0)
    return opcode, body, body + length


@lean
def _fill(data: U8, plain: bool, table: Any, others: Any) -> tuple[int, int, int]:
    """Messages and other records found, and where the walk stopped; what has no room is only counted."""
    position, row, other = 0, 0, 0
    while position + HEAD_BYTES <= len(data):
        opcode = data[position]
        if plain and opcode < _FIRST_PRIVATE and (opcode < _SCHEMA or opcode > MESSAGE):
            break
        kind, body, stop = next_record(data, position)
        if stop < 0:
            break
        if kind == MESSAGE:
            if row < table.shape[1]:
                table[0, row] = load_u16(data, body)
                table[1, row] = body + MESSAGE_HEAD_BYTES
                table[2, row] = stop - body - MESSAGE_HEAD_BYTES
                table[3, row] = load_i64(data, body + 6)
                table[4, row] = load_i64(data, body + 14)
                table[5, row] = load_u32(data, body + 2)
            row += 1
        else:
            if other < len(others):
                others[other] = position
            other += 1
        position = stop
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
