"""ROS 2 messages of the canonical log: definitions (``ros2msg``) and CDR, little-endian."""

import struct

import numpy as np

from wmr_schemas.arrays import F64, I64
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

_SEPARATOR = "=" * 80
_HEADER = f"""\
{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

POSE_STAMPED = f"""\
std_msgs/Header header
geometry_msgs/Pose pose
{_SEPARATOR}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_SEPARATOR}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_SEPARATOR}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
{_HEADER}"""

JOINT_STATE = f"""\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}"""

TWIST_STAMPED = f"""\
std_msgs/Header header
geometry_msgs/Twist twist
{_SEPARATOR}
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
{_SEPARATOR}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_HEADER}"""

CONTACT_MODE = f"""\
# Contact mode between tyre and road, held from the stamp on.
uint8 IDEAL=0
uint8 SKIDDING=1
uint8 SLIPPING=2
uint8 SKIDDING_SLIPPING=3
std_msgs/Header header
uint8 mode
{_HEADER}"""

_CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def message(frame_id: str) -> Template:
    """A message that starts with ``std_msgs/Header``."""
    template = Template(origin=len(_CDR_LITTLE_ENDIAN)).raw(_CDR_LITTLE_ENDIAN).slot(4).slot(4)
    return string(template, frame_id)


def count(template: Template, n: int) -> Template:
    """The length of a sequence or string."""
    return template.align(4).raw(struct.pack("<I", n))


def string(template: Template, text: str) -> Template:
    """A string: its length with the closing zero, its bytes, the zero."""
    data = text.encode() + b"\x00"
    return count(template, len(data)).raw(data)


def doubles(template: Template, n: int) -> Template:
    """A sequence of n doubles, one slot each; an empty one has no alignment."""
    count(template, n)
    if n:
        template.align(8)
    for _ in range(n):
        template.slot(8)
    return template


def stamps(t_ns: I64) -> tuple[np.ndarray, np.ndarray]:
    """The columns of ``builtin_interfaces/Time``."""
    sec, nanosec = split_stamp(t_ns)
    return sec.astype("<i4"), nanosec.astype("<u4")


def encode_pose(pose: PoseTrack) -> list[bytes]:
    """``geometry_msgs/msg/PoseStamped``."""
    template = message(POSE_FRAME).align(8).slot(8).slot(8).double().double().double().slot(8).slot(8)
    columns = (pose.x_m, pose.y_m, *yaw_quaternion(pose.yaw_rad))
    return template.fill(len(pose), *stamps(pose.t_ns), *(column.astype("<f8") for column in columns))


def encode_torque(torque: TorqueTrack, angles: WheelAngles | None = None) -> list[bytes]:
    """``sensor_msgs/msg/JointState``; position and velocity are empty where unknown."""
    return encode_joints(torque.t_ns, wheel_columns(torque, angles))


def encode_joints(t_ns: I64, groups: JointGroups, joints: Joints = WHEEL_JOINTS) -> list[bytes]:
    """``sensor_msgs/msg/JointState`` of the two wheels, or of other joints."""
    template = count(message(""), len(joints))
    for joint in joints:
        string(template, joint)
    for group in groups:
        doubles(template, len(group))
    columns = [column.astype("<f8") for group in groups for column in group]
    return template.fill(len(t_ns), *stamps(t_ns), *columns)


def encode_twist(t_ns: I64, v_mps: F64, yaw_rate_radps: F64) -> list[bytes]:
    """``geometry_msgs/msg/TwistStamped``."""
    template = message(ROBOT_FRAME).align(8).slot(8).double().double().double().double().slot(8)
    return template.fill(len(t_ns), *stamps(t_ns), v_mps.astype("<f8"), yaw_rate_radps.astype("<f8"))


def encode_mode(mode: ModeTrack) -> list[bytes]:
    """``wmr_msgs/msg/ContactMode``."""
    return message("").slot(1).fill(len(mode), *stamps(mode.t_ns), mode.mode)


CODEC = Codec(
    name="ros2",
    profile="ros2",
    schema_encoding="ros2msg",
    message_encoding="cdr",
    pose=MessageSchema("geometry_msgs/msg/PoseStamped", POSE_STAMPED.encode()),
    torque=MessageSchema("sensor_msgs/msg/JointState", JOINT_STATE.encode()),
    mode=MessageSchema("wmr_msgs/msg/ContactMode", CONTACT_MODE.encode()),
    encode_pose=encode_pose,
    encode_torque=encode_torque,
    encode_mode=encode_mode,
    encode_joints=encode_joints,
    twist=MessageSchema("geometry_msgs/msg/TwistStamped", TWIST_STAMPED.encode()),
    encode_twist=encode_twist,
)
