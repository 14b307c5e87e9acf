"""The product of two moving transforms, such as map → odom (a localiser's) and odom → base_link (odometry's).

Every transform of the second edge, stamped t, gives a row. The first edge's value is held: the one with the
latest stamp ≤ t among the last KEPT ones that come before in the file. Values that are stamped or recorded
later are not used. Rows before the first value of the first edge are left out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wmr_replay.ingest.channels.transforms import (
    Edge,
    Entry,
    Rigid,
    TransformBinding,
    fixed_entries,
    multiply,
    rotate,
)
from wmr_replay.ingest.decoding.bindings import (
    UNKNOWN,
    Binding,
    Column,
    NotConcerned,
    PlacedBinding,
    Recipe,
    one,
    stamp_terms,
)
from wmr_replay.ingest.decoding.layout import Layout
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.compiled.lean import lean

KEPT = 256
_N = 7
_FIRST, _STAMP, _SECOND = slice(0, _N), slice(_N, _N + 2), slice(_N + 2, 2 * _N + 2)


@dataclass(frozen=True)
class ComposedBinding:
    """``first`` ∘ between ∘ ``second``, with what is rigidly in front of them and behind them.

    Raw columns: first's translation and rotation, its stamp's seconds and nanoseconds, second's translation
    and rotation; NaN where a message lacks one. :class:`TransformComposer` makes one transform of them.
    """

    first: Edge
    second: Edge
    stamp: tuple[str, str] | None
    before: Rigid
    between: Rigid
    after: Rigid
    n_raw: int = 2 * _N + 2

    def recipe(self, layout: Layout) -> Recipe:
        """Whichever of the two the message holds."""
        found = {entry.edge: entry for entry in reversed(fixed_entries(layout))}
        first, second = found.get(self.first), found.get(self.second)
        last = second or first
        if last is None:
            raise NotConcerned(f"no transform {' → '.join(self.first)} or {' → '.join(self.second)}")
        columns = (*_columns(layout, first), *_stamp(layout, first), *_columns(layout, second))
        return Recipe(stamp_terms(layout, last.stamp), columns)

    def values(self, raw: F64) -> F64:
        """x, y, yaw of one transform (7, n) that :class:`TransformComposer` made."""
        return TransformBinding(self.first, self.stamp, self.before, self.after).values(raw)

    def attitude(self, raw: F64) -> F64:
        """The upright axis in the body's frame and the height (4, n), of the same."""
        return TransformBinding(self.first, self.stamp, self.before, self.after).attitude(raw)


def _columns(layout: Layout, entry: Entry | None) -> tuple[Column, ...]:
    """Raw columns of one edge's translation and rotation; unknown without an entry."""
    return (UNKNOWN,) * _N if entry is None else tuple(one(layout, path) for path in entry.numbers)


def _stamp(layout: Layout, entry: Entry | None) -> tuple[Column, ...]:
    """Raw columns of the seconds and nanoseconds of an entry's stamp; 0 where they are absent."""
    if entry is None or entry.stamp is None:
        return Column(), Column()
    return tuple(Column(((leaf, 1.0),)) if (leaf := layout.leaf(path)) else Column() for path in entry.stamp)


class TransformComposer:
    """Composes the rows of :class:`ComposedBinding`, block after block in the order of the file."""

    def __init__(self, between: Rigid) -> None:
        self.between = between
        self.stamp_ns: I64 = np.empty(0, np.int64)
        self.values: F64 = np.empty((_N, 0))

    def push(self, stamp_ns: I64, raw: F64, used: Bool) -> tuple[F64, Bool]:
        """Stamps (n,) in ns, raw columns (16, n) and used rows (n,), to transforms (7, n) and which rows
        have one.
        """
        is_first, is_second = (used & ~np.isnan(raw[part][0]) for part in (_FIRST, _SECOND))
        seconds, nanoseconds = raw[_STAMP][:, is_first].astype(np.int64)
        self.stamp_ns = np.concatenate((self.stamp_ns, seconds * NS_PER_S + nanoseconds))
        self.values = np.concatenate((self.values, raw[_FIRST][:, is_first]), axis=1)
        n_seen = len(self.stamp_ns) - int(is_first.sum()) + np.cumsum(is_first)
        rows = np.flatnonzero(is_second)
        held = np.empty(len(rows), np.int64)
        _latest(self.stamp_ns, np.maximum.accumulate(self.stamp_ns), stamp_ns[rows], n_seen[rows], held)
        rows, held = rows[held >= 0], held[held >= 0]
        product = np.full((_N, len(used)), np.nan)
        product[:, rows] = _product(self.values[:, held], self.between, raw[_SECOND][:, rows])
        self.stamp_ns, self.values = self.stamp_ns[-KEPT:], self.values[:, -KEPT:]
        kept = np.zeros(len(used), np.bool_)
        kept[rows] = True
        return product, kept


@lean
def _latest(stamps: I64, highest: I64, wanted: I64, n_seen: I64, held: I64) -> Any:
    """For each wanted stamp the latest of the ``n_seen`` first stamps that is not after it, or −1.

    ``highest``: of the stamps so far; it ends the search backwards early.
    """
    for row in range(len(wanted)):
        best = -1
        for k in range(n_seen[row] - 1, max(n_seen[row] - 1 - KEPT, -1), -1):
            if best >= 0 and highest[k] <= stamps[best]:
                break
            if stamps[k] <= wanted[row] and (best < 0 or stamps[k] > stamps[best]):
                best = k
        held[row] = best


def _product(first: F64, between: Rigid, second: F64) -> F64:
    """First ∘ between ∘ second, (7, n) each: a translation and a rotation of any norm but 0."""
    turns = [part[3:] / np.sqrt((part[3:] ** 2).sum(axis=0)) for part in (first, second)]
    place = rotate(np.array(between.rotation)[:, None], second[:3]) + np.array(between.translation)[:, None]
    turn = multiply(np.array(between.rotation)[:, None], turns[1])
    return np.concatenate((first[:3] + rotate(turns[0], place), multiply(turns[0], turn)))


def composer_of(binding: Binding) -> TransformComposer | None:
    """The composer that the rows of a binding need, or None."""
    if isinstance(binding, PlacedBinding):
        return composer_of(binding.pose)
    return TransformComposer(binding.between) if isinstance(binding, ComposedBinding) else None
