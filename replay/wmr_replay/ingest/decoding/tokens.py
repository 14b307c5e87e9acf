"""JSON messages cut into their scalar values, compiled: no object is made for any of them.

Messages whose keys and brackets agree have the same structure hash; in those, the k-th value always has the
same meaning. Numbers, ``null``, ``true`` and ``false`` count as one kind of value, strings as another.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_schemas.arrays import I64, U8
from wmr_schemas.compiled import compiled
from wmr_schemas.compiled.lean import lean

_PRIME = np.uint64(0x100000001B3)
_BASIS = np.uint64(0xCBF29CE484222325)
_QUOTE, _BACKSLASH, _COLON, _COMMA = ord('"'), ord("\\"), ord(":"), ord(",")
_OPEN, _CLOSE, _OPEN_LIST, _CLOSE_LIST = ord("{"), ord("}"), ord("["), ord("]")
_SPACE, _TAB, _NEWLINE, _RETURN = ord(" "), ord("\t"), ord("\n"), ord("\r")
_TEXT_MARK, _NUMBER_MARK = ord("s"), ord("n")


@dataclass(frozen=True, eq=False)
class Tokens:
    """Values of n messages: those of message i are ``first[i]`` to ``first[i + 1] − 1``; a hash each."""

    first: I64
    structure: I64
    start: I64
    stop: I64


def _classes() -> U8:
    """What a byte is outside strings: 0 part of a value, 1 space, 2 a mark, 3 a quote."""
    classes = np.zeros(256, np.uint8)
    classes[[_SPACE, _TAB, _NEWLINE, _RETURN]] = _IS_SPACE
    classes[[_COLON, _COMMA, _OPEN, _CLOSE, _OPEN_LIST, _CLOSE_LIST]] = _IS_MARK
    classes[_QUOTE] = _IS_QUOTE
    return classes


IS_VALUE, _IS_SPACE, _IS_MARK, _IS_QUOTE = range(4)
CLASS = _classes()


@lean
def string_end(data: U8, position: int, stop: int) -> int:
    """The closing quote of the string whose content starts at ``position``; ``stop`` if there is none."""
    while position < stop and data[position] != _QUOTE:
        position += 2 if data[position] == _BACKSLASH else 1
    return min(position, stop)


@lean
def hash_bytes(data: U8, start: int, stop: int, value: Any) -> Any:
    """FNV-1a, continued from ``value``."""
    for k in range(start, stop):
        value = (value ^ np.uint64(data[k])) * _PRIME
    return value


@lean
def _scan(data: U8, position: int, stop: int, table: I64, row: int) -> tuple[int, Any]:
    """Tokens of one message into ``table`` from ``row`` on, if it has room; the next row, and the hash."""
    value = _BASIS
    while position < stop:
        byte = data[position]
        begin = position
        position += 1
        kind = CLASS[byte]
        if kind == _IS_SPACE:
            continue
        if kind == _IS_MARK:
            value = (value ^ np.uint64(byte)) * _PRIME
            continue
        mark = _NUMBER_MARK
        end = position
        if kind == _IS_QUOTE:
            begin, end = position, string_end(data, position, stop)
            position = min(end + 1, stop)
            mark = _TEXT_MARK
            while position < stop and CLASS[data[position]] == _IS_SPACE:
                position += 1
            if position < stop and data[position] == _COLON:
                value = hash_bytes(data, begin, end, value)
                continue
        else:
            while end < stop and CLASS[data[end]] == IS_VALUE:
                end += 1
            position = end
        value = (value ^ np.uint64(mark)) * _PRIME
        if row < table.shape[1]:
            table[0, row], table[1, row] = begin, end
        row += 1
    return row, value


@lean
def _scan_all(data: U8, starts: I64, lengths: I64, first: I64, structure: Any, table: I64) -> int:
    row = 0
    for k in range(len(starts)):
        first[k] = row
        row, structure[k] = _scan(data, starts[k], starts[k] + lengths[k], table, row)
    first[len(starts)] = row
    return row


def tokenise(data: U8, starts: I64, lengths: I64) -> Tokens:
    """Cut the messages at ``starts`` into values. Malformed text gives some tokens, never an error."""
    n = len(starts)
    first, structure = np.empty(n + 1, np.int64), np.empty(n, np.uint64)
    room = (
        _scan_all(data, starts[:1], lengths[:1], first[:2], structure, np.empty((2, 0), np.int64)) * n
        if n
        else 0
    )
    table = np.empty((2, room), np.int64)
    total = _scan_all(data, starts, lengths, first, structure, table)
    if total > room:
        table = np.empty((2, total), np.int64)
        _scan_all(data, starts, lengths, first, structure, table)
    return Tokens(first, structure.view(np.int64), table[0], table[1])


@compiled(nogil=True)
def same_text(data: U8, start: I64, stop: I64, text: U8) -> Any:
    """Which tokens spell ``text``."""
    same = (stop - start) == len(text)
    for row in range(len(start)):
        for k in range(len(text)):
            if same[row] and data[start[row] + k] != text[k]:
                same[row] = False
    return same


@lean
def _copy(data: U8, start: I64, offsets: Any, out: U8) -> None:
    for row in range(len(start)):
        for k in range(offsets[row + 1] - offsets[row]):
            out[offsets[row] + k] = data[start[row] + k]


def concatenate(data: U8, start: I64, stop: I64) -> tuple[Any, U8]:
    """The tokens' bytes one after another, and where each starts (int32, n + 1)."""
    offsets = np.zeros(len(start) + 1, np.int32)
    np.cumsum(stop - start, out=offsets[1:])
    out = np.empty(int(offsets[-1]), np.uint8)
    _copy(data, start, offsets, out)
    return offsets, out
