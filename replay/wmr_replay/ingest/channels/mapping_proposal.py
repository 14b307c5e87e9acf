"""A mapping file out of a plan: with it the same channels and fields are used again."""

from dataclasses import replace
from typing import TypeVar

from wmr_replay.ingest.channels.detect import Plan, Use
from wmr_replay.ingest.channels.torque_bindings import InterfaceBinding, TorqueBinding, Wheels
from wmr_replay.ingest.channels.transforms import TransformBinding
from wmr_replay.ingest.channels.wheel_bindings import (
    InputBinding,
    InterfaceSides,
    JointSides,
    PositionBinding,
    SpeedBinding,
    TwistBinding,
    wheels_of,
)
from wmr_replay.ingest.decoding.bindings import (
    Binding,
    ModeBinding,
    NotConcerned,
    PlacedBinding,
    PlanarPoseBinding,
)
from wmr_replay.ingest.decoding.bindings import PoseBinding as StructPoseBinding
from wmr_replay.ingest.decoding.layout import Undecodable
from wmr_schemas.mapping_file import LogMapping, PoseFields
from wmr_schemas.robot import RobotParameters
from wmr_schemas.wheel_fields import CommandFields, WheelSpeedFields

Fields = TypeVar("Fields", bound=CommandFields)


def proposed_mapping(plan: Plan, wanted: LogMapping, robot: RobotParameters) -> LogMapping:
    """``wanted`` with everything that detection added to it: topics, fields, frames, joints, parameters."""
    found = replace(wanted, robot=robot if robot.known() else None)
    if pose := plan.uses.get("pose"):
        found = replace(found, pose_topic=pose.channel.topic, pose=_pose(pose.binding, found.pose))
    torque, wheels, commands = (plan.uses.get(role) for role in ("torque", "wheel_speed", "command"))
    if torque is not None and isinstance(torque.binding, InputBinding):
        torque, wheels = (None if torque.binding.torque is None else torque), torque
    if torque is not None:
        left, right = _joints(torque)
        found = replace(found, torque_topic=torque.channel.topic, left_joints=left, right_joints=right)
    if wheels is not None:
        joints, fields = _joints(wheels), _wheels(wheels, found.wheel_speeds)
        topic = wheels.channel.topic
        found = replace(found, wheel_speed_topic=topic, wheel_speed_joints=joints, wheel_speeds=fields)
    if commands is not None:
        joints, sent = _joints(commands), _wheels(commands, found.commands)
        found = replace(found, command_topic=commands.channel.topic, command_joints=joints, commands=sent)
    if truth := plan.uses.get("truth"):
        path = truth.binding.field if isinstance(truth.binding, ModeBinding) else found.truth.path
        found = replace(found, truth_topic=truth.channel.topic, truth=replace(found.truth, path=path))
    return found


def _pose(binding: Binding, wanted: PoseFields) -> PoseFields:
    """``wanted`` with the pose's fields or frames that a binding uses."""
    if isinstance(binding, PlacedBinding):
        return _pose(binding.pose, wanted)
    if isinstance(binding, StructPoseBinding):
        return replace(wanted, position=binding.position, orientation=binding.orientation)
    if isinstance(binding, TransformBinding):
        parent, child = binding.edge
        return replace(wanted, parent=wanted.parent or parent, child=wanted.child or child)
    if isinstance(binding, PlanarPoseBinding):
        return replace(wanted, x=binding.x, y=binding.y, yaw=binding.yaw)
    return wanted


def _wheels(use: Use, wanted: Fields) -> Fields:
    """``wanted`` with the fields of the wheel speeds that a binding uses."""
    wheels = wheels_of(use.binding)
    if isinstance(wheels, TwistBinding):
        return replace(wanted, linear=wheels.linear, angular=wheels.angular)
    if not isinstance(wheels, (SpeedBinding, PositionBinding)):
        return wanted
    sides = wheels.sides
    if isinstance(sides, JointSides):
        wanted = replace(wanted, names=sides.names, values=sides.array)
    if isinstance(sides, InterfaceSides):
        wanted = replace(wanted, values=sides.interface)
    if isinstance(wheels, PositionBinding) and isinstance(wanted, WheelSpeedFields):
        return wanted if wanted.are_positions else replace(wanted, unit="rad")
    return wanted


def _joints(use: Use) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The joints of each side by name, out of the first message that has them."""
    found = _named_wheels(use.binding)
    if found is None:
        return (), ()
    wheels, path = found
    for sample in use.samples:
        try:
            names = use.definition.layout(sample.data).names(path)
            left, right = wheels.sides(names)
        except (NotConcerned, Undecodable):
            continue
        return tuple(names[k] for k in left), tuple(names[k] for k in right)
    return (), ()


def _named_wheels(binding: Binding) -> tuple[Wheels, str] | None:
    """How a binding finds wheels by name, and the path of the names; None for one that does not."""
    if isinstance(binding, InputBinding):
        return _named_wheels(binding.torque or binding.wheels)
    if isinstance(binding, (SpeedBinding, PositionBinding)):
        sides = binding.sides
        return (sides.wheels, sides.names) if isinstance(sides, (JointSides, InterfaceSides)) else None
    if isinstance(binding, InterfaceBinding):
        return binding.wheels, "joint_names"
    return (binding.wheels, binding.names) if isinstance(binding, TorqueBinding) else None
