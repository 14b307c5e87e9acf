"""Messages of one channel to columns: known layouts first, then new exemplars, one by one at worst."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wmr_replay.ingest.bindings import Binding, NotConcerned, Recipe
from wmr_replay.ingest.carried import carrier_of
from wmr_replay.ingest.encodings import Definition, Program
from wmr_replay.ingest.layout import Layout, Source, Undecodable
from wmr_schemas.arrays import F64, I64, U8, Bool

_LAYOUTS_PER_KIND = 16
_KINDS = 1024
_PROGRAMS = 4


@dataclass(frozen=True, eq=False)
class Decoded:
    """Stamps (n,), 0 where absent, and values (k, n) of all messages; masks ``used``, ``undecodable``.

    A message that is neither does not concern the signal, such as a joint state without wheels.
    """

    stamp_ns: I64
    values: F64
    used: Bool
    undecodable: Bool
    all_used: bool


class Decoder:
    """Decodes one channel for one signal, and remembers the layouts that it met."""

    def __init__(self, definition: Definition, binding: Binding) -> None:
        self.definition, self.binding = definition, binding
        self.carrier = carrier_of(binding)
        self.known: dict[int, list[tuple[Layout, Recipe | None]]] = {}
        self.programs: tuple[Program, ...] = ()
        """Those of the layouts met last."""

    def decode(self, data: U8, starts: I64, lengths: I64) -> Decoded:
        """The messages that start at ``starts`` in ``data``."""
        return self.finish(self.begin(data, starts, lengths))

    def begin(self, data: U8, starts: I64, lengths: I64) -> "Columns":
        """The part that any thread may do: what has a layout that was met is decoded."""
        out = Columns(self.definition.source(data, starts, lengths), self.binding.n_raw, len(starts))
        for program in self.programs:
            if out.n_left:
                out.n_left -= program.run(data, starts, lengths, out.stamp_ns, out.raw, out.used)
        if out.n_left:
            self._fill_known(out)
        if out.n_left:
            out.keep()
        elif self.carrier is None:
            out.values = self.binding.values(out.raw)
        return out

    def _fill_known(self, out: "Columns") -> None:
        """Fill in the messages of the layouts met so far."""
        for kind in distinct(out.source.kinds[out.waiting]):
            rows = np.flatnonzero(out.waiting & (out.source.kinds == kind))
            for layout, recipe in tuple(self.known.get(kind, ())):
                rows = out.fill(layout, recipe, rows) if len(rows) else rows

    def finish(self, out: "Columns") -> Decoded:
        """The rest, which may bring new layouts."""
        self.settle(out)
        if self.carrier is not None:
            out.raw, out.used = self.carrier.push(out.stamp_ns, out.raw, out.used)
        values = self.binding.values(out.raw) if out.values is None else out.values
        return Decoded(out.stamp_ns, values, out.used, out.undecodable, bool(out.used.all()))

    def settle(self, out: "Columns") -> Bool:
        """Decode what is left; which messages have stamp and raw columns."""
        if out.n_left:
            self._fill_known(out)
        if out.n_left:
            self._learn_rest(out)
        return out.used

    def _learn_rest(self, out: "Columns") -> None:
        for kind in distinct(out.source.kinds[out.waiting]):
            rows = np.flatnonzero(out.waiting & (out.source.kinds == kind))
            while len(rows):
                rows = self._learn(out, kind, rows)

    def _learn(self, out: "Columns", kind: int, rows: I64) -> I64:
        """Take the first message as an exemplar; the rows that do not share its layout are left."""
        try:
            layout = self.definition.layout(out.source.exemplar(int(rows[0])))
            recipe = self._recipe(layout)
        except Undecodable:
            out.undecodable[rows[0]] = True
            out.settle(rows[:1])
            return rows[1:]
        if len(self.known) >= _KINDS:
            self.known.clear()
        self.known[kind] = [(layout, recipe), *self.known.get(kind, ())][:_LAYOUTS_PER_KIND]
        if recipe is not None and (program := self.definition.program(layout, recipe)) is not None:
            self.programs = (program, *self.programs)[:_PROGRAMS]
        return out.fill(layout, recipe, rows)

    def _recipe(self, layout: Layout) -> Recipe | None:
        try:
            return self.binding.recipe(layout)
        except NotConcerned:
            return None


class Columns:
    """The columns of one block, filled layout by layout."""

    def __init__(self, source: Source, n_raw: int, n: int) -> None:
        self.source, self.n_left = source, n
        self.values: F64 | None = None
        self.stamp_ns = np.zeros(n, np.int64)
        self.raw = np.full((n_raw, n), np.nan)
        self.used = np.zeros(n, np.bool_)

    @cached_property
    def undecodable(self) -> Bool:
        """Messages that no layout describes."""
        return np.zeros(len(self.used), np.bool_)

    @cached_property
    def waiting(self) -> Bool:
        """Messages that are not settled yet."""
        return ~self.used

    def keep(self) -> None:
        """The source's bytes are kept for later."""
        self.source.data = self.source.data.copy()
        self.source.data.flags.writeable = False

    def settle(self, rows: I64) -> None:
        """These messages are done with."""
        self.waiting[rows] = False
        self.n_left -= len(rows)

    def fill(self, layout: Layout, recipe: Recipe | None, rows: I64) -> I64:
        """Fill in the rows of that layout; the others."""
        same = self.source.agree(layout, rows)
        mine = rows[same]
        if recipe is not None and len(mine):
            self._gather(recipe, mine)
            self.used[mine] = True
        self.settle(mine)
        return rows[~same]

    def _gather(self, recipe: Recipe, rows: I64) -> None:
        for leaf, factor in recipe.stamp:
            self.stamp_ns[rows] += self.source.ints(rows, leaf) * factor
        terms = [(k, gain, leaf) for k, column in enumerate(recipe.columns) for leaf, gain in column.terms]
        numbers = self.source.table(rows, [leaf for _, _, leaf in terms])
        totals = np.repeat([[column.constant] for column in recipe.columns], len(rows), axis=1)
        for (k, gain, _), column_numbers in zip(terms, numbers, strict=True):
            totals[k] += gain * column_numbers
        self.raw[:, rows] = totals


def distinct(values: I64) -> list[int]:
    """The different values; quick where there is only one, which is the rule."""
    if len(values) and (values == values[0]).all():
        return [int(values[0])]
    return np.unique(values).tolist()  # type: ignore[no-any-return]
