"""One compiled pass over binary messages of one layout: skeleton compared, fields gathered and added up.

A :class:`BinaryProgram` is a layout with a recipe in the form that the pass works through: words of the
skeleton, and one operation for each number. Layouts that it cannot express (big-endian numbers, messages
shorter than a word) have no program; they are read by :mod:`~wmr_replay.ingest.decoding.binary_source`.
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
class BinaryProgram:
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
            self.constants, np.empty((2, _AT_ONCE), np.uint64), np.empty(_AT_ONCE),
            np.empty(_AT_ONCE, np.int64), stamp_ns, raw, used,
        )  # fmt: skip
        return filled


def compile_program(layout: Layout, recipe: Recipe) -> BinaryProgram | None:
    """The program of a recipe, or None when it has to be read in the general way."""
    length = len(layout.exemplar)
    numbers = [(leaf, _STAMP, 1.0, factor) for leaf, factor in recipe.stamp]
    numbers += [(leaf, k, gain, 1) for k, column in enumerate(recipe.columns) for leaf, gain in column.terms]
    if length < _WORD or any(leaf.dtype.startswith(">") for leaf, _, _, _ in numbers):
        return None
    return BinaryProgram(
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
    words, stop = [], 0
    for place in np.flatnonzero(mask).tolist():
        if place < stop:
            continue
        start = min(place, len(mask) - _WORD)
        stop = start + _WORD
        bits = mask[start:stop].copy()
        want = np.frombuffer(layout.exemplar, np.uint8)[start:stop] & bits
        words.append((start, int(bits.view("<u8")[0]), int(want.view("<u8")[0])))
        mask[start:stop] = 0
    return np.array(words, np.uint64).reshape(-1, 3).T.copy()


@lean
def _run(  # noqa: C901, PLR0912, PLR0913, PLR0917 – one function compiles three times as fast as ten
    data: U8, starts: I64, lengths: I64, first: int, length: int, skeleton: Any, steps: I64, gains: F64,
    factors: I64, constants: F64, found: Any, floats: F64, wholes: I64, stamp_ns: I64, raw: F64, used: Bool,
) -> int:  # fmt: skip
    """Fill in the messages that agree with the skeleton; return how many they are.

    A few messages at a time, so that their bytes stay near: first their rows and places go into ``found``
    (2, few), then each field is read in a short loop of its own. Rows and places are unsigned, which spares
    the test whether an index counts from the end.
    """
    n_filled, few = 0, found.shape[1]
    for begin in range(0, len(starts), few):
        n = 0
        for k in range(begin, begin + few):
            if k == len(starts):
                break
            row, place, wrong = np.uint64(first + k), np.uint64(starts[k]), np.uint64(0)
            if used[row] or lengths[k] != length:
                continue
            for i in range(skeleton.shape[1]):
                wrong |= (load_u64(data, place + skeleton[0, i]) & skeleton[1, i]) ^ skeleton[2, i]
            if wrong == 0:
                used[row] = True
                found[0, n], found[1, n] = row, place
                n += 1
        for k in range(n):
            stamp_ns[found[0, k]] = 0
        for column in range(len(constants)):
            for k in range(n):
                raw[column, found[0, k]] = constants[column]
        for i in range(steps.shape[1]):
            kind, offset, n_bytes, column = steps[0, i], np.uint64(steps[1, i]), steps[3, i], steps[4, i]
            if kind == _FLOAT64:
                for k in range(n):
                    floats[k] = load_f64(data, found[1, k] + offset)
            elif kind == _FLOAT32:
                for k in range(n):
                    floats[k] = load_f32(data, found[1, k] + offset)
            elif kind in (_UNSIGNED, _SIGNED):
                down, unused = np.uint64(steps[2, i]), np.uint64(64 - 8 * n_bytes)
                for k in range(n):
                    word = (load_u64(data, found[1, k] + offset) >> down) << unused
                    wholes[k] = (
                        np.int64(word) >> np.int64(unused) if kind == _SIGNED else np.int64(word >> unused)
                    )
            else:
                for k in range(n):
                    word = np.uint64(0)
                    for group in range(n_bytes):
                        bits = np.uint64(data[found[1, k] + offset + np.uint64(group)] & 0x7F)
                        word |= bits << np.uint64(7 * group)
                    if kind == _ZIGZAG:
                        word = (word >> np.uint64(1)) ^ (np.uint64(0) - (word & np.uint64(1)))
                    wholes[k] = np.int64(word)
            is_float = kind in (_FLOAT64, _FLOAT32)
            if column == _STAMP:
                for k in range(n):
                    whole = np.int64(floats[k]) if is_float else wholes[k]
                    stamp_ns[found[0, k]] += whole * factors[i]
            else:
                for k in range(n):
                    number = floats[k] if is_float else np.float64(wholes[k])
                    raw[column, found[0, k]] += gains[i] * number
        n_filled += n
    return n_filled
