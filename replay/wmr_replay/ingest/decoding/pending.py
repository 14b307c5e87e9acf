"""Messages of a block that fit no compiled program: filled in layout by layout."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.column_builder import ColumnBuilder
from wmr_replay.ingest.decoding.encodings import Program
from wmr_replay.ingest.decoding.layout import Layout, Source
from wmr_schemas.arrays import F64, I64, Bool


class PendingMessages:
    """The messages of a block, which belong into ``rows`` of ``out``, until each of them is settled.

    A message is settled when its row is filled in, when it does not concern the signal, and when it is
    undecodable. Indices of messages count from the block's first one.
    """

    def __init__(self, source: Source, starts: I64, lengths: I64, out: ColumnBuilder, rows: slice) -> None:
        self.source, self.starts, self.lengths = source, starts, lengths
        self.out, self.rows = out, rows
        self.n_undecodable = 0

    @cached_property
    def waiting(self) -> Bool:
        """(n,) messages that are not settled yet."""
        return ~self.out.used[self.rows]

    def __bool__(self) -> bool:
        return bool(self.waiting.any())

    @property
    def first(self) -> int:
        """Index of the first message that waits."""
        return int(np.argmax(self.waiting))

    def by_kind(self) -> list[tuple[int, I64]]:
        """The messages that wait, kind by kind."""
        rows = np.flatnonzero(self.waiting)
        kinds = self.source.kinds(rows)
        if not len(kinds):
            return []
        if (kinds == kinds[0]).all():  # usually there is one kind
            return [(int(kinds[0]), rows)]
        rows = rows[np.argsort(kinds, kind="stable")]
        found, n_each = np.unique(kinds, return_counts=True)
        return list(zip(found.tolist(), np.split(rows, np.cumsum(n_each)[:-1]), strict=True))

    def keep_bytes(self) -> None:
        """Copy the bytes from the first message to the last; the block's memory serves another block."""
        start, stop = int(self.starts.min()), int((self.starts + self.lengths).max())
        self.starts = self.starts - start
        self.source.move(self.source.data[start:stop].copy(), self.starts)

    def run(self, programs: Sequence[Program]) -> int:
        """Fill in what these programs fit; return how many messages they did."""
        n_filled = 0
        for program in programs:
            n = self.out.run(program, self.source.data, self.starts, self.lengths, self.rows.start)
            if n:
                self.waiting &= ~self.out.used[self.rows]
            n_filled += n
        return n_filled

    def settle(self, rows: I64) -> None:
        """Mark these messages as settled, whether their rows are filled in or not."""
        self.waiting[rows] = False

    def fill(self, layout: Layout, recipe: Recipe | None, rows: I64) -> tuple[I64, I64]:
        """Fill in those of ``rows`` that have the layout; return them, and the others.

        Without a recipe they are settled and not filled in.
        """
        same = self.source.agree(layout, rows)
        mine = rows[same]
        if recipe is not None and len(mine):
            self._gather(recipe, mine)
            self.out.used[self.rows][mine] = True
        self.settle(mine)
        return mine, rows[~same]

    def _gather(self, recipe: Recipe, rows: I64) -> None:
        """Stamps and raw columns of these messages, field by field."""
        stamp_ns: I64 = np.zeros(len(rows), np.int64)
        for leaf, factor in recipe.stamp:
            stamp_ns += self.source.ints(rows, leaf) * factor
        terms = [(k, gain, leaf) for k, column in enumerate(recipe.columns) for leaf, gain in column.terms]
        numbers = self.source.table(rows, [leaf for _, _, leaf in terms])
        totals: F64 = np.repeat([[column.constant] for column in recipe.columns], len(rows), axis=1)
        for (k, gain, _), column_numbers in zip(terms, numbers, strict=True):
            totals[k] += gain * column_numbers
        self.out.stamp_ns[self.rows][rows] = stamp_ns
        self.out.raw[:, self.rows][:, rows] = totals
