"""Bindings of wheel torques: joints by name, joints with named interfaces, or plain fields."""

from dataclasses import dataclass

from wmr_replay.ingest.channels.wheel_joints import wheel_joints
from wmr_replay.ingest.decoding.bindings import UNKNOWN, Column, NotConcerned, Recipe, one, stamp_terms
from wmr_replay.ingest.decoding.layout import Layout, Leaf
from wmr_schemas.arrays import F64

Gains = tuple[float, float]


@dataclass(frozen=True)
class Wheels:
    """Joints of each side (empty: by their names), and what a value is multiplied with, left and right."""

    left: tuple[str, ...] = ()
    right: tuple[str, ...] = ()
    torque_gains: Gains = (1.0, 1.0)
    speed_gains: Gains = (1.0, 1.0)

    def sides(self, names: list[str]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Indices of each side's joints. Raises NotConcerned."""
        found = wheel_joints(names, self.left, self.right)
        if found is None:
            wanted = ", ".join((*self.left, *self.right)) or "a left and a right wheel"
            raise NotConcerned(f"its joints are {', '.join(names) or 'unnamed'}; wanted: {wanted}")
        return found


@dataclass(frozen=True)
class TorqueBinding:
    """Joint states by name; several joints on one side add up their efforts and share a mean speed."""

    stamp: tuple[str, str] | None
    wheels: Wheels = Wheels()
    names: str = "name"
    efforts: str = "effort"
    speeds: str = "velocity"
    n_raw: int = 4

    def recipe(self, layout: Layout) -> Recipe:
        """Left and right effort, left and right velocity; NaN where the arrays do not reach."""
        sides = self.wheels.sides(layout.names(self.names))
        torques, speeds = (
            [[layout.leaf(f"{array}[{k}]") for k in side] for side in sides]
            for array in (self.efforts, self.speeds)
        )
        return wheel_recipe(layout, self.stamp, torques, speeds, self.wheels)

    def values(self, raw: F64) -> F64:
        """The raw columns: left and right torque in N·m, left and right speed in rad/s."""
        return raw


@dataclass(frozen=True)
class InterfaceBinding:
    """``control_msgs/DynamicJointState``: joints with named interfaces, ``effort`` and ``velocity``."""

    stamp: tuple[str, str] | None
    wheels: Wheels = Wheels()
    effort: str = "effort"
    velocity: str = "velocity"
    n_raw: int = 4

    def recipe(self, layout: Layout) -> Recipe:
        """Left and right effort, left and right velocity; NaN where a joint lacks the interface."""
        names = layout.names("joint_names")
        sides = self.wheels.sides(names)
        interfaces = [layout.names(f"interface_values[{k}].interface_names") for k in range(len(names))]

        def leaf(joint: int, wanted: str) -> Leaf | None:
            if wanted not in interfaces[joint]:
                return None
            return layout.leaf(f"interface_values[{joint}].values[{interfaces[joint].index(wanted)}]")

        torques, speeds = (
            [[leaf(joint, wanted) for joint in side] for side in sides]
            for wanted in (self.effort, self.velocity)
        )
        return wheel_recipe(layout, self.stamp, torques, speeds, self.wheels)

    def values(self, raw: F64) -> F64:
        """The raw columns: left and right torque in N·m, left and right speed in rad/s."""
        return raw


@dataclass(frozen=True)
class FieldTorqueBinding:
    """Torques and speeds at dotted paths; several of one side add up, speeds share their mean."""

    stamp: tuple[str, str] | None
    torques: tuple[tuple[str, ...], tuple[str, ...]]
    speeds: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    wheels: Wheels = Wheels()
    n_raw: int = 4

    def recipe(self, layout: Layout) -> Recipe:
        """Left and right torque, left and right speed. Raises Undecodable where a field is missing."""
        columns = [
            _scaled_sum([one(layout, path) for path in paths], gain)
            for paths, gain in zip(self.torques, self.wheels.torque_gains, strict=True)
        ]
        for paths, gain in zip(self.speeds, self.wheels.speed_gains, strict=True):
            parts = [one(layout, path) for path in paths]
            columns.append(_scaled_sum(parts, gain / len(parts)) if parts else UNKNOWN)
        return Recipe(stamp_terms(layout, self.stamp), tuple(columns))

    def values(self, raw: F64) -> F64:
        """The raw columns: left and right torque in N·m, left and right speed in rad/s."""
        return raw


def wheel_recipe(
    layout: Layout,
    stamp: tuple[str, str] | None,
    torques: list[list[Leaf | None]],
    speeds: list[list[Leaf | None]],
    wheels: Wheels,
) -> Recipe:
    """Sums of torques and means of speeds, left and right."""
    columns = [_side(leaves, gain) for leaves, gain in zip(torques, wheels.torque_gains, strict=True)]
    columns += [_side(leaves, g / len(leaves)) for leaves, g in zip(speeds, wheels.speed_gains, strict=True)]
    return Recipe(stamp_terms(layout, stamp), tuple(columns))


def _side(leaves: list[Leaf | None], gain: float) -> Column:
    """gain·Σ over the joints of one side."""
    found = tuple((leaf, gain) for leaf in leaves if leaf is not None)
    return Column(found) if len(found) == len(leaves) else UNKNOWN


def _scaled_sum(columns: list[Column], gain: float) -> Column:
    """Gain times the sum of columns without constants."""
    return Column(tuple((leaf, gain * g) for column in columns for leaf, g in column.terms))
