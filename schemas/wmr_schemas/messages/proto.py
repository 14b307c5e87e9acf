"""Protobuf messages of the canonical log: ``foxglove.PoseInFrame``, ``wmr.JointState``, ``wmr.ContactMode``.

Every field is written, zeros included, and a stamp's varints are padded to five bytes, so that all messages
of a channel have one length and are filled in as columns. Readers accept both (a varint may carry leading
zero groups).
"""

from collections.abc import Iterable

import numpy as np
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet

from wmr_schemas.arrays import F64, I64, U8
from wmr_schemas.messages import POSE_FRAME, ROBOT_FRAME, WHEEL_JOINTS
from wmr_schemas.messages.codec import (
    Codec,
    JointGroups,
    Joints,
    MessageSchema,
    Template,
    WheelAngles,
    split_stamp,
    wheel_columns,
    yaw_quaternion,
)
from wmr_schemas.signals import ModeTrack, PoseTrack, TorqueTrack

_VARINT, _FIXED64, _BYTES = 0, 1, 2
_STAMP_VARINT_BYTES = 5

_SCALARS = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "string": FieldDescriptorProto.TYPE_STRING,
    "uint32": FieldDescriptorProto.TYPE_UINT32,
}
_TIMESTAMP = "google.protobuf.Timestamp"
_MESSAGES: dict[str, tuple[str, ...]] = {
    "foxglove.Vector3": ("double x", "double y", "double z"),
    "foxglove.Quaternion": ("double x", "double y", "double z", "double w"),
    "foxglove.Pose": ("foxglove.Vector3 position", "foxglove.Quaternion orientation"),
    "foxglove.PoseInFrame": (f"{_TIMESTAMP} timestamp", "string frame_id", "foxglove.Pose pose"),
    "wmr.JointState": (
        f"{_TIMESTAMP} timestamp",
        "string frame_id",
        "repeated string name",
        "repeated double position",
        "repeated double velocity",
        "repeated double effort",
    ),
    "wmr.Twist": ("foxglove.Vector3 linear", "foxglove.Vector3 angular"),
    "wmr.TwistStamped": (f"{_TIMESTAMP} timestamp", "string frame_id", "wmr.Twist twist"),
    "wmr.ContactMode": (f"{_TIMESTAMP} timestamp", "uint32 mode"),
}


def proto_path(message: str) -> str:
    """The .proto file that a message of ours is defined in; one message a file."""
    return message.replace(".", "/") + ".proto"


def referred(message: str) -> list[str]:
    """Other messages of ours that a message's fields refer to."""
    types = (field.split()[-2] for field in _MESSAGES[message])
    return [name for name in types if name in _MESSAGES]


def file_descriptor(message: str) -> FileDescriptorProto:
    """The descriptor of one message's file; fields are numbered in the order they are listed."""
    package, name = message.split(".")
    file = FileDescriptorProto(name=proto_path(message), package=package, syntax="proto3")
    file.dependency.extend(proto_path(other) for other in referred(message))
    if any(field.startswith(_TIMESTAMP) for field in _MESSAGES[message]):
        file.dependency.append("google/protobuf/timestamp.proto")
    descriptor = file.message_type.add(name=name)
    for number, field in enumerate(_MESSAGES[message], start=1):
        *label, kind, field_name = field.split()
        entry = descriptor.field.add(name=field_name, number=number)
        entry.label = FieldDescriptorProto.LABEL_REPEATED if label else FieldDescriptorProto.LABEL_OPTIONAL
        entry.type = _SCALARS.get(kind, FieldDescriptorProto.TYPE_MESSAGE)
        if kind not in _SCALARS:
            entry.type_name = f".{kind}"
    return file


def schema(message: str) -> MessageSchema:
    """A serialised FileDescriptorSet with the message's file last, after what it refers to."""
    files = FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    for name in dict.fromkeys(dependencies_first(message)):
        files.file.append(file_descriptor(name))
    return MessageSchema(message, files.SerializeToString(deterministic=True))


def dependencies_first(message: str) -> Iterable[str]:
    """The message after all that it refers to."""
    for other in referred(message):
        yield from dependencies_first(other)
    yield message


def key(number: int, wire_type: int) -> bytes:
    """The tag of a field numbered below 16."""
    return bytes([number << 3 | wire_type])


def nested(number: int, inner: Template) -> Template:
    """A message-typed or packed field; the inner template stays below 128 bytes."""
    outer = Template().raw(key(number, _BYTES) + bytes([len(inner.content)]))
    outer.slots = [len(outer.content) + slot for slot in inner.slots]
    return outer.raw(bytes(inner.content))


def joined(*parts: Template) -> Template:
    """The parts one after another."""
    whole = Template()
    for part in parts:
        whole.slots += [len(whole.content) + slot for slot in part.slots]
        whole.raw(bytes(part.content))
    return whole


def text(number: int, value: str) -> Template:
    """A constant string."""
    data = value.encode()
    return Template().raw(key(number, _BYTES) + bytes([len(data)]) + data)


def vector(*varies: bool) -> Template:
    """A message of doubles numbered from 1: a slot where the value varies, else 0."""
    template = Template()
    for number, varying in enumerate(varies, start=1):
        template.raw(key(number, _FIXED64))
        template = template.slot(8) if varying else template.double()
    return template


def packed(number: int, n: int) -> Template:
    """A repeated double with n elements; absent when empty."""
    values = Template()
    for _ in range(n):
        values.slot(8)
    return nested(number, values) if n else Template()


def timestamp() -> Template:
    """Field 1, ``google.protobuf.Timestamp``, with a slot for the seconds and one for the nanoseconds."""
    seconds = Template().raw(key(1, _VARINT)).slot(_STAMP_VARINT_BYTES)
    return nested(1, joined(seconds, Template().raw(key(2, _VARINT)).slot(_STAMP_VARINT_BYTES)))


def padded_varint(values: I64) -> U8:
    """Varints of exactly five bytes, (n, 5); values below 2³⁵."""
    groups = (values[:, None] >> np.arange(0, 7 * _STAMP_VARINT_BYTES, 7)) & 0x7F
    groups[:, :-1] |= 0x80
    return groups.astype(np.uint8)


def stamps(t_ns: I64) -> tuple[U8, U8]:
    """The slots of :func:`timestamp`."""
    seconds, nanoseconds = split_stamp(t_ns)
    return padded_varint(seconds), padded_varint(nanoseconds)


def encode_pose(pose: PoseTrack) -> list[bytes]:
    """``foxglove.PoseInFrame``."""
    position, orientation = vector(True, True, False), vector(False, False, True, True)
    inner = joined(nested(1, position), nested(2, orientation))
    template = joined(timestamp(), text(2, POSE_FRAME), nested(3, inner))
    columns = (pose.x_m, pose.y_m, *yaw_quaternion(pose.yaw_rad))
    return template.fill(len(pose), *stamps(pose.t_ns), *(column.astype("<f8") for column in columns))


def encode_torque(torque: TorqueTrack, angles: WheelAngles | None = None) -> list[bytes]:
    """``wmr.JointState``; position and velocity are empty where unknown."""
    return encode_joints(torque.t_ns, wheel_columns(torque, angles))


def encode_joints(t_ns: I64, groups: JointGroups, joints: Joints = WHEEL_JOINTS) -> list[bytes]:
    """``wmr.JointState`` of the two wheels, or of other joints."""
    names = [text(3, joint) for joint in joints]
    arrays = [packed(number, len(group)) for number, group in enumerate(groups, start=4)]
    columns = [column.astype("<f8") for group in groups for column in group]
    return joined(timestamp(), *names, *arrays).fill(len(t_ns), *stamps(t_ns), *columns)


def encode_twist(t_ns: I64, v_mps: F64, yaw_rate_radps: F64) -> list[bytes]:
    """``wmr.TwistStamped``."""
    linear, angular = vector(True, False, False), vector(False, False, True)
    twist = joined(nested(1, linear), nested(2, angular))
    template = joined(timestamp(), text(2, ROBOT_FRAME), nested(3, twist))
    return template.fill(len(t_ns), *stamps(t_ns), v_mps.astype("<f8"), yaw_rate_radps.astype("<f8"))


def encode_mode(mode: ModeTrack) -> list[bytes]:
    """``wmr.ContactMode``."""
    template = joined(timestamp(), Template().raw(key(2, _VARINT)).slot(1))
    return template.fill(len(mode), *stamps(mode.t_ns), mode.mode)


CODEC = Codec(
    name="protobuf",
    profile="",
    schema_encoding="protobuf",
    message_encoding="protobuf",
    pose=schema("foxglove.PoseInFrame"),
    torque=schema("wmr.JointState"),
    mode=schema("wmr.ContactMode"),
    encode_pose=encode_pose,
    encode_torque=encode_torque,
    encode_mode=encode_mode,
    encode_joints=encode_joints,
    twist=schema("wmr.TwistStamped"),
    encode_twist=encode_twist,
)
