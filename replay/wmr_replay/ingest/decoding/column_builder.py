"""Stamps and raw columns of one channel's messages, block after block, in memory laid out beforehand."""

from typing import TYPE_CHECKING

import numpy as np

from wmr_replay.ingest.decoding.encodings import Program
from wmr_replay.ingest.mcap.walk import enlarged
from wmr_schemas.arrays import F64, I64, U8, Bool

if TYPE_CHECKING:
    from wmr_replay.ingest.decoding.pending import PendingMessages


class ColumnBuilder:
    """``stamp_ns`` and ``used`` (room,), ``raw`` (n_raw, room), of which ``n`` rows are taken.

    A row that is not ``used`` is undefined before :meth:`blank`. ``pending`` are the messages that wait for
    their layout; ``values`` (k, n) is None until nothing waits.
    """

    def __init__(self, n_raw: int, n_expected: int) -> None:
        self.n = 0
        self.stamp_ns: I64 = np.empty(n_expected, np.int64)
        self.raw: F64 = np.empty((n_raw, n_expected))
        self.used: Bool = np.zeros(n_expected, np.bool_)
        self.pending: list[PendingMessages] = []
        self.values: F64 | None = None

    def take(self, n: int) -> slice:
        """Take the next ``n`` rows; the columns grow where they have no room."""
        rows = slice(self.n, self.n + n)
        self.n += n
        if self.n > len(self.used):
            self._resize(max(self.n, 2 * len(self.used)))
        return rows

    def _resize(self, room: int) -> None:
        """Columns with that room, which keep what is in them."""
        n = min(len(self.used), room)
        self.stamp_ns, self.raw = enlarged(self.stamp_ns[:n], room), enlarged(self.raw[:, :n], room)
        self.used = enlarged(self.used[:n], room)
        self.used[n:] = False

    def run(self, program: Program, data: U8, starts: I64, lengths: I64, first: int) -> int:
        """Fill in the messages that a program fits, from row ``first`` on; return how many they are."""
        return program.run(data, starts, lengths, first, self.stamp_ns, self.raw, self.used)

    def trim(self) -> None:
        """Give back the memory of the rows that were not taken."""
        if self.n < len(self.used):
            self._resize(self.n)

    def blank(self) -> None:
        """Give rows that are not used the stamp 0 and the values NaN."""
        self.stamp_ns[~self.used] = 0
        self.raw[:, ~self.used] = np.nan
