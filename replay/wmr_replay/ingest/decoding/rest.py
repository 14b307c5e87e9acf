"""Messages of a block that no program at hand could read: layout by layout, one by one at worst."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.encodings import Program
from wmr_replay.ingest.decoding.filling import Columns
from wmr_replay.ingest.decoding.layout import Layout, Source
from wmr_schemas.arrays import F64, I64, Bool


class Rest:
    """A block's messages, those of ``rows`` in ``out``, as long as some of them wait."""

    def __init__(self, source: Source, starts: I64, lengths: I64, out: Columns, rows: slice) -> None:
        self.source, self.starts, self.lengths = source, starts, lengths
        self.out, self.rows = out, rows
        self.n_undecodable = 0

    @cached_property
    def waiting(self) -> Bool:
        """Messages that are not settled yet."""
        return ~self.out.used[self.rows]

    def __bool__(self) -> bool:
        return bool(self.waiting.any())

    def keep(self) -> None:
        """The source's bytes are kept for later."""
        self.source.data = self.source.data.copy()
        self.source.data.flags.writeable = False

    def run(self, programs: Sequence[Program]) -> None:
        """Try the quick ways."""
        for program in programs:
            if self.out.run(program, self.source.data, self.starts, self.lengths, self.rows.start):
                self.waiting &= ~self.out.used[self.rows]

    def settle(self, rows: I64) -> None:
        """These messages are done with."""
        self.waiting[rows] = False

    def fill(self, layout: Layout, recipe: Recipe | None, rows: I64) -> I64:
        """Fill in the rows of that layout; the others."""
        same = self.source.agree(layout, rows)
        mine = rows[same]
        if recipe is not None and len(mine):
            self._gather(recipe, mine)
            self.out.used[self.rows][mine] = True
        self.settle(mine)
        return rows[~same]

    def _gather(self, recipe: Recipe, rows: I64) -> None:
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
