"""The messages of the channels in use, set apart by role: where they are in their blocks, and when."""

import numpy as np

from wmr_replay.ingest.mcap.message_counts import MessageCounts
from wmr_replay.ingest.mcap.stray_records import StrayRecords
from wmr_replay.ingest.mcap.walk import (
    LENGTH,
    LOG_NS,
    N_COLUMNS,
    OFFSET,
    ORDER,
    PUBLISH_NS,
    SEQUENCE,
    enlarged,
    walk_records,
)
from wmr_schemas.arrays import I64, U8

_N_OTHERS = 1 << 6
"""Initial room for the starts of records that are no messages."""


class MessageTable:
    """Messages of several blocks by role.

    ``table`` (roles, 7, room) grows when a role has more than ``n_expected`` messages; ``counts`` (roles,).
    ``strays`` are the records of the blocks that no chunk may hold.
    """

    def __init__(self, n_roles: int, n_expected: int) -> None:
        self.table = np.empty((n_roles, N_COLUMNS, max(n_expected, 1)), np.int64)
        self.counts = np.zeros(n_roles, np.int64)
        self.strays = StrayRecords()
        self._others = np.zeros(_N_OTHERS, np.int64)

    def add(self, data: U8, ids: I64, role_of: I64, limits_ns: I64, met: MessageCounts) -> tuple[int, int]:
        """Walk a block's records, and count all its messages in ``met``.

        ``ids`` (65536,) maps the file's channel ids to common ones, ``role_of`` (65536,) those to roles, −1
        for a channel that is not in use. Returns how many messages are within ``limits_ns`` (2,), and the
        offset at which the walk ended, which is short of the block's end where a record is not whole.
        """
        n_messages, position, full = 0, 0, True
        self._others[0] = 0
        while full:
            n, position, full = walk_records(
                data, position, False, ids, role_of, limits_ns, met.n, met.first_ns, met.last_ns, self.table,
                self.counts, self._others,
            )  # fmt: skip
            n_messages += n
            if full and self._others[0] + 1 == len(self._others):
                self._others = enlarged(self._others, 2 * len(self._others))
            elif full:
                self.table = enlarged(self.table, 2 * self.table.shape[2])
        if self._others[0]:
            self.strays.meet_in_chunk(data, self._others[1 : 1 + self._others[0]])
        return n_messages, position

    def places(self, role: int, start: int, stop: int) -> tuple[I64, I64]:
        """Offsets and lengths in bytes of the role's messages ``start`` to ``stop``, in their block."""
        return self.table[role, OFFSET, start:stop], self.table[role, LENGTH, start:stop]

    def order(self, role: int) -> I64:
        """Ordinals of the role's messages among those of all roles."""
        return self._column(role, ORDER)

    def publish_ns(self, role: int) -> I64:
        """Publish times of the role's messages."""
        return self._column(role, PUBLISH_NS)

    def log_ns(self, role: int) -> I64:
        """Log times of the role's messages."""
        return self._column(role, LOG_NS)

    def sequence(self, role: int) -> I64:
        """Sequence numbers of the role's messages."""
        return self._column(role, SEQUENCE)

    def _column(self, role: int, column: int) -> I64:
        """One column (n,) of a role's messages."""
        found: I64 = self.table[role, column, : self.counts[role]]
        return found
