"""Bindings: the fields of a message that a signal needs, and the signal's values from them.

A binding turns the layout of an exemplar into a :class:`Recipe`: each raw column is a sum of fields, the same
for every message of that layout. It raises :class:`NotConcerned` for messages that hold nothing for the
signal, such as a joint state without wheels.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wmr_replay.ingest.decoding.layout import Layout, Leaf, Undecodable
from wmr_schemas.arrays import F64


@dataclass(frozen=True)
class Column:
    """One raw column of a signal: constant + Σ gain·leaf."""

    terms: tuple[tuple[Leaf, float], ...] = ()
    constant: float = 0.0


class NotConcerned(Exception):
    """Messages of this layout hold nothing for the signal; the text says why."""


UNKNOWN = Column(constant=float("nan"))


@dataclass(frozen=True)
class Recipe:
    """The stamp, Σ factor·leaf in ns (empty: the message has none), and the raw columns."""

    stamp: tuple[tuple[Leaf, int], ...]
    columns: tuple[Column, ...]


class Binding(Protocol):
    """The fields of a channel's messages that make up one signal."""

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
    n_raw: int = 7

    def recipe(self, layout: Layout) -> Recipe:
        """x, y, the quaternion x, y, z, w, and the height, unknown where the messages have none."""
        paths = [f"{self.position}.{axis}" for axis in "xy"] + [
            f"{self.orientation}.{axis}" for axis in "xyzw"
        ]
        height = layout.leaf(f"{self.position}.z")
        columns = (
            *(one(layout, path) for path in paths),
            UNKNOWN if height is None else Column(((height, 1.0),)),
        )
        return Recipe(stamp_terms(layout, self.stamp), columns)

    def values(self, raw: F64) -> F64:
        """x, y and the quaternion's yaw."""
        values = np.empty((3, raw.shape[1]))
        values[:2], values[2] = raw[:2], yaw_of(raw[2:6])
        return values

    def attitude(self, raw: F64) -> F64:
        """The upright axis in the body's frame and the height (4, n)."""
        return np.concatenate([upright_of(raw[2:6]), raw[6:7]])


@dataclass(frozen=True)
class PlanarPoseBinding:
    """x, y and yaw at dotted paths, as numbers."""

    x: str
    y: str
    yaw: str
    stamp: tuple[str, str] | None
    n_raw: int = 3

    def recipe(self, layout: Layout) -> Recipe:
        """The fields of x, y and yaw. Raises Undecodable when one is missing."""
        columns = tuple(one(layout, path) for path in (self.x, self.y, self.yaw))
        return Recipe(stamp_terms(layout, self.stamp), columns)

    def values(self, raw: F64) -> F64:
        """The raw columns: x and y in m, yaw in rad."""
        return raw


@dataclass(frozen=True)
class PlacedBinding:
    """A pose of some point of the robot in any units, as the pose of the midpoint of the driving axle.

    measured = position_scale·position in m, yaw_gain·yaw in rad; yaw = measured − yaw_offset; position =
    measured − R(yaw)·lever arm, the measured point's place in the robot's frame (x forward, y left).
    """

    pose: Binding
    yaw_offset_rad: float
    lever_arm_m: tuple[float, float]
    position_scale: float = 1.0
    yaw_gain: float = 1.0

    @property
    def stamp(self) -> tuple[str, str] | None:
        """Paths of the stamp of the measured pose."""
        return self.pose.stamp

    @property
    def n_raw(self) -> int:
        """Number of raw columns of the measured pose."""
        return self.pose.n_raw

    def recipe(self, layout: Layout) -> Recipe:
        """The recipe of the measured pose."""
        return self.pose.recipe(layout)

    def values(self, raw: F64) -> F64:
        """x, y, yaw of the axle's midpoint."""
        x, y, measured = self.pose.values(raw)
        x, y, measured = self.position_scale * x, self.position_scale * y, self.yaw_gain * measured
        yaw, (ahead, left) = measured - self.yaw_offset_rad, self.lever_arm_m
        cos, sin = np.cos(yaw), np.sin(yaw)
        return np.stack((x - ahead * cos + left * sin, y - ahead * sin - left * cos, yaw))


def yaw_of(quaternion: F64) -> F64:
    """Yaw = atan2(2(wz + xy), w² + x² − y² − z²) of (4, n), for any norm of the quaternion but 0 (NaN)."""
    x, y, z, w = quaternion
    with np.errstate(over="ignore", invalid="ignore"):
        opposite, adjacent = w * z, w * w
        opposite += x * y
        opposite *= 2
        adjacent += x * x
        adjacent -= y * y
        adjacent -= z * z
    undirected = np.flatnonzero(adjacent == 0)
    is_null = (quaternion[:, undirected] ** 2 == 0).all(axis=0)
    adjacent[undirected[is_null]] = np.nan
    yaw: F64 = np.arctan2(opposite, adjacent)
    return yaw


def upright_of(quaternion: F64) -> F64:
    """The world's z axis in the body's frame (3, n), of quaternions (4, n) of any norm but 0 (NaN)."""
    x, y, z, w = quaternion
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        axis = np.stack((2 * (x * z - w * y), 2 * (y * z + w * x), w * w + z * z - x * x - y * y))
        return np.asarray(axis / (quaternion**2).sum(axis=0))


def attitude_of(binding: Binding, raw: F64) -> F64 | None:
    """Upright axis and height (4, n) of raw columns (n_raw, n); None for a pose that has neither."""
    if isinstance(binding, PlacedBinding):
        return attitude_of(binding.pose, raw)
    attitude = getattr(binding, "attitude", None)
    return None if attitude is None else np.asarray(attitude(raw))


@dataclass(frozen=True)
class ModeBinding:
    """The field that holds the true contact mode."""

    stamp: tuple[str, str] | None
    field: str = "mode"
    n_raw: int = 1

    def recipe(self, layout: Layout) -> Recipe:
        """The field of the mode. Raises Undecodable when it is missing."""
        return Recipe(stamp_terms(layout, self.stamp), (one(layout, self.field),))

    def values(self, raw: F64) -> F64:
        """The raw column: the mode's number."""
        return raw
