"""The place of every field in a message, found once and used for all messages of the same layout.

A :class:`Layout` comes from walking one *exemplar* message in Python. Another message has the same layout
when a few of its bytes, the *skeleton* (string and sequence lengths, tags, joint names), equal the
exemplar's. Those are compared over whole columns of messages, and the fields of all that agree are gathered
with one index operation each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from wmr_replay.ingest.budgets import no_account
from wmr_schemas.arrays import F64, I64, U8, Bool

Spend = Callable[[int], None]
_PLACES_PER_FIELD = 8
"""So many places in the skeleton cost about as much as a field."""


class Undecodable(ValueError):
    """A message that its schema does not describe."""


@dataclass(frozen=True)
class Leaf:
    """A number at ``offset``, or ``count`` equal ones ``stride`` apart.

    In binary encodings ``offset`` and ``stride`` count bytes and ``dtype`` is numpy's, or ``varint`` or
    ``zigzag`` of ``stride`` bytes. In JSON ``offset`` counts the message's scalar values.
    """

    offset: int
    dtype: str
    count: int = 1
    stride: int = 1

    def item(self, k: int) -> "Leaf":
        """The leaf of the k-th number alone."""
        return Leaf(self.offset + k * self.stride, self.dtype, 1, self.stride)


@dataclass(frozen=True)
class Text:
    """A string: where it is, and its content in the exemplar."""

    offset: int
    content: str
    extent: int = 1


@dataclass
class Layout:
    """Fields of an exemplar by dotted path (``pose.position.x``; ``name[0]`` in sequences), and skeleton."""

    exemplar: bytes
    leaves: dict[str, Leaf] = field(default_factory=dict)
    texts: dict[str, Text] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    skeleton: dict[int, int] = field(default_factory=dict)
    """Offset → mask of the bits that must agree."""
    absent_is_zero: bool = False
    """Fields with their default value are left out on the wire (protobuf)."""
    spend: Spend = no_account
    """Accounts for fields, and raises OverBudget where there are too many."""

    def fix(self, start: int, stop: int, mask: int = 0xFF) -> None:
        """Add these places to the skeleton, with a mask of the bits that must agree."""
        self.spend((stop - start) // _PLACES_PER_FIELD)
        for offset in range(start, stop):
            self.skeleton[offset] = self.skeleton.get(offset, 0) | mask

    @property
    def size(self) -> int:
        """Number of its fields and places, by which its memory goes."""
        return len(self.leaves) + len(self.texts) + len(self.counts) + len(self.skeleton)

    def leaf(self, path: str) -> Leaf | None:
        """The number at ``path``; ``path[k]`` is the k-th of a row of numbers."""
        if path in self.leaves:
            return self.leaves[path]
        stem, bracket, index = path.rpartition("[")
        row = self.leaves.get(stem) if bracket else None
        return row.item(int(index[:-1])) if row is not None and int(index[:-1]) < row.count else None

    def names(self, path: str) -> list[str]:
        """The strings of a sequence, which join the skeleton. Raises Undecodable."""
        found = []
        for k in range(self.counts.get(path, 0)):
            text = self.texts.get(f"{path}[{k}]")
            if text is None:
                raise Undecodable(f"{path}[{k}] is no text")
            self.fix(text.offset, text.offset + text.extent)
            found.append(text.content)
        return found


class RowComposer(Protocol):
    """Makes rows of messages that hold only part of a row each; stateful, block after block in file order."""

    def push(self, stamp_ns: I64, raw: F64, used: Bool) -> tuple[F64, Bool]:
        """Stamps (n,), raw columns (k, n) and which rows are used, to the composed columns (m, n) and which
        rows have one.
        """


class Source(Protocol):
    """The messages of one channel in one block, in whatever encoding, as columns."""

    data: U8
    """The bytes that hold them."""

    def kinds(self, rows: I64) -> I64:
        """Lengths, or hashes of the structure: messages of different kinds never share a layout."""

    def exemplar(self, row: int) -> bytes:
        """The bytes of the message in that row."""

    def agree(self, layout: Layout, rows: I64) -> Bool:
        """Which of these messages, all of the exemplar's kind, share its layout."""

    def table(self, rows: I64, leaves: Sequence[Leaf]) -> F64:
        """(k, n) the leaves' numbers in these messages."""

    def move(self, data: U8, starts: I64) -> None:
        """The same messages in other bytes, which nothing changes any more."""

    def forget(self) -> None:
        """Give back the memory of what was decoded and can be decoded again."""

    def ints(self, rows: I64, leaf: Leaf) -> I64:
        """The leaf's number in these messages, where it is integer."""
