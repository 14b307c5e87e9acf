"""One compiled pass over the records of a chunk: where its messages are, without an object for each."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.mcap.records import Opcode
from wmr_schemas.arrays import I64, U8
from wmr_schemas.compiled.lean import lean
from wmr_schemas.compiled.unaligned import load_i64, load_u16, load_u32

HEAD_BYTES = 9
MESSAGE_HEAD_BYTES = 22
N_CHANNEL_IDS = 1 << 16
ORDER, CHANNEL, OFFSET, LENGTH, LOG_NS, PUBLISH_NS, SEQUENCE = range(7)
"""Columns of a table of messages: ordinal, channel id, bounds of the data in bytes, times, number."""
N_COLUMNS = 7
NO_LIMITS: I64 = np.array([np.iinfo(np.int64).min, np.iinfo(np.int64).max])
_SCHEMA, _MESSAGE = int(Opcode.SCHEMA), int(Opcode.MESSAGE)
_FIRST_PRIVATE = 0x80
_N_MESSAGES, _N_OTHERS = 1 << 10, 1 << 6
"""Initial room for the messages and the other records of a buffer."""
_N_AT_ONCE = 1 << 16
_NOT_COUNTED: I64 = np.empty(0, np.int64)
_SAME_IDS: I64 = np.arange(N_CHANNEL_IDS)
_ONE_ROLE: I64 = np.zeros(N_CHANNEL_IDS, np.int64)


@dataclass(frozen=True, eq=False)
class Messages:
    """Messages of one buffer in file order, int64 (n,); ``offset`` and ``length`` bound their bytes."""

    channel: I64
    offset: I64
    length: I64
    log_ns: I64
    publish_ns: I64

    def __len__(self) -> int:
        return len(self.channel)

    def counts(self) -> dict[int, int]:
        """Number of messages by channel id."""
        counts = np.bincount(self.channel)
        return {channel_id: int(counts[channel_id]) for channel_id in np.flatnonzero(counts).tolist()}


@dataclass(frozen=True, eq=False)
class Walk:
    """Messages, the offsets of schemas, channels and malformed messages, and where the walk ended."""

    messages: Messages
    others: I64
    stop: int


def walk_pieces(data: U8) -> Iterator[Walk]:
    """Walk the records in ``data`` (bytes as a uint8 array), some 65,536 messages at a time."""
    position, full = 0, True
    table, others = np.empty((1, N_COLUMNS, _N_AT_ONCE), np.int64), np.zeros(_N_AT_ONCE, np.int64)
    while full:
        counts = np.zeros(1, np.int64)
        others[0] = 0
        _, position, full = walk_records(
            data, position, False, _SAME_IDS, _ONE_ROLE, NO_LIMITS, _NOT_COUNTED, _NOT_COUNTED, _NOT_COUNTED,
            table, counts, others,
        )  # fmt: skip
        found = table[0, :, : counts[0]]
        messages = Messages(*found[[CHANNEL, OFFSET, LENGTH, LOG_NS, PUBLISH_NS]])
        yield Walk(messages, others[1 : 1 + others[0]].copy(), position)


def walk(data: U8, *, plain: bool = False) -> Walk:
    """Walk the records in ``data`` (bytes as a uint8 array).

    ``plain``: the bytes come from outside a chunk, so stop in front of records that are no schema, channel
    or message. A record that does not fit in ``data`` ends the walk; ``stop`` is where it starts, or the
    end of the data.
    """
    table, others = np.empty((1, N_COLUMNS, _N_MESSAGES), np.int64), np.zeros(_N_OTHERS, np.int64)
    counts, position, full = np.zeros(1, np.int64), 0, True
    while full:
        _, position, full = walk_records(
            data, position, plain, _SAME_IDS, _ONE_ROLE, NO_LIMITS, _NOT_COUNTED, _NOT_COUNTED, _NOT_COUNTED,
            table, counts, others,
        )  # fmt: skip
        if full:
            table, others = enlarged(table, 2 * table.shape[2]), enlarged(others, 2 * len(others))
    found = table[0, :, : counts[0]]
    messages = Messages(*found[[CHANNEL, OFFSET, LENGTH, LOG_NS, PUBLISH_NS]])
    return Walk(messages, others[1 : 1 + others[0]], position)


def enlarged(array: Any, n: int) -> Any:
    """A copy with room for ``n`` along its last axis."""
    out = np.empty((*array.shape[:-1], n), array.dtype)
    out[..., : array.shape[-1]] = array
    return out


@lean
def walk_records(  # noqa: C901, PLR0913, PLR0917 – compiled code takes its arrays one by one
    data: U8, position: int, plain: bool, ids: I64, role_of: I64, limits_ns: I64, n: I64, first_ns: I64,
    last_ns: I64, table: Any, counts: I64, others: I64,
) -> tuple[int, int, bool]:  # fmt: skip
    """Walk from ``position`` on: number of messages within the limits, where the walk ended, whether it ended
    for want of room.

    Messages within ``limits_ns`` (2,) go into the rows of ``table`` (roles, 7, room) behind the ``counts``
    (roles,) that are there, by ``role_of`` (65536,) their channel; −1: none. ``ids`` (65536,) are the
    channels' common ids. ``n``, ``first_ns`` and ``last_ns`` (65536,) count messages by common id, unless
    they are empty. ``others``, unless empty: the number of records of schemas and channels, then where they
    start. A message that is too short for its own head counts among them.
    """
    n_messages, n_used = 0, 0
    for role in range(len(counts)):
        n_used += counts[role]
    while position + HEAD_BYTES <= len(data):
        body, opcode, length = position + HEAD_BYTES, data[position], load_i64(data, position + 1)
        outside = opcode < _FIRST_PRIVATE and (opcode < _SCHEMA or opcode > _MESSAGE)
        if length < 0 or length > len(data) - body or (plain and outside):
            break
        if opcode != _MESSAGE or length < MESSAGE_HEAD_BYTES:
            if len(others) > 0 and opcode != 0:  # zeros are padding, and a chunk may hold millions
                if others[0] + 1 == len(others):
                    return n_messages, position, True
                others[0] += 1
                others[others[0]] = position
            position = body + length
            continue
        log_ns = load_i64(data, body + 6)
        if limits_ns[0] <= log_ns <= limits_ns[1]:
            channel = ids[load_u16(data, body)]
            role = role_of[channel]
            if role >= 0:
                row = counts[role]
                if row == table.shape[2]:
                    return n_messages, position, True
                table[role, ORDER, row] = n_used
                table[role, CHANNEL, row] = channel
                table[role, OFFSET, row] = body + MESSAGE_HEAD_BYTES
                table[role, LENGTH, row] = length - MESSAGE_HEAD_BYTES
                table[role, LOG_NS, row] = log_ns
                table[role, PUBLISH_NS, row] = load_i64(data, body + 14)
                table[role, SEQUENCE, row] = load_u32(data, body + 2)
                counts[role] = row + 1
                n_used += 1
            n_messages += 1
            if len(n) > 0:
                n[channel] += 1
                first_ns[channel] = min(first_ns[channel], log_ns)
                last_ns[channel] = max(last_ns[channel], log_ns)
        position = body + length
    return n_messages, position, False
