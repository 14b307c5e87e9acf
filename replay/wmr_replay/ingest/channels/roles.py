"""Tests of a channel for the roles pose, torque and true mode, by schema and content, each with a rank."""

import re

from wmr_replay.ingest.channels.candidate import Candidate, DoesNotServe
from wmr_replay.ingest.channels.frames import TRANSFORM_SCHEMAS, Frames
from wmr_replay.ingest.channels.named import COMMANDED
from wmr_replay.ingest.channels.pose_accuracy import decades_too_coarse
from wmr_replay.ingest.channels.torque_bindings import (
    FieldTorqueBinding,
    InterfaceBinding,
    TorqueBinding,
    Wheels,
)
from wmr_replay.ingest.channels.transforms import TransformBinding
from wmr_replay.ingest.decoding.bindings import (
    Binding,
    ModeBinding,
    PlacedBinding,
    PlanarPoseBinding,
    PoseBinding,
)
from wmr_replay.ingest.decoding.encodings import Definition
from wmr_schemas.mapping_file import LogMapping, PoseFields
from wmr_schemas.messages import MODE_TOPIC, POSE_TOPIC, TORQUE_TOPIC
from wmr_schemas.units import ANGLE_UNITS

POSE_SCHEMAS = ("PoseStamped", "PoseInFrame", "TransformStamped", "PoseWithCovarianceStamped", "Odometry")
"""In the order of preference."""
_POSE_FORMS = (
    ("pose.position", "pose.orientation"),
    ("pose.pose.position", "pose.pose.orientation"),
    ("transform.translation", "transform.rotation"),
    ("position", "orientation"),
    ("translation", "rotation"),
)
_STAMPS = ("header.stamp", "timestamp", "stamp", "header.timestamp", "time")
_SECONDS = (("sec", "nanosec"), ("sec", "nsec"), ("seconds", "nanos"), ("secs", "nsecs"))
_NO_MEASUREMENT = re.compile(
    r"goal|initial_?pose|target|setpoint|command|cmd|desired|reference|plan|waypoint", re.I
)
UNRELATED = "no pose, joint state or contact mode"
_OTHER_USES = {
    "Twist": "velocities, no pose",
    "TwistStamped": "velocities, no pose",
    "Imu": "rates and accelerations, no pose",
    "NavSatFix": "a position without a heading",
}

Rank = tuple[int, ...]
"""The smallest serves best."""


def stamp_paths(definition: Definition) -> tuple[str, str] | None:
    """Where the messages carry their own time."""
    for stem in _STAMPS:
        for names in _SECONDS:
            paths = f"{stem}.{names[0]}", f"{stem}.{names[1]}"
            if all(definition.has(path) for path in paths):
                return paths
    return None


def stamp_of(candidate: Candidate) -> tuple[str, str] | None:
    """Where a channel's messages carry their own time."""
    return stamp_paths(candidate.definition)


def is_odometry(candidate: Candidate, binding: Binding | None = None) -> bool:
    """Whether the pose may well have been integrated from wheel speeds, by its name."""
    if isinstance(binding, TransformBinding):
        return "odom" in binding.edge[0].lower()
    return candidate.short_name == "Odometry" or "odom" in candidate.channel.topic.lower()


def pose_role(candidate: Candidate, mapping: LogMapping, frames: Frames) -> tuple[Binding, Rank]:
    """Position and orientation; not too slow, external before odometry, not too coarse by its own covariance,
    the canonical topic, the schema.
    """
    topic, name, wanted = candidate.channel.topic, candidate.short_name, mapping.pose
    if mapping.pose_topic is None:
        schemaless = candidate.schema is None and candidate.mentions(b"orientation")
        if name not in (*POSE_SCHEMAS, *TRANSFORM_SCHEMAS) and not schemaless:
            raise DoesNotServe(_OTHER_USES.get(name, UNRELATED))
        if _NO_MEASUREMENT.search(topic):
            raise DoesNotServe("by its topic a wanted pose, not a measured one")
    binding = _pose_binding(candidate, mapping, frames)
    candidate.try_out(binding)
    kind = POSE_SCHEMAS.index(name) if name in POSE_SCHEMAS else len(POSE_SCHEMAS)
    rank = (
        candidate.is_slow,
        is_odometry(candidate, binding),
        decades_too_coarse(candidate),
        topic != POSE_TOPIC,
        kind,
        -candidate.n_messages,
    )
    return _placed(binding, wanted), rank


def _placed(binding: Binding, wanted: PoseFields) -> Binding:
    """The binding with the mapping's units and lever arm, where it gives any. Raises DoesNotServe."""
    gain = wanted.yaw_sign * ANGLE_UNITS[wanted.yaw_unit]
    if gain != 1 and not isinstance(binding, PlanarPoseBinding):
        raise DoesNotServe("yaw_unit and yaw_sign are for a pose of the fields x, y and yaw")
    if gain == 1 == wanted.position_scale and not wanted.yaw_offset_rad and not any(wanted.lever_arm_m):
        return binding
    return PlacedBinding(binding, wanted.yaw_offset_rad, wanted.lever_arm_m, wanted.position_scale, gain)


def _pose_binding(candidate: Candidate, mapping: LogMapping, frames: Frames) -> Binding:
    """The fields that the mapping names, else a transform, else the first known form."""
    wanted, definition = mapping.pose, candidate.definition
    stamp = stamp_paths(definition)
    if wanted.x and wanted.y and wanted.yaw:
        check_fields(candidate, wanted.x, wanted.y, wanted.yaw)
        return PlanarPoseBinding(wanted.x, wanted.y, wanted.yaw, stamp)
    if candidate.short_name in TRANSFORM_SCHEMAS and not wanted.position:
        alone = candidate.short_name in {"TransformStamped", "FrameTransform"}
        return frames.binding(candidate.channel.id, wanted.parent, wanted.child, alone=alone)
    forms = [(wanted.position, wanted.orientation)] if wanted.position and wanted.orientation else _POSE_FORMS
    form = next((f for f in forms if candidate.has(f"{f[0]}.x", f"{f[1]}.w")), None)
    if form is None:
        raise DoesNotServe("no position with an orientation")
    return PoseBinding(*form, stamp)


def check_fields(candidate: Candidate, *paths: str) -> None:
    """Raises DoesNotServe unless the messages have all of these fields."""
    for path in paths:
        if not candidate.has(path):
            raise DoesNotServe(f"no field {path}")


def torque_role(candidate: Candidate, mapping: LogMapping, frames: Frames) -> tuple[Binding, Rank]:
    """Joint states that name wheels; those with efforts first, then the canonical topic."""
    if mapping.torque_topic is None and not _may_have_torques(candidate):
        raise DoesNotServe(UNRELATED)
    binding = _torque_binding(candidate, mapping)
    has_effort = bool(candidate.try_out(binding).columns[0].terms)
    if not (has_effort or mapping.torque_topic) and COMMANDED.search(candidate.channel.topic):
        raise DoesNotServe("by its topic commands, no measured wheel speeds")
    return binding, (
        not has_effort,
        candidate.channel.topic != TORQUE_TOPIC,
        -candidate.n_messages,
    )


def _may_have_torques(candidate: Candidate) -> bool:
    """Whether a schema has efforts, as a cheap first test."""
    return candidate.mentions(b"effort") or candidate.short_name == "DynamicJointState"


def _torque_binding(candidate: Candidate, mapping: LogMapping) -> Binding:
    """The fields that the mapping names, else joints with interfaces, else joint states. Raises
    DoesNotServe.
    """
    wanted, stamp = mapping.torque, stamp_paths(candidate.definition)
    wheels = Wheels(mapping.left_joints, mapping.right_joints, wanted.torque_gains, wanted.speed_gains)
    if wanted.left_fields and wanted.right_fields:
        speeds = wanted.left_speed_fields, wanted.right_speed_fields
        check_fields(candidate, *wanted.left_fields, *wanted.right_fields, *speeds[0], *speeds[1])
        return FieldTorqueBinding(stamp, (wanted.left_fields, wanted.right_fields), speeds, wheels)
    if candidate.has("joint_names", "interface_values"):
        return InterfaceBinding(stamp, wheels, wanted.efforts or "effort", wanted.speeds or "velocity")
    names, efforts, speed = wanted.names or "name", wanted.efforts or "effort", wanted.speeds or "velocity"
    if not candidate.has(names, efforts):
        named = mapping.torque_topic is not None
        raise DoesNotServe(f"no field {names} with a field {efforts}" if named else UNRELATED)
    return TorqueBinding(stamp, wheels, names, efforts, speed)


def truth_role(candidate: Candidate, mapping: LogMapping, frames: Frames) -> tuple[Binding, Rank]:
    """A contact mode; the canonical topic first."""
    path = mapping.truth.path
    if mapping.truth_topic is None and not candidate.short_name.endswith("ContactMode"):
        raise DoesNotServe(UNRELATED)
    check_fields(candidate, path)
    binding = ModeBinding(stamp_paths(candidate.definition), path)
    candidate.try_out(binding)
    return binding, (candidate.channel.topic != MODE_TOPIC, -candidate.n_messages)
