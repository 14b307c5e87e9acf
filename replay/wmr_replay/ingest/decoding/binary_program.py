"""One compiled pass over binary messages of one layout: skeleton compared, fields gathered and added up.

A :class:`Program` is a layout with a recipe in the form that the pass works through: words of the skeleton,
and one operation for each number. Layouts that it cannot express (big-endian numbers, messages shorter than a
word) have no program and take the way of :mod:`~wmr_replay.ingest.decoding.binary_source`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.layout import Layout, Leaf
from wmr_schemas.arrays import F64, I64, U8, Bool
from wmr_schemas.compiled.lean import lean
from wmr_schemas.compiled.unaligned import load_f32, load_f64, load_u64

_WORD = 8
_FLOAT64, _FLOAT32, _UNSIGNED, _SIGNED, _VARINT, _ZIGZAG = range(6)
_KINDS = {"f8": _FLOAT64, "f4": _FLOAT32, "varint": _VARINT, "zigzag": _ZIGZAG}
_STAMP = -1
_AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class Program:
    """For messages of ``length`` bytes: ``skeleton`` (3, k) offset, mask and expected bits of words;
    ``steps`` (5, m) kind, offset, shift, bytes and column of each number (column −1: the stamp); ``gains``
    and ``factors`` (m,); ``constants`` (n_raw,).
    """

    length: int
    skeleton: Any
    steps: I64
    gains: F64
    factors: I64
    constants: F64

    def run(
        self, data: U8, starts: I64, lengths: I64, first: int, stamp_ns: I64, raw: F64, used: Bool
    ) -> int:
        """Fill in the messages that share the layout and are not filled in yet, from row ``first`` on; how
        many they were.
        """
        filled: int = _run(
            data, starts, lengths, first, self.length, self.skeleton, self.steps, self.gains, self.factors,
            self.constants, np.empty((3, _AT_ONCE), np.uint64), stamp_ns, raw, used,
        )  # fmt: skip
        return filled


def compile_program(layout: Layout, recipe: Recipe) -> Program | None:
    """The program of a recipe, or None when it has to be read in the general way."""
    length = len(layout.exemplar)
    numbers = [(leaf, _STAMP, 1.0, factor) for leaf, factor in recipe.stamp]
    numbers += [(leaf, k, gain, 1) for k, column in enumerate(recipe.columns) for leaf, gain in column.terms]
    if length < _WORD or any(leaf.dtype.startswith(">") for leaf, _, _, _ in numbers):
        return None
    return Program(
        length,
        _words(layout),
        np.array([_step(leaf, column, length) for leaf, column, _, _ in numbers], np.int64)
        .reshape(-1, 5)
        .T.copy(),
        np.array([gain for _, _, gain, _ in numbers]),
        np.array([factor for _, _, _, factor in numbers], np.int64),
        np.array([column.constant for column in recipe.columns]),
    )


def _step(leaf: Leaf, column: int, length: int) -> tuple[int, int, int, int, int]:
    """Fixed numbers are taken out of the word at their place, or the last one, and shifted down."""
    code = leaf.dtype.lstrip("<")
    if code in _KINDS:
        return _KINDS[code], leaf.offset, 0, leaf.stride, column
    place = min(leaf.offset, length - _WORD)
    kind = _SIGNED if code[0] == "i" else _UNSIGNED
    return kind, place, 8 * (leaf.offset - place), int(code[1]), column


def _words(layout: Layout) -> Any:
    """The skeleton by words: offset, mask, expected bits."""
    mask = np.zeros(len(layout.exemplar), np.uint8)
    mask[list(layout.skeleton)] = list(layout.skeleton.values())
    words, position = [], 0
    while (left := np.flatnonzero(mask[position:])).size:
        start = min(position + int(left[0]), len(mask) - _WORD)
        bits = mask[start : start + _WORD].copy()
        want = np.frombuffer(layout.exemplar, np.uint8)[start : start + _WORD] & bits
        words.append((start, int(bits.view("<u8")[0]), int(want.view("<u8")[0])))
        mask[start : start + _WORD] = 0
        position = start
    return np.array(words, np.uint64).reshape(-1, 3).T.copy()


@lean
def _agrees(data: U8, start: Any, skeleton: Any) -> Any:
    offsets, masks, wanted = skeleton[0], skeleton[1], skeleton[2]
    wrong = np.uint64(0)
    for k in range(len(offsets)):
        wrong |= (load_u64(data, start + offsets[k]) & masks[k]) ^ wanted[k]
    return wrong == 0


@lean
def _select(  # noqa: PLR0913, PLR0917 – compiled code takes its arrays one by one
    data: U8, starts: I64, lengths: I64, part: Any, first: int, length: int, skeleton: Any, used: Bool,
    found: Any,
) -> int:  # fmt: skip
    """Rows of the messages in ``part`` that agree, and where they start, into ``found``; they are now used.

    Both are unsigned, which spares the test whether an index counts from the end.
    """
    n = 0
    for k in range(part[0], part[1]):
        start, row = np.uint64(starts[k]), np.uint64(first + k)
        if not used[row] and lengths[k] == length and _agrees(data, start, skeleton):
            used[row] = True
            found[0, n], found[1, n] = row, start
            n += 1
    return n


@lean
def _read_fixed(data: U8, places: Any, step: Any, shift: int, n_bytes: int, signed: bool, out: I64) -> None:
    """Whole numbers of fixed size, out of the words that hold them."""
    down, unused = np.uint64(shift), np.uint64(64 - 8 * n_bytes)
    for k in range(len(places)):
        value = (load_u64(data, places[k] + step) >> down) << unused
        out[k] = np.int64(value) >> np.int64(unused) if signed else np.int64(value >> unused)


@lean
def _read_varints(data: U8, places: Any, step: Any, n_bytes: int, zigzag: bool, out: I64) -> None:
    """Whole numbers in groups of seven bits, least significant first."""
    for k in range(len(places)):
        value, place = np.uint64(0), places[k] + step
        for group in range(n_bytes):
            value |= np.uint64(data[place + np.uint64(group)] & 0x7F) << np.uint64(7 * group)
        if zigzag:
            value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
        out[k] = np.int64(value)


@lean
def _read_floats(data: U8, places: Any, step: Any, double: bool, out: F64) -> None:
    """Floating-point numbers."""
    if double:
        for k in range(len(places)):
            out[k] = load_f64(data, places[k] + step)
    else:
        for k in range(len(places)):
            out[k] = load_f32(data, places[k] + step)


@lean
def _add(out: F64, rows: Any, numbers: Any, gain: float) -> None:
    for k in range(len(rows)):
        out[rows[k]] += gain * np.float64(numbers[k])


@lean
def _add_ns(out: I64, rows: Any, numbers: Any, factor: int) -> None:
    for k in range(len(rows)):
        out[rows[k]] += np.int64(numbers[k]) * factor


@lean
def _gather(  # noqa: PLR0913, PLR0917
    data: U8,
    rows: Any,
    places: Any,
    numbers: Any,
    steps: I64,
    gains: F64,
    factors: I64,
    stamp_ns: I64,
    raw: F64,
) -> None:
    """The fields of a few messages one after another: each is a short loop of its own."""
    floats, integers = numbers.view(np.float64), numbers.view(np.int64)
    for k in range(steps.shape[1]):
        kind, step, column = steps[0, k], np.uint64(steps[1, k]), steps[4, k]
        is_float = kind in (_FLOAT64, _FLOAT32)
        if is_float:
            _read_floats(data, places, step, kind == _FLOAT64, floats)
        elif kind in (_UNSIGNED, _SIGNED):
            _read_fixed(data, places, step, steps[2, k], steps[3, k], kind == _SIGNED, integers)
        else:
            _read_varints(data, places, step, steps[3, k], kind == _ZIGZAG, integers)
        if is_float and column == _STAMP:
            _add_ns(stamp_ns, rows, floats, factors[k])
        elif is_float:
            _add(raw[column], rows, floats, gains[k])
        elif column == _STAMP:
            _add_ns(stamp_ns, rows, integers, factors[k])
        else:
            _add(raw[column], rows, integers, gains[k])


@lean
def _run(  # noqa: PLR0913, PLR0917
    data: U8, starts: I64, lengths: I64, first: int, length: int, skeleton: Any, steps: I64, gains: F64,
    factors: I64, constants: F64, scratch: Any, stamp_ns: I64, raw: F64, used: Bool,
) -> int:  # fmt: skip
    """The messages that agree, a few at once, so that their bytes stay near."""
    filled = 0
    for start in range(0, len(starts), _AT_ONCE):
        part = start, min(start + _AT_ONCE, len(starts))
        n = _select(data, starts, lengths, part, first, length, skeleton, used, scratch)
        rows, places = scratch[0, :n], scratch[1, :n]
        for k in range(n):
            stamp_ns[rows[k]] = 0
        for column in range(len(constants)):
            for k in range(n):
                raw[column, rows[k]] = constants[column]
        _gather(data, rows, places, scratch[2, :n], steps, gains, factors, stamp_ns, raw)
        filled += n
    return filled
