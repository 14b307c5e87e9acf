"""Messages of one channel to columns: compiled programs first, then known layouts, then new ones.

A block's messages take the quickest way that fits them: a compiled program of a layout met before; a known
layout, whose fields are gathered column by column; a new layout, learnt from one message, the exemplar.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from wmr_replay.ingest.decoding.bindings import Binding, NotConcerned, Recipe
from wmr_replay.ingest.decoding.column_builder import ColumnBuilder
from wmr_replay.ingest.decoding.encodings import Definition, Program, accounted
from wmr_replay.ingest.decoding.layout import Layout, RowComposer, Undecodable
from wmr_replay.ingest.decoding.pending import PendingMessages
from wmr_schemas.arrays import F64, I64, U8, Bool

_LAYOUTS_PER_KIND = 16
_KINDS = 1024
_KINDS_AT_ONCE = 64
"""So many kinds are filled in by the thread that reads ahead; more are rare, and wait."""
_KNOWN_FIELDS = 1 << 19
"""Fields and places of the layouts that are kept. Memory: some hundred bytes each."""
_PROGRAMS = 4
_WORTH_A_RUN = 64
"""Messages of one kind, before a program is run over all that wait."""
_PART_MESSAGES, _PART_BYTES = 1 << 14, 4 << 20
"""Messages that are held together while they wait for their layout."""
_WORTH_A_PROGRAM = 256
"""Messages of one block that depart from all programs in their spelling alone, before one more is made."""


@dataclass(frozen=True, eq=False)
class Decoded:
    """Stamps (n,) in ns, 0 where absent, values (k, n) of all messages, the raw columns (n_raw, n) that they
    were made of, and which of the messages are ``used``.

    A message that is neither used nor undecodable does not concern the signal, such as a joint state without
    wheels.
    """

    stamp_ns: I64
    values: F64
    raw: F64
    used: Bool
    all_used: bool = True
    n_undecodable: int = 0


class Decoder:
    """Decodes one channel for one signal, and keeps the layouts that it has met.

    :meth:`begin`, :meth:`read` for each block and :meth:`close` may run in any thread; :meth:`finish` is
    called for one group after another in the order of the file.
    """

    def __init__(self, definition: Definition, binding: Binding, composer: RowComposer | None = None) -> None:
        self.definition, self.binding, self.composer = definition, binding, composer
        self.known: dict[int, list[tuple[Layout, Recipe | None]]] = {}
        self._n_known = 0
        self.programs: tuple[Program, ...] = ()
        """Those of the layouts met last."""

    def begin(self, n_expected: int) -> ColumnBuilder:
        """Columns with room for ``n_expected`` messages; they grow when there are more."""
        return ColumnBuilder(self.binding.n_raw, n_expected)

    def read(self, out: ColumnBuilder, data: U8, starts: I64, lengths: I64) -> None:
        """Decode a block's messages as far as their layouts are known, some at a time."""
        for part in _parts(lengths):
            self._read_part(out, data, starts[part], lengths[part])

    def _read_part(self, out: ColumnBuilder, data: U8, starts: I64, lengths: I64) -> None:
        """The same for some of them. What Python does message by message waits for :meth:`settle`."""
        rows, n_left = out.take(len(starts)), len(starts)
        for program in self.programs:
            if n_left:
                n_left -= out.run(program, data, starts, lengths, rows.start)
        if n_left:
            source = self.definition.source(data, starts, lengths)
            pending = PendingMessages(source, starts, lengths, out, rows)
            if self.known and not self.definition.spelling_varies:
                self._fill_known(pending, _KINDS_AT_ONCE)
            if pending:
                pending.keep_bytes()
            out.pending.append(pending)

    def close(self, out: ColumnBuilder) -> None:
        """No more messages follow: make the signal's columns, unless a message waits for its layout."""
        out.trim()
        if not out.pending and self.composer is None:
            out.values = self.binding.values(out.raw)

    def _fill_known(self, pending: PendingMessages, most_kinds: int = _KINDS) -> None:
        """Fill in the messages of the layouts met so far, of the first kinds."""
        for kind, rows in pending.by_kind()[:most_kinds]:
            left = rows
            for layout, recipe in tuple(self.known.get(kind, ())):
                filled, left = pending.fill(layout, recipe, left) if len(left) else (left, left)
                if self.definition.spelling_varies and len(filled) > _WORTH_A_PROGRAM:
                    with suppress(Undecodable):
                        self._learn(pending, kind, int(filled[0]))

    def finish(self, out: ColumnBuilder) -> Decoded:
        """The columns, after the messages that wait have brought their new layouts."""
        if out.values is not None:
            return Decoded(out.stamp_ns, out.values, out.raw, out.used)
        n_undecodable = self.settle(out)
        raw, used = out.raw, out.used
        if self.composer is not None:
            raw, used = self.composer.push(out.stamp_ns, raw, used)
        return Decoded(out.stamp_ns, self.binding.values(raw), raw, used, bool(used.all()), n_undecodable)

    def settle(self, out: ColumnBuilder) -> int:
        """Decode the messages that wait; return how many are undecodable."""
        for pending in filter(None, out.pending):  # the bytes of the others are gone
            pending.run(self.programs)
            self._learn_programs(pending)
            self._fill_known(pending)
            self._learn_layouts(pending)
            pending.source.forget()
        out.blank()
        return sum(pending.n_undecodable for pending in out.pending)

    def _learn_programs(self, pending: PendingMessages) -> None:
        """Make programs of the first messages that wait, as long as these make all the others quick."""
        for _ in range(_PROGRAMS):
            if not pending:
                return
            first = pending.first
            try:
                program = self._learn(pending, int(pending.source.kinds(np.array([first]))[0]), first)
            except Undecodable:
                return
            if program is None or not pending.run([program]):
                return

    def _learn_layouts(self, pending: PendingMessages) -> None:
        """Take one exemplar after another out of the messages that wait, until none is left."""
        for kind, rows in pending.by_kind():
            for place, row in enumerate(rows.tolist()):
                if not pending.waiting[row]:
                    continue
                try:
                    program = self._learn(pending, kind, row)
                except Undecodable:
                    n = len(rows) - place if self.definition.allowance.is_spent else 1
                    self._refuse(pending, rows[place : place + n])
                else:
                    left = rows[place:]
                    if program is not None and len(left) >= _WORTH_A_RUN:
                        pending.run([program])
                    pending.fill(*self.known[kind][0], left[pending.waiting[left]])

    @staticmethod
    def _refuse(pending: PendingMessages, rows: I64) -> None:
        """Count those of the messages that wait as undecodable."""
        rows = rows[pending.waiting[rows]]
        pending.n_undecodable += len(rows)
        pending.settle(rows)

    def _account(self) -> None:
        """Account for a new layout. Raises Undecodable where the log has too many."""
        with accounted(self.definition.allowance) as spend:
            spend(self.definition.allowance.budgets.layout_fields)

    def _learn(self, pending: PendingMessages, kind: int, row: int) -> Program | None:
        """Keep the layout of the message in ``row``, and its program, if it has one. Raises Undecodable."""
        layout = self.definition.layout(pending.source.exemplar(row))
        self._account()
        try:
            recipe = self.binding.recipe(layout)
        except NotConcerned:
            recipe = None
        self._n_known += layout.size
        if len(self.known) >= _KINDS or self._n_known > _KNOWN_FIELDS:
            self.known.clear()
            self._n_known = layout.size
        self.known[kind] = [(layout, recipe), *self.known.get(kind, ())][:_LAYOUTS_PER_KIND]
        program = None if recipe is None else self.definition.program(layout, recipe)
        if program is not None:
            self.programs = (program, *self.programs)[:_PROGRAMS]
        return program


def _parts(lengths: I64) -> Iterator[slice]:
    """Consecutive messages, few enough and small enough together; a larger one is alone."""
    ends = np.cumsum(lengths)
    start = 0
    while start < len(lengths):
        before = int(ends[start - 1]) if start else 0
        fit = int(np.searchsorted(ends, before + _PART_BYTES, "right"))
        stop = min(max(fit, start + 1), start + _PART_MESSAGES)
        yield slice(start, stop)
        start = stop
