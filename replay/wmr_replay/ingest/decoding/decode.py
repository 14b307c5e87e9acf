"""Messages of one channel to columns: known layouts first, then new exemplars, one by one at worst."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest.channels.carried import carrier_of
from wmr_replay.ingest.decoding.bindings import Binding, NotConcerned, Recipe
from wmr_replay.ingest.decoding.encodings import Definition, Program
from wmr_replay.ingest.decoding.filling import Columns
from wmr_replay.ingest.decoding.layout import Layout, Undecodable
from wmr_replay.ingest.decoding.rest import Rest
from wmr_schemas.arrays import F64, I64, U8, Bool

_LAYOUTS_PER_KIND = 16
_KINDS = 1024
_PROGRAMS = 4


@dataclass(frozen=True, eq=False)
class Decoded:
    """Stamps (n,), 0 where absent, and values (k, n) of all messages, and which of them are ``used``.

    A message that is neither used nor undecodable does not concern the signal, such as a joint state without
    wheels.
    """

    stamp_ns: I64
    values: F64
    used: Bool
    all_used: bool = True
    n_undecodable: int = 0


class Decoder:
    """Decodes one channel for one signal, and remembers the layouts that it met."""

    def __init__(self, definition: Definition, binding: Binding) -> None:
        self.definition, self.binding = definition, binding
        self.carrier = carrier_of(binding)
        self.known: dict[int, list[tuple[Layout, Recipe | None]]] = {}
        self.programs: tuple[Program, ...] = ()
        """Those of the layouts met last."""

    def begin(self, n_expected: int) -> Columns:
        """Columns for about so many messages."""
        return Columns(self.binding.n_raw, n_expected)

    def read(self, out: Columns, data: U8, starts: I64, lengths: I64) -> None:
        """Decode a block's messages as far as their layouts are known; any thread may do it."""
        rows, n_left = out.take(len(starts)), len(starts)
        for program in self.programs:
            if n_left:
                n_left -= out.run(program, data, starts, lengths, rows.start)
        if n_left:
            rest = Rest(self.definition.source(data, starts, lengths), starts, lengths, out, rows)
            self._fill_known(rest)
            if rest:
                rest.keep()
            out.rests.append(rest)

    def close(self, out: Columns) -> None:
        """No more messages: if none of them waits, the signal's columns are made; any thread may do it."""
        out.trim()
        if not out.rests and self.carrier is None:
            out.values = self.binding.values(out.raw)

    def _fill_known(self, rest: Rest) -> None:
        """Fill in the messages of the layouts met so far."""
        for kind in distinct(rest.source.kinds[rest.waiting]):
            rows = np.flatnonzero(rest.waiting & (rest.source.kinds == kind))
            for layout, recipe in tuple(self.known.get(kind, ())):
                rows = rest.fill(layout, recipe, rows) if len(rows) else rows

    def finish(self, out: Columns) -> Decoded:
        """The rest, which may bring new layouts."""
        if out.values is not None:
            return Decoded(out.stamp_ns, out.values, out.used)
        n_undecodable = self.settle(out)
        raw, used = out.raw, out.used
        if self.carrier is not None:
            raw, used = self.carrier.push(out.stamp_ns, raw, used)
        return Decoded(out.stamp_ns, self.binding.values(raw), used, bool(used.all()), n_undecodable)

    def settle(self, out: Columns) -> int:
        """Decode what is left; how many messages are undecodable."""
        for rest in filter(None, out.rests):  # the bytes of the others are gone
            rest.run(self.programs)
            self._fill_known(rest)
            self._learn_rest(rest)
        out.blank()
        return sum(rest.n_undecodable for rest in out.rests)

    def _learn_rest(self, rest: Rest) -> None:
        for kind in distinct(rest.source.kinds[rest.waiting]):
            rows = np.flatnonzero(rest.waiting & (rest.source.kinds == kind))
            while len(rows):
                self._learn(rest, kind, rows)
                rows = rows[rest.waiting[rows]]

    def _learn(self, rest: Rest, kind: int, rows: I64) -> None:
        """Take the first message as an exemplar and settle all that share its layout."""
        try:
            layout = self.definition.layout(rest.source.exemplar(int(rows[0])))
            recipe = self._recipe(layout)
        except Undecodable:
            rest.n_undecodable += 1
            rest.settle(rows[:1])
            return
        if len(self.known) >= _KINDS:
            self.known.clear()
        self.known[kind] = [(layout, recipe), *self.known.get(kind, ())][:_LAYOUTS_PER_KIND]
        if recipe is not None and (program := self.definition.program(layout, recipe)) is not None:
            self.programs = (program, *self.programs)[:_PROGRAMS]
            rest.run([program])
            rows = rows[rest.waiting[rows]]
        if len(rows):
            rest.fill(layout, recipe, rows)

    def _recipe(self, layout: Layout) -> Recipe | None:
        try:
            return self.binding.recipe(layout)
        except NotConcerned:
            return None


def distinct(values: I64) -> list[int]:
    """The different values; quick where there is only one, which is the rule."""
    if len(values) and (values == values[0]).all():
        return [int(values[0])]
    return np.unique(values).tolist()  # type: ignore[no-any-return]
