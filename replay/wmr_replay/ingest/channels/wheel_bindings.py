"""Bindings of wheel speeds: speeds or positions of wheels by name or field, or the twist of a robot.

Positions are handed on as they are; :mod:`wmr_replay.ingest.channels.position_steps` makes speeds of them.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wmr_replay.ingest.channels.torque_bindings import Gains, Wheels
from wmr_replay.ingest.decoding.bindings import (
    UNKNOWN,
    Binding,
    Column,
    NotConcerned,
    Recipe,
    one,
    stamp_terms,
)
from wmr_replay.ingest.decoding.layout import Layout
from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

VIRTUAL_RADIUS_M, VIRTUAL_HALF_TRACK_M = 1.0, 0.5
"""Wheels of a robot of which neither is known: a twist is turned into their speeds, and back by the same."""
Values = tuple[list[Column], list[Column]]
"""The values of the left and of the right wheels."""


class Sides(Protocol):
    """Where a message holds a value of each wheel."""

    def values(self, layout: Layout) -> Values:
        """The wheels of each side; UNKNOWN where a value is missing. Raises NotConcerned, Undecodable."""


@dataclass(frozen=True)
class JointSides:
    """An array of values beside an array of joint names."""

    wheels: Wheels
    names: str
    array: str

    def values(self, layout: Layout) -> Values:
        """The values of the joints that are wheels."""
        left, right = self.wheels.sides(layout.names(self.names))
        return self._side(layout, left), self._side(layout, right)

    def _side(self, layout: Layout, joints: Iterable[int]) -> list[Column]:
        return [_known(layout, f"{self.array}[{k}]") for k in joints]


@dataclass(frozen=True)
class InterfaceSides:
    """``control_msgs/DynamicJointState``: joints with named interfaces."""

    wheels: Wheels
    interface: str
    names: str = "joint_names"

    def values(self, layout: Layout) -> Values:
        """The interface's value of the joints that are wheels."""
        left, right = self.wheels.sides(layout.names(self.names))
        return self._side(layout, left), self._side(layout, right)

    def _side(self, layout: Layout, joints: Iterable[int]) -> list[Column]:
        columns = []
        for k in joints:
            names = layout.names(f"interface_values[{k}].interface_names")
            place = names.index(self.interface) if self.interface in names else None
            path = f"interface_values[{k}].values[{place}]"
            columns.append(UNKNOWN if place is None else _known(layout, path))
        return columns


@dataclass(frozen=True)
class FieldSides:
    """Values at dotted paths."""

    left: tuple[str, ...]
    right: tuple[str, ...]

    def values(self, layout: Layout) -> Values:
        """The fields of each side. Raises Undecodable where one is missing."""
        return [one(layout, path) for path in self.left], [one(layout, path) for path in self.right]


def _known(layout: Layout, path: str) -> Column:
    """The number at a path, or unknown."""
    leaf = layout.leaf(path)
    return UNKNOWN if leaf is None else Column(((leaf, 1.0),))


def _mean(columns: list[Column], gain: float) -> Column:
    """Gain · mean of the columns; unknown where one is."""
    if not columns or any(math.isnan(column.constant) for column in columns):
        return UNKNOWN
    share = gain / len(columns)
    terms = tuple((leaf, share * g) for column in columns for leaf, g in column.terms)
    return Column(terms, share * sum(column.constant for column in columns))


@dataclass(frozen=True)
class SpeedBinding:
    """Wheel speeds; the wheels of one side share their mean. Values: left and right in rad/s."""

    stamp: tuple[str, str] | None
    sides: Sides
    gains: Gains = (1.0, 1.0)
    made_up_radius_m: float | None = None
    """The wheel radius by which speeds of the rims were turned, where the robot's is not known."""
    n_raw: int = 2

    def recipe(self, layout: Layout) -> Recipe:
        """Left and right speed, NaN where the message has none."""
        sides = self.sides.values(layout)
        columns = tuple(_mean(side, gain) for side, gain in zip(sides, self.gains, strict=True))
        return Recipe(stamp_terms(layout, self.stamp), columns)

    def values(self, raw: F64) -> F64:
        """The raw columns."""
        return raw


@dataclass(frozen=True)
class PositionBinding:
    """Positions of ``counts`` wheels left and right, as the messages hold them.

    ``gains`` are rad per unit, ``wraps_at`` the range after which a counter begins again, and ``turn`` the
    units of one turn where positions may be kept within one; None where there is no such thing.
    """

    stamp: tuple[str, str] | None
    sides: Sides
    counts: tuple[int, int]
    gains: Gains
    wraps_at: float | None = None
    turn: float | None = None

    @property
    def n_raw(self) -> int:
        """A raw column for each wheel."""
        return sum(self.counts)

    def recipe(self, layout: Layout) -> Recipe:
        """The positions of the left wheels, then of the right ones."""
        left, right = self.sides.values(layout)
        if (len(left), len(right)) != self.counts:
            raise NotConcerned(f"it holds {len(left)} left and {len(right)} right wheels")
        return Recipe(stamp_terms(layout, self.stamp), (*left, *right))

    def values(self, raw: F64) -> F64:
        """The raw columns."""
        return raw


@dataclass(frozen=True)
class WheelPair:
    """Radius and half track by which a twist becomes wheel speeds; ``virtual`` names those made up."""

    radius_m: float = VIRTUAL_RADIUS_M
    half_track_m: float = VIRTUAL_HALF_TRACK_M
    virtual: tuple[str, ...] = ()

    @classmethod
    def of(cls, robot: RobotParameters | None) -> "WheelPair":
        """The robot's, as far as they are known."""
        robot = robot or RobotParameters()
        radius, half_track = robot.wheel_radius_m, robot.half_track_m
        known = {"wheel_radius_m": radius, "half_track_m": half_track}
        virtual = tuple(name for name, value in known.items() if value is None)
        return cls(radius or VIRTUAL_RADIUS_M, half_track or VIRTUAL_HALF_TRACK_M, virtual)

    def parameters(self) -> dict[str, float]:
        """The made-up parameters by name."""
        values = {"wheel_radius_m": self.radius_m, "half_track_m": self.half_track_m}
        return {name: values[name] for name in self.virtual}


@dataclass(frozen=True)
class TwistBinding:
    """Wheel speeds of a twist: left = (v − l·ω)/r, right = (v + l·ω)/r, times ``scale``."""

    stamp: tuple[str, str] | None
    linear: str
    angular: str
    pair: WheelPair
    scale: float = 1.0
    n_raw: int = 2

    def recipe(self, layout: Layout) -> Recipe:
        """Left and right speed as sums of the twist's fields. Raises Undecodable where one is missing."""
        ahead, turning = one(layout, self.linear), one(layout, self.angular)
        gain = self.scale / self.pair.radius_m
        across = gain * self.pair.half_track_m
        columns = (_sum(ahead, gain, turning, -across), _sum(ahead, gain, turning, across))
        return Recipe(stamp_terms(layout, self.stamp), columns)

    def values(self, raw: F64) -> F64:
        """The raw columns."""
        return raw


def _sum(a: Column, gain_a: float, b: Column, gain_b: float) -> Column:
    """gain_a·a + gain_b·b."""
    terms = [(leaf, gain * g) for column, gain in ((a, gain_a), (b, gain_b)) for leaf, g in column.terms]
    return Column(tuple(terms))


@dataclass(frozen=True)
class InputBinding:
    """Wheel speeds in the place of the torques: efforts of the same messages, or unknown ones, before them.

    Values: left and right effort, then those of ``wheels``.
    """

    wheels: Binding
    torque: Binding | None = None

    @property
    def stamp(self) -> tuple[str, str] | None:
        """Paths of the stamp."""
        return self.wheels.stamp

    @property
    def n_raw(self) -> int:
        """Raw columns of the efforts, where there are any, and of the wheels."""
        return self.wheels.n_raw + (0 if self.torque is None else 2)

    def recipe(self, layout: Layout) -> Recipe:
        """Efforts and wheels of one message; one of them may be missing. Raises NotConcerned."""
        if self.torque is None:
            return self.wheels.recipe(layout)
        efforts = self.torque.recipe(layout)
        try:
            wheels = self.wheels.recipe(layout).columns
        except NotConcerned:
            wheels = (UNKNOWN,) * self.wheels.n_raw
        return Recipe(efforts.stamp, (*efforts.columns[:2], *wheels))

    def values(self, raw: F64) -> F64:
        """Efforts in N·m, NaN without any, and the values of the wheels."""
        if self.torque is not None:
            return np.concatenate([raw[:2], self.wheels.values(raw[2:])])
        return np.concatenate([np.full((2, raw.shape[1]), np.nan), self.wheels.values(raw)])


def wheels_of(binding: Binding) -> Binding:
    """The binding of the wheel speeds alone."""
    return binding.wheels if isinstance(binding, InputBinding) else binding


def made_up(binding: Binding) -> dict[str, float]:
    """The robot's parameters that a binding of wheel speeds had to make up."""
    wheels = wheels_of(binding)
    if isinstance(wheels, SpeedBinding) and wheels.made_up_radius_m is not None:
        return {"wheel_radius_m": wheels.made_up_radius_m}
    return wheels.pair.parameters() if isinstance(wheels, TwistBinding) else {}


def read_as(binding: Binding) -> str:
    """What wheel speeds are made of, where the messages do not hold them as they are."""
    wheels = wheels_of(binding)
    if isinstance(wheels, PositionBinding):
        return "differences of positions"
    return "from a twist" if isinstance(wheels, TwistBinding) else ""
