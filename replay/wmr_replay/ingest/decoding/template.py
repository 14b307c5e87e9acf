"""One compiled pass over JSON messages that are spelled alike: between their values they equal the exemplar.

A :class:`Template` is a layout with a recipe in the form that the pass works through: the text in front of
each value, and what to do with the value. A message that departs from it in anything, be it a blank, is left
to :mod:`~wmr_replay.ingest.decoding.jsonrows`, which gives the same columns.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.decimals import decimal, integer
from wmr_replay.ingest.decoding.layout import Layout
from wmr_replay.ingest.decoding.tokens import CLASS, IS_VALUE, string_end, tokenise
from wmr_schemas.arrays import F64, I64, U8, Bool
from wmr_schemas.compiled.lean import lean

_WORD = 8
_TEXT, _OTHER, _NUMBER, _WHOLE = range(4)
"""Strings and other values to be passed over; numbers, and whole numbers, to be read."""
_STAMP = -1


@dataclass(frozen=True, eq=False)
class Template:
    """The text before each value and after the last one: ``literals`` (2, k) words and masks; that of value i
    starts at ``first[i]`` and has ``sizes[i]`` bytes. ``kinds`` of the values; ``steps`` (2, m) value and
    column of each number that is added to a column (−1: the stamp), with ``gains`` and ``factors``.
    """

    literals: Any
    first: I64
    sizes: I64
    kinds: I64
    steps: I64
    gains: F64
    factors: I64
    constants: F64

    def run(
        self, data: U8, starts: I64, lengths: I64, first: int, stamp_ns: I64, raw: F64, used: Bool
    ) -> int:
        """Fill in the messages that fit and are not filled in yet, from row ``first`` on; how many."""
        words = np.ndarray((max(len(data) - _WORD + 1, 0),), "<u8", data, strides=(1,))
        filled: int = _run(
            data, words, starts, lengths, first, self.literals, self.first, self.sizes, self.kinds,
            self.steps, self.gains, self.factors, self.constants, np.empty(len(self.kinds)),
            np.empty(len(self.kinds), np.int64), stamp_ns, raw, used,
        )  # fmt: skip
        return filled


def compile_template(layout: Layout, recipe: Recipe) -> Template | None:
    """The template of a recipe; None where a number serves as stamp and as value."""
    stamp = {leaf.offset: factor for leaf, factor in recipe.stamp}
    terms = [
        (leaf.offset, column, gain)
        for column, total in enumerate(recipe.columns)
        for leaf, gain in total.terms
    ]
    if stamp.keys() & {offset for offset, _, _ in terms}:
        return None
    text = np.frombuffer(layout.exemplar, np.uint8)
    tokens = tokenise(text, np.zeros(1, np.int64), np.array([len(text)]))
    values = [k for k in range(len(tokens.start)) if k not in layout.skeleton]
    place = {ordinal: k for k, ordinal in enumerate(values)}
    stops = [0, *tokens.stop[values].tolist()]
    pieces = [
        layout.exemplar[a:b] for a, b in zip(stops, [*tokens.start[values].tolist(), len(text)], strict=True)
    ]
    numbers = {offset for offset, _, _ in terms}
    kinds = [
        _WHOLE if k in stamp else _NUMBER if k in numbers else _TEXT if piece.endswith(b'"') else _OTHER
        for k, piece in zip(values, pieces, strict=False)
    ]
    steps = [(place[k], _STAMP) for k in stamp] + [(place[k], column) for k, column, _ in terms]
    words = [_words(piece) for piece in pieces]
    return Template(
        np.concatenate(words, axis=1),
        np.cumsum([0, *(each.shape[1] for each in words)]),
        np.array([len(piece) for piece in pieces], np.int64),
        np.array(kinds, np.int64),
        np.array(steps, np.int64).reshape(-1, 2).T.copy(),
        np.array([1.0] * len(stamp) + [gain for _, _, gain in terms]),
        np.array([*stamp.values()] + [0] * len(terms), np.int64),
        np.array([column.constant for column in recipe.columns]),
    )


def _words(piece: bytes) -> Any:
    """A text as (2, k) words and masks; the last word may be filled up."""
    padding = bytes(-len(piece) % _WORD)
    mask = b"\xff" * len(piece) + padding
    return np.stack([np.frombuffer(part, "<u8") for part in (piece + padding, mask)])


@lean
def _equals(data: U8, words: Any, position: int, literals: Any, first: int, size: int) -> Any:
    """Whether the text stands at ``position``; near the end of the data it is compared byte by byte."""
    if position + size + _WORD <= len(data):
        wrong = np.uint64(0)
        for k in range((size + _WORD - 1) // _WORD):
            wrong |= (words[position + _WORD * k] ^ literals[0, first + k]) & literals[1, first + k]
        return wrong == 0
    for k in range(size):
        word = literals[0, first + k // _WORD]
        if np.uint64(data[position + k]) != (word >> np.uint64(8 * (k % _WORD))) & np.uint64(0xFF):
            return False
    return True


@lean
def _passed(data: U8, position: int, stop: int, kind: int) -> int:
    """Where a value that nobody wants ends; −1 if there is none of its kind."""
    if kind == _TEXT:
        return string_end(data, position, stop)
    begin = position
    while position < stop and CLASS[data[position]] == IS_VALUE:
        position += 1
    return position if position > begin else -1


@lean
def _read(  # noqa: PLR0913, PLR0917 – compiled code takes its arrays one by one
    data: U8, words: Any, position: int, stop: int, literals: Any, first: I64, sizes: I64, kinds: I64,
    numbers: F64, wholes: I64,
) -> bool:  # fmt: skip
    """The values of one message, if it fits the template."""
    for k in range(len(sizes)):
        if position + sizes[k] > stop or not _equals(data, words, position, literals, first[k], sizes[k]):
            return False
        position += sizes[k]
        if k == len(kinds):
            return position == stop
        if kinds[k] == _NUMBER:
            numbers[k], position = decimal(data, words, position, stop)
        elif kinds[k] == _WHOLE:
            wholes[k], position = integer(data, words, position, stop)
        else:
            position = _passed(data, position, stop, kinds[k])
        if position < 0:
            return False
    return False


@lean
def _run(  # noqa: PLR0913, PLR0917
    data: U8, words: Any, starts: I64, lengths: I64, first: int, literals: Any, begins: I64, sizes: I64,
    kinds: I64, steps: I64, gains: F64, factors: I64, constants: F64, numbers: F64, wholes: I64,
    stamp_ns: I64, raw: F64, used: Bool,
) -> int:  # fmt: skip
    filled = 0
    for k in range(len(starts)):
        row, start, stop = first + k, starts[k], starts[k] + lengths[k]
        if used[row] or not _read(data, words, start, stop, literals, begins, sizes, kinds, numbers, wholes):
            continue
        used[row] = True
        filled += 1
        stamp_ns[row] = 0
        for column in range(len(constants)):
            raw[column, row] = constants[column]
        for i in range(steps.shape[1]):
            value, column = steps[0, i], steps[1, i]
            if column == _STAMP:
                stamp_ns[row] += wholes[value] * factors[i]
            else:
                raw[column, row] += gains[i] * numbers[value]
    return filled
