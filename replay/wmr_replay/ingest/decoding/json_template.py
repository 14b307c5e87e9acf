"""One compiled pass over JSON messages that are spelled alike: between their values they equal the exemplar.

A :class:`JsonTemplate` is a layout with a recipe in the form that the pass works through: the text in front
of each value, and what to do with the value. A message that departs from it, if only in a blank, is left to
:mod:`~wmr_replay.ingest.decoding.json_source`, which gives the same columns.
"""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.json_numbers import decimal, integer
from wmr_replay.ingest.decoding.json_source import repeats_a_key
from wmr_replay.ingest.decoding.layout import Layout
from wmr_schemas.arrays import F64, I64, U8, Bool
from wmr_schemas.compiled.lean import lean

_SCALAR = re.compile(rb'"(?:[^"\\]|\\.)*"|[^\s\[\]{}:,"]+', re.S)
_COLON = re.compile(rb"\s*:")
_QUOTE, _BACKSLASH = ord('"'), ord("\\")
_FIRST_PLAIN, _LAST_PLAIN = 0x20, 0x7F
_IN_SCALAR = np.ones(256, np.bool_)
"""Which bytes may stand in a number, ``true``, ``false`` or ``null``."""
_IN_SCALAR[list(b' \t\n\r:,{}[]"')] = False
_WORD = 8
_TEXT, _OTHER, _NUMBER, _WHOLE = range(4)
"""Strings and other values to be passed over; numbers, and whole numbers, to be read."""
_STAMP = -1


@dataclass(frozen=True, eq=False)
class JsonTemplate:
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


def compile_template(layout: Layout, recipe: Recipe) -> JsonTemplate | None:
    """The template of a recipe.

    None where a number serves as stamp and as value, and where the exemplar repeats a key: only the last of
    its values counts.
    """
    stamp = {leaf.offset: factor for leaf, factor in recipe.stamp}
    terms = [
        (leaf.offset, column, gain)
        for column, total in enumerate(recipe.columns)
        for leaf, gain in total.terms
    ]
    if stamp.keys() & {offset for offset, _, _ in terms} or repeats_a_key(layout.exemplar):
        return None
    spans = value_spans(layout.exemplar)
    values = [k for k in range(len(spans)) if k not in layout.skeleton]
    place = {ordinal: k for k, ordinal in enumerate(values)}
    starts, stops = [spans[k][0] for k in values], [spans[k][1] for k in values]
    pieces = [layout.exemplar[a:b] for a, b in zip([0, *stops], [*starts, len(layout.exemplar)], strict=True)]
    numbers = {offset for offset, _, _ in terms}
    kinds = [
        _WHOLE if k in stamp else _NUMBER if k in numbers else _TEXT if piece.endswith(b'"') else _OTHER
        for k, piece in zip(values, pieces, strict=False)
    ]
    steps = [(place[k], _STAMP) for k in stamp] + [(place[k], column) for k, column, _ in terms]
    words = [_words(piece) for piece in pieces]
    return JsonTemplate(
        np.concatenate(words, axis=1),
        np.cumsum([0, *(each.shape[1] for each in words)]),
        np.array([len(piece) for piece in pieces], np.int64),
        np.array(kinds, np.int64),
        np.array(steps, np.int64).reshape(-1, 2).T.copy(),
        np.array([1.0] * len(stamp) + [gain for _, _, gain in terms]),
        np.array([*stamp.values()] + [0] * len(terms), np.int64),
        np.array([column.constant for column in recipe.columns]),
    )


def value_spans(message: bytes) -> list[tuple[int, int]]:
    """Start and stop of every scalar value of a JSON text, keys left out; of strings without their quotes."""
    found = []
    for token in _SCALAR.finditer(message):
        is_text = token[0].startswith(b'"')
        if not (is_text and _COLON.match(message, token.end())):
            found.append((token.start() + is_text, token.end() - is_text))
    return found


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
def _skipped(data: U8, position: int, stop: int, kind: int) -> int:
    """Where a value that is not needed ends; −1 if there is none of its kind, or one that needs care.

    Text beyond printable ASCII may be damaged, which only decoding it tells.
    """
    begin = position
    if kind == _TEXT:
        while position < stop and data[position] != _QUOTE:
            position += data[position] == _BACKSLASH
            if position < stop and not _FIRST_PLAIN <= data[position] <= _LAST_PLAIN:
                return -1
            position += 1
        return min(position, stop)
    while position < stop and _IN_SCALAR[data[position]]:
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
            position = _skipped(data, position, stop, kinds[k])
        if position < 0:
            return False
    return False


@lean
def _run(  # noqa: PLR0913, PLR0917
    data: U8, words: Any, starts: I64, lengths: I64, first: int, literals: Any, begins: I64, sizes: I64,
    kinds: I64, steps: I64, gains: F64, factors: I64, constants: F64, numbers: F64, wholes: I64,
    stamp_ns: I64, raw: F64, used: Bool,
) -> int:  # fmt: skip
    """Fill in the messages that fit the template; return how many they are."""
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
