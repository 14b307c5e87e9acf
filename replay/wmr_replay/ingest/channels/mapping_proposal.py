"""A mapping file out of a plan: with it the same channels and fields are used again."""

from dataclasses import replace

from wmr_replay.ingest.channels.detect import Plan, Use
from wmr_replay.ingest.channels.torque_bindings import InterfaceBinding, TorqueBinding
from wmr_replay.ingest.channels.transforms import TransformBinding
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


def proposed_mapping(plan: Plan, wanted: LogMapping, robot: RobotParameters) -> LogMapping:
    """``wanted`` with everything that detection added to it: topics, fields, frames, joints, parameters."""
    found = replace(wanted, robot=robot if robot.known() else None)
    if pose := plan.uses.get("pose"):
        found = replace(found, pose_topic=pose.channel.topic, pose=_pose(pose.binding, found.pose))
    if torque := plan.uses.get("torque"):
        left, right = _joints(torque)
        found = replace(found, torque_topic=torque.channel.topic, left_joints=left, right_joints=right)
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


def _joints(use: Use) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The joints of each side by name, out of the first message that has them."""
    binding = use.binding
    if not isinstance(binding, (TorqueBinding, InterfaceBinding)):
        return (), ()
    path = binding.names if isinstance(binding, TorqueBinding) else "joint_names"
    for sample in use.samples:
        try:
            names = use.definition.layout(sample.data).names(path)
            left, right = binding.wheels.sides(names)
        except (NotConcerned, Undecodable):
            continue
        return tuple(names[k] for k in left), tuple(names[k] for k in right)
    return (), ()
