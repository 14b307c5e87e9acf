"""JSON messages as columns: cut into values by a compiled scanner, numbers parsed by Arrow."""

import json
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from wmr_replay.ingest.decoding.layout import Layout, Leaf, Text, Undecodable
from wmr_replay.ingest.decoding.tokens import Tokens, concatenate, same_text, tokenise
from wmr_schemas.arrays import F64, I64, U8, Bool

_NULL = ord("n")


class _Pairs(list[tuple[str, Any]]):
    """A JSON object as it is written, repeated keys included."""


def json_layout(message: bytes) -> Layout:
    """The fields of one message by the ordinal of their value. Raises Undecodable."""
    try:
        content = json.loads(message, object_pairs_hook=_Pairs)
    except (ValueError, RecursionError):
        raise Undecodable("no JSON text") from None
    if not isinstance(content, _Pairs):
        raise Undecodable("no JSON object")
    layout = Layout(message)
    _enter(layout, content, "", 0)
    return layout


def _enter(layout: Layout, value: object, path: str, ordinal: int) -> int:
    """Add what is at ``path``; the ordinal of the next value."""
    if isinstance(value, _Pairs):
        for key, item in value:
            ordinal = _enter(layout, item, f"{path}.{key}" if path else key, ordinal)
        return ordinal
    if isinstance(value, list):
        layout.counts[path] = len(value)
        for k, item in enumerate(value):
            ordinal = _enter(layout, item, f"{path}[{k}]", ordinal)
        return ordinal
    if isinstance(value, str):
        layout.texts[path] = Text(ordinal, value)
    else:
        layout.leaves[path] = Leaf(ordinal, "json")
    return ordinal + 1


class JsonSource:
    """JSON messages of one block; a :class:`~.layout.Source` whose offsets count values."""

    def __init__(self, data: U8, starts: I64, lengths: I64) -> None:
        self.data, self.starts, self.lengths = data, starts, lengths

    @cached_property
    def tokens(self) -> Tokens:
        """The messages cut into values, once somebody asks."""
        return tokenise(self.data, self.starts, self.lengths)

    @property
    def kinds(self) -> I64:
        """Hashes of the messages' structure."""
        return self.tokens.structure

    def exemplar(self, row: int) -> bytes:
        """One message's text."""
        start = self.starts[row]
        return self.data[start : start + self.lengths[row]].tobytes()

    def agree(self, layout: Layout, rows: I64) -> Bool:
        """Messages whose relied-on strings are spelled as in the exemplar."""
        same = np.ones(len(rows), np.bool_)
        if layout.skeleton:
            exemplar = np.frombuffer(layout.exemplar, np.uint8)
            own = tokenise(exemplar, np.zeros(1, np.int64), np.array([len(exemplar)]))
            for k in layout.skeleton:
                place = self.tokens.first[rows] + k
                text = exemplar[own.start[k] : own.stop[k]]
                same &= same_text(self.data, self.tokens.start[place], self.tokens.stop[place], text)
        return same

    def table(self, rows: I64, leaves: Sequence[Leaf]) -> F64:
        """(k, n) the numbers; NaN for ``null`` and for what is no number."""
        if not leaves:
            return np.empty((0, len(rows)))
        offsets = np.array([leaf.offset for leaf in leaves])
        return self._floats((self.tokens.first[rows] + offsets[:, None]).ravel()).reshape(len(leaves), -1)

    def _floats(self, place: I64) -> F64:
        import pyarrow as pa  # noqa: PLC0415 – logs in JSON pay for it
        import pyarrow.compute as pc  # noqa: PLC0415

        texts = self._texts(pa, place)
        try:
            numbers = pc.cast(texts, pa.float64())
        except pa.ArrowInvalid:
            return np.array([_number(text) for text in texts.to_pylist()])
        return numbers.fill_null(float("nan")).to_numpy(zero_copy_only=False)  # type: ignore[no-any-return]

    def ints(self, rows: I64, leaf: Leaf) -> I64:
        """The numbers as int64: exact where they are written as integers, 0 where they are none."""
        import pyarrow as pa  # noqa: PLC0415
        import pyarrow.compute as pc  # noqa: PLC0415

        place = self.tokens.first[rows] + leaf.offset
        try:
            numbers = pc.cast(self._texts(pa, place), pa.int64())
        except pa.ArrowInvalid:
            return np.nan_to_num(self._floats(place)).astype(np.int64)
        return numbers.fill_null(0).to_numpy(zero_copy_only=False)  # type: ignore[no-any-return]

    def _texts(self, pa: Any, place: I64) -> Any:
        """The tokens at ``place`` as an array of strings; null where they say so."""
        start = self.tokens.start[place]
        offsets, text = concatenate(self.data, start, self.tokens.stop[place])
        known = np.packbits(self.data[start] != _NULL, bitorder="little")
        buffers = [pa.py_buffer(known), pa.py_buffer(offsets), pa.py_buffer(text)]
        return pa.StringArray.from_buffers(len(place), buffers[1], buffers[2], buffers[0])


def _number(text: str | None) -> float:
    """A number, or NaN."""
    try:
        return float(text) if text is not None else float("nan")
    except ValueError:
        return float("nan")
