"""JSON messages as columns, decoded one by one by msgspec: those that fit no compiled template.

A message becomes the list of its scalar values (numbers, strings, ``true``, ``false``, ``null``) in the order
in which they are written. Messages whose paths, kinds of values and array lengths agree have the same
structure; in those, the k-th value always has the same path.
"""

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import msgspec
import numpy as np

from wmr_replay.ingest.budgets import BUDGETS, no_account
from wmr_replay.ingest.decoding.layout import Layout, Leaf, Spend, Text, Undecodable
from wmr_schemas.arrays import F64, I64, U8, Bool

_NUMBER, _TEXT = -2, -3
"""Kinds of fields; an array has its length in place of a kind. Python gives −1 and −2 the same hash."""
_UNDECODABLE = 0
_INT64 = range(-(1 << 63), 1 << 63)


class FlatMessage(NamedTuple):
    """One message: (path, kind or array length) of each field, and the scalar values."""

    fields: list[tuple[str, int]]
    values: list[Any]


def json_layout(message: bytes, spend: Spend = no_account) -> Layout:
    """The fields of one message by the ordinal of their value. Raises Undecodable, OverBudget."""
    flat = flat_message(message)
    spend(len(flat.fields))
    layout = Layout(message, spend=spend)
    ordinal = 0
    for path, kind in flat.fields:
        if kind >= 0:
            layout.counts[path] = kind
            continue
        if kind == _TEXT:
            layout.texts[path] = Text(ordinal, flat.values[ordinal])
        else:
            layout.leaves[path] = Leaf(ordinal, "json")
        ordinal += 1
    return layout


def flat_message(message: bytes) -> FlatMessage:
    """Decode a JSON object; of a repeated key the last value counts. Raises Undecodable."""
    flat = FlatMessage([], [])
    try:
        content = _decoded(message)
        if not isinstance(content, dict):
            raise Undecodable("no JSON object")
        _flatten(content, "", flat, BUDGETS.most_depth)
    except RecursionError:
        raise Undecodable("nested too deeply") from None
    return flat


def _decoded(message: bytes) -> object:
    """The content of a JSON text.

    What msgspec refuses is given to Python's own decoder: it also takes ``NaN``, ``Infinity``, numbers beyond
    the range of a double and lone surrogates.
    """
    try:
        return msgspec.json.decode(message)
    except (msgspec.DecodeError, UnicodeDecodeError):
        try:
            return json.loads(message)
        except ValueError:
            raise Undecodable("no JSON text") from None


def _flatten(value: object, path: str, flat: FlatMessage, left: int) -> None:
    """Append the fields and values at ``path``. Raises Undecodable where they are too many, or too deep."""
    if len(flat.fields) > BUDGETS.most_fields:
        raise Undecodable(f"a message has more than {BUDGETS.most_fields:,} fields, which are read at most")
    if left == 0:
        raise Undecodable("nested too deeply")
    if isinstance(value, dict):
        for key, item in value.items():
            _flatten(item, f"{path}.{key}" if path else key, flat, left - 1)
    elif isinstance(value, list):
        flat.fields.append((path, len(value)))
        for k, item in enumerate(value):
            _flatten(item, f"{path}[{k}]", flat, left - 1)
    else:
        flat.fields.append((path, _TEXT if isinstance(value, str) else _NUMBER))
        flat.values.append(value)


def repeats_a_key(message: bytes) -> bool:
    """Whether an object of a JSON text has the same key twice."""
    found = False

    def check(pairs: list[tuple[str, object]]) -> None:
        nonlocal found
        found |= len({key for key, _ in pairs}) < len(pairs)

    json.loads(message, object_pairs_hook=check)
    return found


class JsonSource:
    """JSON messages of one block; a :class:`~.layout.Source` whose offsets count scalar values."""

    def __init__(self, data: U8, starts: I64, lengths: I64) -> None:
        self.data, self.starts, self.lengths = data, starts, lengths
        self._kinds: dict[int, int] = {}
        self._values: dict[int, list[Any]] = {}

    def kinds(self, rows: I64) -> I64:
        """Hashes of the messages' structure; the same number for all that are no JSON objects."""
        return np.fromiter((self._kind(row) for row in rows.tolist()), np.int64, len(rows))

    def _kind(self, row: int) -> int:
        """The kind of one message, which is decoded once."""
        if row not in self._kinds:
            try:
                flat = flat_message(self.exemplar(row))
            except Undecodable:
                self._kinds[row] = _UNDECODABLE
            else:
                self._kinds[row], self._values[row] = hash(tuple(flat.fields)), flat.values
        return self._kinds[row]

    def move(self, data: U8, starts: I64) -> None:
        """The same messages in other bytes, which nothing changes any more."""
        self.data, self.starts = data, starts
        self.data.flags.writeable = False

    def forget(self) -> None:
        """Forget the decoded messages."""
        self._kinds.clear()
        self._values.clear()

    def exemplar(self, row: int) -> bytes:
        """The text of the message in that row."""
        start = self.starts[row]
        return self.data[start : start + self.lengths[row]].tobytes()

    def agree(self, layout: Layout, rows: I64) -> Bool:
        """Messages whose strings in the skeleton equal the exemplar's."""
        contents = {text.offset: text.content for text in layout.texts.values()}
        wanted = [(k, contents[k]) for k in layout.skeleton]
        values = (self._values.get(row) for row in rows.tolist())
        same = (each is not None and all(each[k] == text for k, text in wanted) for each in values)
        return np.fromiter(same, np.bool_, len(rows))

    def table(self, rows: I64, leaves: Sequence[Leaf]) -> F64:
        """(k, n) the numbers; NaN for ``null``, ``true`` and ``false``."""
        chosen = [self._values[row] for row in rows.tolist()]
        numbers = [[_double(values[leaf.offset]) for values in chosen] for leaf in leaves]
        return np.array(numbers, np.float64).reshape(len(leaves), len(rows))

    def ints(self, rows: I64, leaf: Leaf) -> I64:
        """The numbers as int64, fractions cut off; 0 for what is no number or needs more than 64 bits."""
        whole = (_whole(self._values[row][leaf.offset]) for row in rows.tolist())
        return np.fromiter(whole, np.int64, len(rows))


def _double(value: object) -> float:
    """The nearest double; NaN for what is no number."""
    if type(value) is float:
        return value
    if type(value) is not int:
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _whole(value: object) -> int:
    """A whole number of 64 bits, or 0."""
    if isinstance(value, float):
        value = int(value) if math.isfinite(value) else 0
    return value if type(value) is int and value in _INT64 else 0
