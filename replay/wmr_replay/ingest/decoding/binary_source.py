"""Binary messages as columns: skeletons compared and numbers gathered at byte offsets."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wmr_replay.ingest.decoding.layout import Layout, Leaf
from wmr_schemas.arrays import F64, I64, U8, Bool
from wmr_schemas.compiled import compiled


@compiled
def _agree(data: U8, starts: I64, offsets: I64, masks: U8, expected: U8) -> Bool:
    """Which messages equal the expected bytes at these offsets under their masks."""
    same = np.ones(len(starts), np.bool_)
    for row in range(len(starts)):
        for k in range(len(offsets)):
            if data[starts[row] + offsets[k]] & masks[k] != expected[k]:
                same[row] = False
                break
    return same


class BinarySource:
    """Messages that start at ``starts`` in ``data`` and are ``lengths`` long; a :class:`~.layout.Source`."""

    def __init__(self, data: U8, starts: I64, lengths: I64) -> None:
        self.data, self.starts, self.lengths = data, starts, lengths

    def kinds(self, rows: I64) -> I64:
        """Lengths in bytes: messages of different lengths never share a layout."""
        found: I64 = self.lengths[rows]
        return found

    def move(self, data: U8, starts: I64) -> None:
        """The same messages in other bytes, which nothing changes any more."""
        self.data, self.starts = data, starts
        self.data.flags.writeable = False

    def forget(self) -> None:
        """Nothing is decoded beforehand."""

    def exemplar(self, row: int) -> bytes:
        """The bytes of the message in that row."""
        start = self.starts[row]
        return self.data[start : start + self.lengths[row]].tobytes()

    def agree(self, layout: Layout, rows: I64) -> Bool:
        """Messages whose skeleton bytes equal the exemplar's under their masks."""
        offsets = np.fromiter(layout.skeleton.keys(), np.int64)
        masks = np.fromiter(layout.skeleton.values(), np.uint8)
        expected = np.frombuffer(layout.exemplar, np.uint8)[offsets] & masks
        same: Bool = _agree(self.data, self.starts[rows], offsets, masks, expected)
        return same

    def table(self, rows: I64, leaves: Sequence[Leaf]) -> F64:
        """(k, n) the leaves' numbers as float64."""
        numbers = np.empty((len(leaves), len(rows)))
        for k, leaf in enumerate(leaves):
            numbers[k] = self._gather(rows, leaf)
        return numbers

    def ints(self, rows: I64, leaf: Leaf) -> I64:
        """The leaf's number as int64; floats are truncated."""
        return self._gather(rows, leaf).astype(np.int64, copy=False)

    def _gather(self, rows: I64, leaf: Leaf) -> np.ndarray[Any, Any]:
        """The numbers of a leaf in these messages, in its own type."""
        places = self.starts[rows] + leaf.offset
        if leaf.dtype in {"varint", "zigzag"}:
            return self._varints(places, leaf)
        dtype = np.dtype(leaf.dtype)
        window = np.ndarray((max(len(self.data) - dtype.itemsize + 1, 0),), dtype, self.data, strides=(1,))
        return window[places]

    def _varints(self, places: I64, leaf: Leaf) -> I64:
        """Base 128, least significant group first; zigzag maps 0, 1, 2, 3 … to 0, −1, 1, −2 …"""
        value = np.zeros(len(places), np.uint64)
        for k in range(leaf.stride):
            value |= (self.data[places + k] & np.uint8(0x7F)).astype(np.uint64) << np.uint64(7 * k)
        if leaf.dtype == "zigzag":
            value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
        return value.view(np.int64)
