"""Logs in the shapes of real ones, made with independent encoders; each function says which log it copies.

The real files (see the README of the shared data) are read by the same tests where they lie beside the
project.
"""

from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer
from mcap_ros2._dynamic import serialize_dynamic

BAR = "=" * 80
TIME = f"{BAR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
HEADER = f"{BAR}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{TIME}"
VECTOR = f"{BAR}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
QUATERNION = f"{BAR}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
POSE = (
    f"{BAR}\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"
    f"{BAR}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n{QUATERNION}"
)
TWIST = (
    f"{BAR}\nMSG: geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n{VECTOR}"
)
ODOMETRY = (
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n"
    f"{BAR}\nMSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n"
    f"{BAR}\nMSG: geometry_msgs/TwistWithCovariance\ngeometry_msgs/Twist twist\nfloat64[36] covariance\n"
    f"{POSE}{TWIST}{HEADER}"
)
IMU = (
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
    f"{QUATERNION}{VECTOR}{HEADER}"
)
JOINT_STATE = (
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    f"float64[] effort\n{HEADER}"
)
T0, MS = 1_580_000_000_000_000_000, 1_000_000
WHEELS = ["wheel_right_joint", "wheel_left_joint"]
Entry = tuple[int, str, dict]
"""Log time in ns, topic, fields of the message."""


def write(path: Path, types: dict[str, tuple[str, str]], entries: list[Entry], **options) -> Path:
    """A log in ROS 2's CDR; ``types`` (name and definition by topic) in the order of the channel ids."""
    metadata = options.pop("metadata", [])
    encoders = {topic: serialize_dynamic(name, text)[name] for topic, (name, text) in types.items()}
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2", library="test")
        ids = {}
        for topic, (name, text) in types.items():
            schema = writer.register_schema(name, "ros2msg", text.encode())
            ids[topic] = writer.register_channel(topic, "cdr", schema)
        for log_ns, topic, fields in entries:
            writer.add_message(ids[topic], log_ns, encoders[topic](fields), log_ns)
        for name, content in metadata:
            writer.add_metadata(name, content)
        writer.finish()
    return path


def stamped(t_ns: int, frame: str = "") -> dict:
    sec, nanosec = divmod(int(t_ns), 10**9)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict:
    return {"x": float(x), "y": float(y), "z": float(z)}


def turned(yaw: float) -> dict:
    return vector(0.0, 0.0, np.sin(yaw / 2)) | {"w": float(np.cos(yaw / 2))}


def turtlebot(path: Path, n: int = 2741) -> Path:
    """fuse_turtlebot3: wheel odometry at 30 Hz, an IMU, joint states whose velocity and effort are empty.

    Stamps are off the log time, by 20 ms as a rule and −28 … +72 ms at most; log times repeat. The pose is
    the integral of wheel speeds, so that it obeys the nonholonomic constraint.
    """
    rng = np.random.default_rng(7)
    step_s = 1 / 30
    t_ns = T0 + (np.arange(n) * step_s * 1e9).astype(np.int64)
    t_s = np.arange(n) * step_s
    speed, turn = 0.15 + 0.07 * np.sin(0.4 * t_s), 0.5 * np.sin(0.23 * t_s)
    yaw = np.concatenate(([0.0], np.cumsum(turn[:-1] * step_s)))
    heading = yaw + turn * step_s / 2
    steps = np.stack((speed * np.cos(heading), speed * np.sin(heading))) * step_s
    x, y = np.concatenate((np.zeros((2, 1)), np.cumsum(steps[:, :-1], axis=1)), axis=1)
    offsets = np.clip(rng.normal(20 * MS, 3 * MS, n), -28 * MS, 72 * MS).astype(np.int64)
    offsets[::97], offsets[5::131] = -28 * MS, 72 * MS
    log_ns = np.maximum.accumulate(t_ns - offsets)
    entries: list[Entry] = []
    zeros = [0.0] * 36
    for k in range(n):
        at = int(log_ns[k])
        pose = {"position": vector(x[k], y[k]), "orientation": turned(yaw[k])}
        twist = {"linear": vector(speed[k]), "angular": vector(z=turn[k])}
        odometry = {
            "header": stamped(t_ns[k], "odom"),
            "child_frame_id": "base_footprint",
            "pose": {"pose": pose, "covariance": zeros},
            "twist": {"twist": twist, "covariance": zeros},
        }
        joints = {"header": stamped(t_ns[k]), "name": WHEELS, "position": [30 * x[k], 30 * x[k]]}
        entries += [(at, "/odom", odometry), (at, "/joint_states", joints | {"velocity": [], "effort": []})]
        if k % 5 == 0:
            entries.append((at, "/imu", imu(t_ns[k], turn[k])))
    types = {
        "/imu": ("sensor_msgs/msg/Imu", IMU),
        "/joint_states": ("sensor_msgs/msg/JointState", JOINT_STATE),
        "/odom": ("nav_msgs/msg/Odometry", ODOMETRY),
    }
    return write(path, types, entries, compression=CompressionType.ZSTD, chunk_size=1 << 18)


def imu(t_ns: int, rate: float) -> dict:
    return {
        "header": stamped(t_ns, "imu_link"),
        "orientation": turned(0.0),
        "orientation_covariance": [0.0] * 9,
        "angular_velocity": vector(z=rate),
        "angular_velocity_covariance": [0.0] * 9,
        "linear_acceleration": vector(z=9.81),
        "linear_acceleration_covariance": [0.0] * 9,
    }


def commands_only(path: Path) -> Path:
    """replay_testing_cmd_vel_only: wanted velocities and nothing else."""
    definition = f"std_msgs/Header header\ngeometry_msgs/Twist twist\n{TWIST}{HEADER}"
    twist = {"linear": vector(1.0), "angular": vector()}
    entries = [
        (T0 + k * 100 * MS, "/vehicle/cmd_vel", {"header": stamped(T0 + k * 100 * MS), "twist": twist})
        for k in range(5)
    ]
    return write(path, {"/vehicle/cmd_vel": ("geometry_msgs/msg/TwistStamped", definition)}, entries)


def chatter(path: Path) -> Path:
    """rosbag2_reindex and rosbag2_wbag: strings in short chunks, and two metadata records of one name."""
    entries = [(T0 + k * 500 * MS, "/chatter", {"data": f"Hello World: {k}"}) for k in range(40)]
    metadata = [("rosbag2", {"ROS_DISTRO": "rolling"}), ("rosbag2", {"serialized_metadata": "version: 9"})]
    types = {"/chatter": ("std_msgs/msg/String", "string data")}
    return write(path, types, entries, chunk_size=300, metadata=metadata)


def service_events(path: Path) -> Path:
    """rosbag2_topics_and_services: a service event whose schema holds ``---``, beside a topic."""
    definition = (
        b"service_msgs/ServiceEventInfo info\nint64[<=1] request\nint64[<=1] response\n---\nint64 sum\n"
    )
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        event = writer.register_schema("example_interfaces/srv/AddTwoInts_Event", "ros2msg", definition)
        text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        ids = [
            writer.register_channel("/add_two_ints/_service_event", "cdr", event),
            writer.register_channel("/chatter", "cdr", text),
        ]
        for k in range(6):
            writer.add_message(ids[k % 2], T0 + k, b"\0\1\0\0\1\0\0\0\0", T0 + k)
        writer.finish()
    return path


def array_messages(path: Path) -> Path:
    """rosbag2parquet_array_msgs: one Imu, and one JointState whose joints are no wheels."""
    joints = {"name": ["joint1", "joint2", "joint3"], "position": [1.0], "velocity": [2.0], "effort": [3.0]}
    entries = [(T0, "/imu", imu(T0, 0.1)), (T0 + 1, "/joint_states", {"header": stamped(T0)} | joints)]
    types = {
        "/imu": ("sensor_msgs/msg/Imu", IMU),
        "/joint_states": ("sensor_msgs/msg/JointState", JOINT_STATE),
    }
    return write(path, types, entries)


def many_types(path: Path) -> Path:
    """rosbags-rs_test_bag: two messages each of many types, a pose among them, and no Statistics record."""
    names = ("bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
    types = {f"/test/std_msgs/{name}": (f"std_msgs/msg/{name.title()}", f"{name} data") for name in names} | {
        f"/test/std_msgs/{name}_multi_array": (f"std_msgs/msg/{name.title()}MultiArray", f"{name}[] data")
        for name in ("int8", "int64", "float32", "float64")
    }
    types["/test/std_msgs/string"] = "std_msgs/msg/String", "string data"
    types["/test/geometry_msgs/pose"] = "geometry_msgs/msg/Pose", POSE.split("\n", 2)[2]
    definition = f"std_msgs/Header header\ngeometry_msgs/Pose pose\n{POSE}{HEADER}"
    types["/test/geometry_msgs/pose_stamped"] = "geometry_msgs/msg/PoseStamped", definition
    types["/test/sensor_msgs/imu"] = "sensor_msgs/msg/Imu", IMU
    entries: list[Entry] = []
    for k in range(2):
        t_ns = T0 + k * 1000 * MS
        pose = {"position": vector(1.0 + k, -2.0), "orientation": turned(0.5 * k)}
        for topic in types:
            fields: dict = {"data": [k] * 3 if "multi" in topic else "text" if "string" in topic else k}
            if topic.endswith("pose_stamped"):
                fields = {"header": stamped(t_ns, "map"), "pose": pose}
            elif topic.endswith("pose"):
                fields = pose
            elif topic.endswith("imu"):
                fields = imu(t_ns, 0.0)
            entries.append((t_ns, topic, fields))
    return write(path, types, entries, use_statistics=False)


WITHOUT_POSE = {
    commands_only: "/vehicle/cmd_vel (geometry_msgs/msg/TwistStamped): velocities, no pose",
    chatter: "/chatter (std_msgs/msg/String)",
    service_events: "/add_two_ints/_service_event (example_interfaces/srv/AddTwoInts_Event)",
    array_messages: "its joints are joint1, joint2, joint3; wanted: a left and a right wheel",
}
ALL = (turtlebot, many_types, *WITHOUT_POSE)
