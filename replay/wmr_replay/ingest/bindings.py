"""What a signal takes from a message: which fields, and what becomes of them.

A binding looks at the layout of an exemplar and answers with a :class:`Recipe`, sums of fields that hold
for every message of that layout, or with :class:`NotConcerned`, such as a joint state without wheels.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wmr_replay.ingest.joints import wheel_joints
from wmr_replay.ingest.layout import Layout, Leaf, Undecodable
from wmr_schemas.arrays import F64


@dataclass(frozen=True)
class Column:
    """constant + Σ gain·leaf."""

    terms: tuple[tuple[Leaf, float], ...] = ()
    constant: float = 0.0


class NotConcerned(Exception):
    """Such messages hold nothing for the signal, and why."""


UNKNOWN = Column(constant=float("nan"))


@dataclass(frozen=True)
class Recipe:
    """The stamp, Σ factor·leaf in ns (empty: the message has none), and the raw columns."""

    stamp: tuple[tuple[Leaf, int], ...]
    columns: tuple[Column, ...]


class Binding(Protocol):
    """A signal's claim on the messages of a channel."""

    @property
    def stamp(self) -> tuple[str, str] | None:
        """Paths of the stamp's seconds and nanoseconds."""

    @property
    def n_raw(self) -> int:
        """How many raw columns its recipes have."""

    def recipe(self, layout: Layout) -> Recipe:
        """The fields to gather. Raises NotConcerned, or Undecodable when a field is missing."""

    def values(self, raw: F64) -> F64:
        """Raw columns (n_raw, n) to the signal's columns (k, n)."""


def stamp_terms(layout: Layout, stamp: tuple[str, str] | None) -> tuple[tuple[Leaf, int], ...]:
    """Seconds and nanoseconds of the header's stamp, as far as the message has them."""
    if stamp is None:
        return ()
    found = ((layout.leaf(path), factor) for path, factor in zip(stamp, (1_000_000_000, 1), strict=True))
    return tuple((leaf, factor) for leaf, factor in found if leaf is not None)


def one(layout: Layout, path: str) -> Column:
    """A column that is one field. Raises Undecodable when it is missing and not merely zero."""
    leaf = layout.leaf(path)
    if leaf is not None:
        return Column(((leaf, 1.0),))
    if layout.absent_is_zero:
        return Column()
    raise Undecodable(f"{path} is missing")


@dataclass(frozen=True)
class PoseBinding:
    """Position and orientation, at dotted paths; values x, y, yaw."""

    position: str
    orientation: str
    stamp: tuple[str, str] | None
    n_raw: int = 6

    def recipe(self, layout: Layout) -> Recipe:
        """x, y and the quaternion x, y, z, w."""
        paths = [f"{self.position}.{axis}" for axis in "xy"] + [
            f"{self.orientation}.{axis}" for axis in "xyzw"
        ]
        return Recipe(stamp_terms(layout, self.stamp), tuple(one(layout, path) for path in paths))

    def values(self, raw: F64) -> F64:
        """Yaw = atan2(2(wz + xy), w² + x² − y² − z²), for any norm of the quaternion but 0 (NaN)."""
        x, y, z, w = raw[2:]
        squares = w * w, x * x, y * y, z * z
        yaw = np.arctan2(2 * (w * z + x * y), squares[0] + squares[1] - squares[2] - squares[3])
        yaw[sum(squares) == 0] = np.nan
        return np.stack((raw[0], raw[1], yaw))


@dataclass(frozen=True)
class TorqueBinding:
    """Joint states by name; several joints on one side add up their efforts and share a mean speed."""

    stamp: tuple[str, str] | None
    left: tuple[str, ...] = ()
    right: tuple[str, ...] = ()
    n_raw: int = 4

    def recipe(self, layout: Layout) -> Recipe:
        """Left and right effort, left and right velocity; NaN where the arrays do not reach."""
        names = layout.names("name")
        sides = wheel_joints(names, self.left, self.right)
        if sides is None:
            wanted = ", ".join((*self.left, *self.right)) or "a left and a right wheel"
            raise NotConcerned(f"its joints are {', '.join(names) or 'unnamed'}; wanted: {wanted}")
        efforts = tuple(side_column(layout, "effort", side, 1.0) for side in sides)
        speeds = tuple(side_column(layout, "velocity", side, 1.0 / len(side)) for side in sides)
        return Recipe(stamp_terms(layout, self.stamp), efforts + speeds)

    def values(self, raw: F64) -> F64:
        """As they are."""
        return raw


def side_column(layout: Layout, array: str, joints: tuple[int, ...], gain: float) -> Column:
    """gain·Σ over the joints of one side."""
    leaves = [layout.leaf(f"{array}[{k}]") for k in joints]
    found = tuple((leaf, gain) for leaf in leaves if leaf is not None)
    return Column(found) if len(found) == len(leaves) else UNKNOWN


@dataclass(frozen=True)
class ModeBinding:
    """The true contact mode."""

    stamp: tuple[str, str] | None
    n_raw: int = 1

    def recipe(self, layout: Layout) -> Recipe:
        """The field ``mode``."""
        return Recipe(stamp_terms(layout, self.stamp), (one(layout, "mode"),))

    def values(self, raw: F64) -> F64:
        """As it is."""
        return raw
