"""The messages of each channel in use: found, counted and set apart in one compiled pass over the records."""

from typing import Any

import numpy as np

from wmr_replay.ingest.mcap.message_counts import MessageCounts
from wmr_replay.ingest.mcap.walk import MESSAGE, MESSAGE_HEAD_BYTES, next_record
from wmr_schemas.arrays import I64, U8
from wmr_schemas.compiled.lean import lean
from wmr_schemas.compiled.unaligned import load_i64, load_u16

_ORDER, _OFFSET, _LENGTH, _PUBLISH_NS, _LOG_NS = range(5)
NO_LIMITS: I64 = np.array([np.iinfo(np.int64).min, np.iinfo(np.int64).max])


class MessageTable:
    """Messages of several blocks by role. The table grows when there are more than ``n_expected`` of one."""

    def __init__(self, n_roles: int, n_expected: int) -> None:
        self.table = np.empty((n_roles, 5, max(n_expected, 1)), np.int64)
        self.counts = np.zeros(n_roles, np.int64)

    def add(self, data: U8, ids: I64, role_of: I64, limits_ns: I64, met: MessageCounts) -> tuple[int, int]:
        """Walk a block's records: how many messages are within the limits, and where the walk stopped for
        want of a whole record. ``ids`` are the channels' common ids, ``role_of`` is −1 for those that nobody
        wants.
        """
        n_messages, position, full = 0, 0, True
        while full:
            n, position, full = _split(
                data, position, ids, role_of, limits_ns, met.n, met.first_ns, met.last_ns, self.table,
                self.counts,
            )  # fmt: skip
            n_messages += n
            if full:
                self.table = enlarged(self.table, 2 * self.table.shape[2])
        return n_messages, position

    def places(self, role: int, start: int, stop: int) -> tuple[I64, I64]:
        """Where the role's messages of some rows start in their block, and how long they are."""
        return self.table[role, _OFFSET, start:stop], self.table[role, _LENGTH, start:stop]

    def order(self, role: int) -> I64:
        """Ordinals of the role's messages among those of all roles."""
        return self._column(role, _ORDER)

    def publish_ns(self, role: int) -> I64:
        """When they were published."""
        return self._column(role, _PUBLISH_NS)

    def log_ns(self, role: int) -> I64:
        """When they were recorded."""
        return self._column(role, _LOG_NS)

    def _column(self, role: int, column: int) -> I64:
        found: I64 = self.table[role, column, : self.counts[role]]
        return found


def enlarged(array: Any, n: int) -> Any:
    """A copy with room for ``n`` along its last axis."""
    out = np.empty((*array.shape[:-1], n), array.dtype)
    out[..., : array.shape[-1]] = array
    return out


@lean
def _split(  # noqa: PLR0913, PLR0917 – compiled code takes its arrays one by one
    data: U8, position: int, ids: I64, role_of: I64, limits_ns: I64, n: I64, first_ns: I64, last_ns: I64,
    table: Any, counts: I64,
) -> tuple[int, int, bool]:  # fmt: skip
    """Messages within the limits, where the walk ended, and whether for want of room in the table."""
    n_messages, n_used = 0, 0
    for role in range(len(counts)):
        n_used += counts[role]
    while True:
        opcode, body, stop = next_record(data, position)
        if stop < 0:
            return n_messages, position, False
        log_ns = load_i64(data, body + 6) if opcode == MESSAGE else 0
        if opcode == MESSAGE and limits_ns[0] <= log_ns <= limits_ns[1]:
            channel = ids[load_u16(data, body)]
            role = role_of[channel]
            if role >= 0:
                row = counts[role]
                if row == table.shape[2]:
                    return n_messages, position, True
                table[role, _ORDER, row] = n_used
                table[role, _OFFSET, row] = body + MESSAGE_HEAD_BYTES
                table[role, _LENGTH, row] = stop - body - MESSAGE_HEAD_BYTES
                table[role, _PUBLISH_NS, row] = load_i64(data, body + 14)
                table[role, _LOG_NS, row] = log_ns
                counts[role] = row + 1
                n_used += 1
            n_messages += 1
            n[channel] += 1
            first_ns[channel] = min(first_ns[channel], log_ns)
            last_ns[channel] = max(last_ns[channel], log_ns)
        position = stop
