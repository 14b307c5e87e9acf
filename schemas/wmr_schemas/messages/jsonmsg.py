"""JSON messages of the canonical log: ``foxglove.PoseInFrame``, ``wmr.JointState``, ``wmr.ContactMode``.

Numbers are written in their shortest exact form. A wheel signal that is unknown is an empty array, a single
unknown value is null.
"""

import json

import numpy as np
import polars as pl

from wmr_schemas.arrays import F64, I64
from wmr_schemas.messages import POSE_FRAME, ROBOT_FRAME, WHEEL_JOINTS
from wmr_schemas.messages.codec import (
    Codec,
    JointGroups,
    Joints,
    MessageSchema,
    WheelAngles,
    split_stamp,
    wheel_columns,
    yaw_quaternion,
)
from wmr_schemas.signals import ModeTrack, PoseTrack, TorqueTrack

_NUMBER = {"type": "number"}
_NUMBERS = {"type": "array", "items": {"type": ["number", "null"]}}
_STRING = {"type": "string"}
_TIME = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0}},
}


def schema(name: str, /, **properties: object) -> MessageSchema:
    """A JSON schema of an object."""
    definition = {"title": name, "type": "object", "properties": properties}
    return MessageSchema(name, json.dumps(definition).encode())


def vector_schema(*names: str) -> dict[str, object]:
    """An object of numbers."""
    return {"type": "object", "properties": dict.fromkeys(names, _NUMBER)}


def column(values: np.ndarray) -> pl.Expr:
    """A column of numbers; NaN becomes null."""
    series = pl.Series(values)
    return pl.lit(series.fill_nan(None) if series.dtype.is_float() else series)


def timestamp(t_ns: I64) -> pl.Expr:
    """Rows of {sec, nsec}."""
    sec, nsec = split_stamp(t_ns)
    return pl.struct(sec=column(sec), nsec=column(nsec))


def encode(**columns: pl.Expr) -> list[bytes]:
    """One JSON object a row."""
    row = pl.struct([values.alias(name) for name, values in columns.items()])
    return pl.DataFrame().select(text=row.struct.json_encode())["text"].cast(pl.Binary).to_list()


def encode_pose(pose: PoseTrack) -> list[bytes]:
    """``foxglove.PoseInFrame``."""
    z, w = yaw_quaternion(pose.yaw_rad)
    zero = pl.lit(0.0)
    position = pl.struct(x=column(pose.x_m), y=column(pose.y_m), z=zero)
    orientation = pl.struct(x=zero, y=zero, z=column(z), w=column(w))
    placed = pl.struct(position=position, orientation=orientation)
    return encode(timestamp=timestamp(pose.t_ns), frame_id=pl.lit(POSE_FRAME), pose=placed)


def encode_torque(torque: TorqueTrack, angles: WheelAngles | None = None) -> list[bytes]:
    """``wmr.JointState``; position and velocity are empty where unknown."""
    return encode_joints(torque.t_ns, wheel_columns(torque, angles))


def encode_joints(t_ns: I64, groups: JointGroups, joints: Joints = WHEEL_JOINTS) -> list[bytes]:
    """``wmr.JointState`` of the two wheels, or of other joints."""
    position, velocity, effort = groups
    return encode(
        timestamp=timestamp(t_ns),
        frame_id=pl.lit(""),
        name=pl.lit(pl.Series([list(joints)])),
        position=numbers(position),
        velocity=numbers(velocity),
        effort=numbers(effort),
    )


def numbers(columns: list[F64]) -> pl.Expr:
    """Rows of arrays, one element a column."""
    if not columns:
        return pl.lit(pl.Series([[]], dtype=pl.List(pl.Float64)))
    return pl.concat_list([column(values) for values in columns])


def encode_twist(t_ns: I64, v_mps: F64, yaw_rate_radps: F64) -> list[bytes]:
    """``wmr.TwistStamped``."""
    zero = pl.lit(0.0)
    linear = pl.struct(x=column(v_mps), y=zero, z=zero)
    angular = pl.struct(x=zero, y=zero, z=column(yaw_rate_radps))
    twist = pl.struct(linear=linear, angular=angular)
    return encode(timestamp=timestamp(t_ns), frame_id=pl.lit(ROBOT_FRAME), twist=twist)


def encode_mode(mode: ModeTrack) -> list[bytes]:
    """``wmr.ContactMode``."""
    return encode(timestamp=timestamp(mode.t_ns), mode=column(mode.mode))


_POSE_SCHEMA = {
    "type": "object",
    "properties": {
        "position": vector_schema("x", "y", "z"),
        "orientation": vector_schema("x", "y", "z", "w"),
    },
}
_TWIST_SCHEMA = {
    "type": "object",
    "properties": {"linear": vector_schema("x", "y", "z"), "angular": vector_schema("x", "y", "z")},
}
CODEC = Codec(
    name="json",
    profile="",
    schema_encoding="jsonschema",
    message_encoding="json",
    pose=schema("foxglove.PoseInFrame", timestamp=_TIME, frame_id=_STRING, pose=_POSE_SCHEMA),
    torque=schema(
        "wmr.JointState",
        timestamp=_TIME,
        frame_id=_STRING,
        name={"type": "array", "items": _STRING},
        position=_NUMBERS,
        velocity=_NUMBERS,
        effort=_NUMBERS,
    ),
    mode=schema("wmr.ContactMode", timestamp=_TIME, mode={"type": "integer", "minimum": 0, "maximum": 3}),
    encode_pose=encode_pose,
    encode_torque=encode_torque,
    encode_mode=encode_mode,
    encode_joints=encode_joints,
    twist=schema("wmr.TwistStamped", timestamp=_TIME, frame_id=_STRING, twist=_TWIST_SCHEMA),
    encode_twist=encode_twist,
)
