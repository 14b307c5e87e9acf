"""Large logs for measurements: an odometry-like pose and a JointState at 1 kHz, in each encoding."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from wmr_schemas import PoseTrack, TorqueTrack
from wmr_schemas.messages import jsonmsg, proto, ros2
from wmr_schemas.messages.codec import Codec

CHUNK_BYTES = 1 << 20
STEP_NS, START_NS = 1_000_000, 1_700_000_000_000_000_000
BLOCK = 50_000
_GEOMETRY = ros2.POSE_STAMPED[ros2.POSE_STAMPED.index("=") :]
_BAR = "=" * 80
ODOMETRY = f"""\
std_msgs/Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
{_BAR}
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
{_BAR}
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
{_BAR}
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
{_BAR}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_GEOMETRY}"""
JOINTS = ("front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel")


def signals(start: int, stop: int) -> tuple[PoseTrack, TorqueTrack]:
    """Rows start … stop − 1 of a motion in circles with noise; the rows do not depend on the division."""
    k = np.arange(start, stop)
    rng = np.random.default_rng([start, stop])
    noise = rng.normal(0, 1e-3, (7, len(k)))
    t_ns, angle = START_NS + k * STEP_NS, k * 1e-4
    pose = PoseTrack(t_ns, 3 * np.sin(angle) + noise[0], 3 - 3 * np.cos(angle) + noise[1], angle + noise[2])
    left, right = 2 + np.sin(angle * 7), 2 + np.cos(angle * 5)
    return pose, TorqueTrack(t_ns + 100_000, left + noise[3], right + noise[4], 3 + noise[5], 3.3 + noise[6])


def odometry(pose: PoseTrack) -> list[bytes]:
    """``nav_msgs/msg/Odometry``: 36 + 36 constant covariances, a twist that is noise."""
    template = ros2.string(ros2.message("odom"), "base_footprint").align(8)
    template.slot(8).slot(8).double().double().double().slot(8).slot(8)
    for value in np.diag([1e-5, 1e-5, 1e6, 1e6, 1e6, 1e-3]).ravel():
        template.double(value)
    for _ in range(6):
        template.slot(8)
    for value in np.diag([1e-5, 1e-5, 1e6, 1e6, 1e6, 1e-3]).ravel():
        template.double(value)
    half = pose.yaw_rad / 2
    twist = np.random.default_rng(int(pose.t_ns[0]) % 2**32).normal(0, 1, (6, len(pose)))
    twist[[1, 2, 3, 4]] = 0.0
    columns = (pose.x_m, pose.y_m, np.sin(half), np.cos(half), *twist)
    return template.fill(len(pose), *ros2.stamps(pose.t_ns), *columns)


def joint_states(torque: TorqueTrack) -> list[bytes]:
    """``sensor_msgs/msg/JointState`` of four wheels with position, velocity and effort."""
    template = ros2.count(ros2.message(""), len(JOINTS))
    for joint in JOINTS:
        ros2.string(template, joint)
    for _ in range(3):
        ros2.doubles(template, len(JOINTS))
    angles = np.cumsum(np.stack([torque.left_radps, torque.right_radps] * 2), axis=1) * 1e-3
    speeds, efforts = (torque.left_radps, torque.right_radps) * 2, (torque.left_nm, torque.right_nm) * 2
    return template.fill(len(torque), *ros2.stamps(torque.t_ns), *angles, *speeds, *efforts)


def messages(encoding: str, start: int, stop: int) -> tuple[list[bytes], list[bytes]]:
    """Pose and torque messages of these rows."""
    pose, torque = signals(start, stop)
    if encoding == "ros2":
        return odometry(pose), joint_states(torque)
    codec = codec_of(encoding)
    return codec.encode_pose(pose), codec.encode_torque(torque, None)


def codec_of(encoding: str) -> Codec:
    """The codec of the canonical log."""
    return {"ros2": ros2.CODEC, "protobuf": proto.CODEC, "json": jsonmsg.CODEC}[encoding]


def blocks(n_rows: int) -> Iterator[tuple[int, int]]:
    """Ranges of at most BLOCK rows."""
    return ((start, min(start + BLOCK, n_rows)) for start in range(0, n_rows, BLOCK))


def write_log(path: Path, encoding: str, n_messages: int) -> Path:
    """Write a log of ``n_messages`` messages, half of them poses, zstd in 1 MiB chunks."""
    codec = codec_of(encoding)
    names = (
        ("nav_msgs/msg/Odometry", codec.torque.name)
        if encoding == "ros2"
        else (codec.pose.name, codec.torque.name)
    )
    schemas = (ODOMETRY.encode() if encoding == "ros2" else codec.pose.definition, codec.torque.definition)
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        writer.start(codec.profile, "wmr-replay bench")
        ids = [
            writer.register_channel(
                topic, codec.message_encoding, writer.register_schema(name, codec.schema_encoding, schema)
            )
            for topic, name, schema in zip(("/odom", "/joint_states"), names, schemas, strict=True)
        ]
        for start, stop in blocks(n_messages // 2):
            pairs = zip(*messages(encoding, start, stop), strict=True)
            for k, (pose, torque) in enumerate(pairs, start):
                t_ns = START_NS + k * STEP_NS
                writer.add_message(ids[0], t_ns, pose, t_ns, k)
                writer.add_message(ids[1], t_ns + 100_000, torque, t_ns + 100_000, k)
        writer.finish()
    return path
