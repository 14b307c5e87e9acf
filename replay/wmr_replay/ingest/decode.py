"""Messages of one channel to columns: known layouts first, then new exemplars, one by one at worst."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest import fused
from wmr_replay.ingest.binary import BinarySource
from wmr_replay.ingest.bindings import Binding, NotConcerned, Recipe
from wmr_replay.ingest.encodings import Definition
from wmr_replay.ingest.layout import Layout, Source, Undecodable
from wmr_schemas.arrays import F64, I64, U8, Bool

_LAYOUTS_PER_KIND = 16
_KINDS = 1024


@dataclass(frozen=True, eq=False)
class Decoded:
    """Stamps (n,), 0 where absent, and values (k, n) of all messages; masks ``used``, ``undecodable``.

    A message that is neither does not concern the signal, such as a joint state without wheels.
    """

    stamp_ns: I64
    values: F64
    used: Bool
    undecodable: Bool


class Decoder:
    """Decodes one channel for one signal, and remembers the layouts that it met."""

    def __init__(self, definition: Definition, binding: Binding) -> None:
        self.definition, self.binding = definition, binding
        self.known: dict[int, list[tuple[Layout, Recipe | None]]] = {}
        self.program: fused.Program | None = None
        """That of the layout met last."""

    def decode(self, data: U8, starts: I64, lengths: I64) -> Decoded:
        """The messages that start at ``starts`` in ``data``."""
        return self.finish(self.begin(data, starts, lengths))

    def begin(self, data: U8, starts: I64, lengths: I64) -> "Columns":
        """The part that any thread may do: what has the layout met last is decoded, quickly."""
        source, program = self.definition.source(data, starts, lengths), self.program
        out = Columns(source, self.binding.n_raw, len(starts))
        if program is not None and isinstance(source, BinarySource):
            out.n_left -= fused.run(program, data, starts, lengths, out.stamp_ns, out.raw, out.used)
        if not out.n_left:
            out.values = self.binding.values(out.raw)
        return out

    def finish(self, out: "Columns") -> Decoded:
        """The rest, which may bring new layouts."""
        if out.n_left:
            self._decode_rest(out)
        values = self.binding.values(out.raw) if out.values is None else out.values
        return Decoded(out.stamp_ns, values, out.used, out.undecodable)

    def _decode_rest(self, out: "Columns") -> None:
        kinds, waiting = out.source.kinds, ~out.used
        for kind in distinct(kinds[waiting]):
            rows = np.flatnonzero(waiting & (kinds == kind))
            for layout, recipe in tuple(self.known.get(kind, ())):
                rows = out.fill(layout, recipe, rows) if len(rows) else rows
            while len(rows):
                rows = self._learn(out, kind, rows)

    def _learn(self, out: "Columns", kind: int, rows: I64) -> I64:
        """Take the first message as an exemplar; the rows that do not share its layout are left."""
        try:
            layout = self.definition.layout(out.source.exemplar(int(rows[0])))
            recipe = self._recipe(layout)
        except Undecodable:
            out.undecodable[rows[0]] = True
            return rows[1:]
        if len(self.known) >= _KINDS:
            self.known.clear()
        self.known[kind] = [(layout, recipe), *self.known.get(kind, ())][:_LAYOUTS_PER_KIND]
        if recipe is not None and isinstance(out.source, BinarySource):
            self.program = fused.compile_program(layout, recipe)
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
        self.undecodable = np.zeros(n, np.bool_)

    def fill(self, layout: Layout, recipe: Recipe | None, rows: I64) -> I64:
        """Fill in the rows of that layout; the others."""
        same = self.source.agree(layout, rows)
        mine = rows[same]
        if recipe is not None and len(mine):
            self._gather(recipe, mine)
            self.used[mine] = True
        return rows[~same]

    def _gather(self, recipe: Recipe, rows: I64) -> None:
        for leaf, factor in recipe.stamp:
            self.stamp_ns[rows] += self.source.ints(rows, leaf) * factor
        for k, column in enumerate(recipe.columns):
            total = np.full(len(rows), column.constant)
            for leaf, gain in column.terms:
                total += gain * self.source.floats(rows, leaf)
            self.raw[k, rows] = total


def distinct(values: I64) -> list[int]:
    """The different values; quick where there is only one, which is the rule."""
    if len(values) and (values == values[0]).all():
        return [int(values[0])]
    return np.unique(values).tolist()  # type: ignore[no-any-return]
