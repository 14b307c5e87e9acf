"""Stamps and raw columns of one channel's messages, block after block, in memory laid out beforehand."""

from typing import TYPE_CHECKING

import numpy as np

from wmr_replay.ingest.decoding.encodings import Program
from wmr_replay.ingest.mcap.shares import longer
from wmr_schemas.arrays import F64, I64, U8, Bool

if TYPE_CHECKING:
    from wmr_replay.ingest.decoding.rest import Rest


class Columns:
    """``stamp_ns`` and ``used`` (room,), ``raw`` (n_raw, room), of which ``n`` rows are taken.

    Rows that are not ``used`` hold nothing before :meth:`blank`; of ``rests`` some wait for their layout.
    """

    def __init__(self, n_raw: int, n_expected: int) -> None:
        self.n = 0
        self.stamp_ns: I64 = np.empty(n_expected, np.int64)
        self.raw: F64 = np.empty((n_raw, n_expected))
        self.used: Bool = np.zeros(n_expected, np.bool_)
        self.rests: list[Rest] = []
        self.values: F64 | None = None

    def take(self, n: int) -> slice:
        """The next ``n`` rows."""
        rows = slice(self.n, self.n + n)
        self.n += n
        if self.n > len(self.used):
            self._resize(max(self.n, 2 * len(self.used)))
        return rows

    def _resize(self, room: int) -> None:
        n = min(len(self.used), room)
        self.stamp_ns, self.raw = longer(self.stamp_ns[:n], room), longer(self.raw[:, :n], room)
        self.used = longer(self.used[:n], room)
        self.used[n:] = False

    def run(self, program: Program, data: U8, starts: I64, lengths: I64, first: int) -> int:
        """Let a program fill in what it can, from row ``first`` on; how many messages it could."""
        return program.run(data, starts, lengths, first, self.stamp_ns, self.raw, self.used)

    def trim(self) -> None:
        """Give back the room that was not needed."""
        if self.n < len(self.used):
            self._resize(self.n)

    def blank(self) -> None:
        """What is not used has no stamp, 0, and no values, NaN."""
        self.stamp_ns[~self.used] = 0
        self.raw[:, ~self.used] = np.nan
