"""Columns against messages from independent encoders: mcap-ros2-support, google.protobuf, json, struct."""

import json
import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from mcap_ros2._dynamic import serialize_dynamic

from wmr_replay.ingest import open_log
from wmr_schemas import PoseTrack
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.messages import proto, ros2

T0 = 1_700_000_000_123_456_789
HEADER = ros2.JOINT_STATE[ros2.JOINT_STATE.index("====") :]
ODOMETRY = (
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    + (
        "=" * 80
        + "\nMSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n"
    )
    + ros2.POSE_STAMPED[ros2.POSE_STAMPED.index("====") :]
)
TRANSFORM = (
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    + (
        f"{'=' * 80}\nMSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
        "geometry_msgs/Quaternion rotation\n"
        f"{'=' * 80}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
        f"{'=' * 80}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
    )
    + HEADER
)
FOXGLOVE = (
    "builtin_interfaces/Time timestamp\nstring frame_id\ngeometry_msgs/Pose pose\n"
    + ros2.POSE_STAMPED[ros2.POSE_STAMPED.index("====") :]
)


def write(path: Path, *channels, **options) -> Path:
    """Channels: (topic, schema name, schema encoding, definition, message encoding, messages)."""
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="", library="test")
        for topic, name, schema_encoding, definition, encoding, messages in channels:
            schema = writer.register_schema(name, schema_encoding, definition) if name else 0
            channel = writer.register_channel(topic, encoding, schema)
            for k, message in enumerate(messages):
                writer.add_message(channel, T0 + k * 10_000_000, message, T0 + k * 10_000_000 + 5)
        writer.finish()
    return path


def read(path: Path, mapping: LogMapping | None = None):
    """The reader, and the joined rows of pose, torque and truth."""
    reader = open_log(path, mapping or LogMapping())
    batches = list(reader.batches())
    joined = [
        SimpleNamespace(
            t_ns=np.concatenate([getattr(b, name).t_ns for b in batches]),
            order=np.concatenate([getattr(b, name).order for b in batches]),
            values=np.concatenate([getattr(b, name).values for b in batches], axis=1),
        )
        for name in ("pose", "torque", "mode")
    ]
    return reader, *joined


def stamp(k: int) -> dict[str, int]:
    return {"sec": (T0 + k) // 10**9, "nanosec": (T0 + k) % 10**9}


def header(k: int, frame: str = "map") -> dict[str, object]:
    return {"stamp": stamp(k), "frame_id": frame}


def pose_of(x: float, y: float, yaw: float) -> dict[str, object]:
    orientation = {"x": 0.0, "y": 0.0, "z": float(np.sin(yaw / 2)), "w": float(np.cos(yaw / 2))}
    return {"position": {"x": x, "y": y, "z": 0.25}, "orientation": orientation}


TRUE_POSES = [(1.5, -2.25, 0.5), (1e-300, 3.0, -3.0), (-7.125, 0.0, 3.1), (0.0, 0.0, 0.0)]
KINDS = {
    "geometry_msgs/msg/PoseStamped": (ros2.POSE_STAMPED, lambda k, p: {"header": header(k), "pose": p}),
    "geometry_msgs/PoseStamped": (ros2.POSE_STAMPED, lambda k, p: {"header": header(k, "a" * k), "pose": p}),
    "geometry_msgs/msg/PoseWithCovarianceStamped": (
        ODOMETRY.replace("string child_frame_id\n", ""),
        lambda k, p: {"header": header(k), "pose": {"pose": p, "covariance": [0.1] * 36}},
    ),
    "nav_msgs/msg/Odometry": (
        ODOMETRY,
        lambda k, p: {
            "header": header(k, "odom"),
            "child_frame_id": "base_link"[: k + 1],
            "pose": {"pose": p, "covariance": [0.0] * 36},
        },
    ),
    "geometry_msgs/msg/TransformStamped": (
        TRANSFORM,
        lambda k, p: {
            "header": header(k),
            "child_frame_id": "",
            "transform": {"translation": p["position"], "rotation": p["orientation"]},
        },
    ),
    "foxglove_msgs/msg/PoseInFrame": (
        FOXGLOVE,
        lambda k, p: {"timestamp": stamp(k), "frame_id": "x", "pose": p},
    ),
}


@pytest.mark.parametrize("name", KINDS)
def test_every_ros2_pose_message_gives_position_yaw_and_stamp(tmp_path, name):
    definition, build = KINDS[name]
    encode = serialize_dynamic(name, definition)[name]
    messages = [encode(build(k, pose_of(*pose))) for k, pose in enumerate(TRUE_POSES)]
    path = write(tmp_path / "a.mcap", ("/p", name, "ros2msg", definition.encode(), "cdr", messages))
    reader, pose, *_ = read(path)
    assert reader.plan.pose.topic == "/p"
    assert pose.t_ns.tolist() == [T0 + k for k in range(len(TRUE_POSES))]
    np.testing.assert_allclose(pose.values.T, TRUE_POSES, rtol=0, atol=1e-15)
    assert not reader.losses.any()


def big_endian_pose(k: int, x: float, y: float, yaw: float) -> bytes:
    text = struct.pack(">iI", T0 // 10**9, T0 % 10**9 + k) + struct.pack(">I", 4) + b"map\0"
    return b"\0\0\0\0" + text + struct.pack(">7d", x, y, 0, 0, 0, np.sin(yaw / 2), np.cos(yaw / 2))


def test_big_endian_and_little_endian_messages_may_alternate(tmp_path):
    encode = serialize_dynamic("p/PoseStamped", ros2.POSE_STAMPED)["p/PoseStamped"]
    messages = []
    for k, pose in enumerate(TRUE_POSES * 5):
        little = encode({"header": header(k), "pose": pose_of(*pose)})
        messages.append(big_endian_pose(k, *pose) if k % 3 else little)
    path = write(
        tmp_path / "a.mcap", ("/p", "p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode(), "cdr", messages)
    )
    _, pose, *_ = read(path)
    np.testing.assert_allclose(pose.values.T, TRUE_POSES * 5, rtol=0, atol=1e-15)
    assert pose.t_ns.tolist() == [T0 + k for k in range(20)]


IDL = """\
================================================================================
IDL: geometry_msgs/msg/PoseStamped
module geometry_msgs { module msg { struct PoseStamped {
  std_msgs::msg::Header header; geometry_msgs::msg::Pose pose; }; }; };
================================================================================
IDL: std_msgs/msg/Header
module std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };
================================================================================
IDL: builtin_interfaces/msg/Time
module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };
================================================================================
IDL: geometry_msgs/msg/Pose
module geometry_msgs { module msg { struct Point { double x; double y; double z; }; }; };
module geometry_msgs { module msg { struct Quaternion {
  @default(value=0.0) double x; double y; double z; double w; }; }; };
module geometry_msgs { module msg { struct Pose {
  geometry_msgs::msg::Point position; geometry_msgs::msg::Quaternion orientation; }; }; };
"""


def test_idl_definitions_are_read(tmp_path):
    messages = [big_endian_pose(k, *pose) for k, pose in enumerate(TRUE_POSES)]
    path = write(
        tmp_path / "a.mcap", ("/p", "geometry_msgs/msg/PoseStamped", "ros2idl", IDL.encode(), "cdr", messages)
    )
    _, pose, *_ = read(path)
    np.testing.assert_allclose(pose.values.T, TRUE_POSES, rtol=0, atol=1e-15)


@pytest.mark.parametrize("unit", [1, 2, 4])
def test_wide_strings_are_passed_over_however_their_length_is_counted(tmp_path, unit):
    definition = "string frame\nwstring note\nwstring[] more\n" + ros2.POSE_STAMPED.partition("header\n")[2]

    def wide(text):
        return struct.pack("<I", len(text)) + b"".join(ord(c).to_bytes(unit, "little") for c in text)

    def message(x, note):
        data = struct.pack("<I4s", 4, b"map\0")
        for part in (wide(note), struct.pack("<I", 2), wide("ab"), wide("")):
            data += bytes(-len(data) % 4) + part
        return b"\0\1\0\0" + data + bytes(-len(data) % 8) + struct.pack("<7d", x, 2.0, 0, 0, 0, 0, 1)

    messages = [message(1.0, "wide"), message(2.0, "wider"), message(3.0, ""), message(4.0, "wide")]
    path = write(tmp_path / "a.mcap", ("/p", "p/Noted", "ros2msg", definition.encode(), "cdr", messages))
    reader, pose, *_ = read(path, LogMapping(pose_topic="/p"))
    np.testing.assert_array_equal(pose.values.T, [[x, 2.0, 0.0] for x in (1.0, 2.0, 3.0, 4.0)])
    assert not reader.losses.any()


def test_a_wide_string_that_fits_in_no_way_is_counted(tmp_path):
    definition = "wstring note\n" + ros2.POSE_STAMPED.partition("header\n")[2]
    good = b"\0\1\0\0" + bytes(8) + struct.pack("<7d", 1.0, 2.0, 0, 0, 0, 0, 1)
    path = write(
        tmp_path / "a.mcap",
        ("/p", "p/Noted", "ros2msg", definition.encode(), "cdr", [good, good + bytes(40)]),
    )
    reader, pose, *_ = read(path, LogMapping(pose_topic="/p"))
    assert pose.values.T.tolist() == [[1.0, 2.0, 0.0]]
    assert reader.losses.n_undecodable == 1


def joint_state(k, names, velocity, effort):
    return {"header": header(k, ""), "name": names, "position": [], "velocity": velocity, "effort": effort}


def write_joints(path: Path, states, **options) -> Path:
    """A log with one pose and these joint states."""
    encode = serialize_dynamic("s/JointState", ros2.JOINT_STATE)["s/JointState"]
    pose = serialize_dynamic("p/PoseStamped", ros2.POSE_STAMPED)["p/PoseStamped"]
    first = pose({"header": header(0), "pose": pose_of(0, 0, 0)})
    return write(
        path,
        ("/pose", "p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode(), "cdr", [first]),
        ("/js", "s/JointState", "ros2msg", ros2.JOINT_STATE.encode(), "cdr", [encode(s) for s in states]),
        **options,
    )


def test_joints_are_matched_by_name_whatever_their_order(tmp_path):
    orders = [("left_wheel_joint", "right_wheel_joint"), ("right_wheel_joint", "left_wheel_joint")]
    states = [joint_state(k, list(orders[k % 2]), [1.0, 2.0], [10.0 + k, 20.0 + k]) for k in range(8)]
    _, _, torque, _ = read(write_joints(tmp_path / "a.mcap", states))
    for k in range(8):
        left, right = (0, 1) if k % 2 == 0 else (1, 0)
        effort, speed = (10.0 + k, 20.0 + k), (1.0, 2.0)
        assert torque.values[:, k].tolist() == [effort[left], effort[right], speed[left], speed[right]]


def test_efforts_of_one_side_add_up_and_speeds_are_averaged(tmp_path):
    names = ["front_left_wheel", "arm", "rear_left_wheel", "front_right_wheel", "rear_right_wheel"]
    states = [joint_state(0, names, [1.0, 99.0, 3.0, 5.0, 9.0], [1.0, 99.0, 2.0, 4.0, 8.0])]
    _, _, torque, _ = read(write_joints(tmp_path / "a.mcap", states))
    assert torque.values[:, 0].tolist() == [3.0, 12.0, 2.0, 7.0]


def test_empty_arrays_become_nan_and_are_counted(tmp_path):
    names = ["left_wheel_joint", "right_wheel_joint"]
    states = [joint_state(0, names, [1.0, 2.0], []), joint_state(1, names, [], [3.0, 4.0])]
    reader, _, torque, _ = read(write_joints(tmp_path / "a.mcap", states))
    np.testing.assert_array_equal(torque.values.T, [[np.nan, np.nan, 1, 2], [3, 4, np.nan, np.nan]])
    assert reader.losses.n_torque_empty == 1
    assert not reader.losses.any()


def test_states_of_other_joints_on_the_same_topic_are_passed_over(tmp_path):
    wheels = ["left_wheel_joint", "right_wheel_joint"]
    states = [joint_state(0, ["arm_1"], [9.0], [9.0]), joint_state(1, wheels, [1.0, 2.0], [3.0, 4.0])] * 3
    reader, _, torque, _ = read(write_joints(tmp_path / "a.mcap", states))
    np.testing.assert_array_equal(torque.values, np.tile([[3.0], [4.0], [1.0], [2.0]], 3))
    assert reader.remarks == ["/js: 3 messages name no wheel joint"]
    assert not reader.losses.any()


def test_joints_named_by_the_mapping_win_over_the_guess(tmp_path):
    names = ["left_wheel", "right_wheel", "m1", "m2"]
    states = [joint_state(0, names, [0.0, 0.0, 3.0, 4.0], [0.0, 0.0, 1.0, 2.0])]
    mapping = LogMapping(torque_topic="/js", left_joints=("m2",), right_joints=("m1",))
    _, _, torque, _ = read(write_joints(tmp_path / "a.mcap", states), mapping)
    assert torque.values[:, 0].tolist() == [2.0, 1.0, 4.0, 3.0]


def test_messages_that_do_not_fit_their_schema_are_counted_and_do_not_stop_the_others(tmp_path):
    good = [big_endian_pose(k, *TRUE_POSES[0]) for k in range(6)]
    odd = [b"", b"\0\1\0\0", good[0][:40], b"\xff" * 90]
    messages = [good[0], odd[0], good[1], odd[1], odd[2], good[2], odd[3], good[3]]
    path = write(
        tmp_path / "a.mcap", ("/p", "p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode(), "cdr", messages)
    )
    reader, pose, *_ = read(path)
    assert pose.t_ns.tolist() == [T0 + k for k in range(4)]
    assert pose.order.tolist() == [0, 2, 5, 7]
    assert reader.losses.n_undecodable == 4
    assert reader.losses.notes == ["/p: 4 messages do not fit their schema"]


def test_a_zero_quaternion_gives_no_yaw(tmp_path):
    message = big_endian_pose(0, 1.0, 2.0, 0.0)[:-32] + bytes(32)
    path = write(
        tmp_path / "a.mcap", ("/p", "p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode(), "cdr", [message])
    )
    _, pose, *_ = read(path)
    np.testing.assert_array_equal(pose.values[:, 0], [1.0, 2.0, np.nan])


@pytest.mark.parametrize(("published", "clock"), [(5, "publish time"), (0, "log time")])
def test_without_header_stamps_the_publish_time_then_the_log_time_serves(tmp_path, published, clock):
    zero = struct.pack(">iI", 0, 0)
    messages = [m[:4] + zero + m[12:] for m in (big_endian_pose(k, *TRUE_POSES[0]) for k in range(3))]
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode())
        channel = writer.register_channel("/p", "cdr", schema)
        for k, message in enumerate(messages):
            writer.add_message(channel, T0 + k, message, published * (T0 + k))
        writer.finish()
    reader, pose, *_ = read(path)
    assert pose.t_ns.tolist() == [max(published, 1) * (T0 + k) for k in range(3)]
    assert reader.clock_notes[0].startswith(f"/p: {clock} (its first stamps are zero)")


@pytest.mark.parametrize(
    ("stamps", "clock"),
    [
        ([0, 0, 0, *range(1, 40)], "header stamp"),
        ([*range(1, 9), *range(4, 40)], "header stamp"),
        ([k // 2 + 1 for k in range(40)], "header stamp"),
        ([*[0] * 11, *range(1, 30)], "publish time (its first stamps are zero)"),
        ([7] * 40, "publish time (its first stamps stand still or run backwards)"),
        (list(range(40, 0, -1)), "publish time (its first stamps stand still or run backwards)"),
    ],
)
@pytest.mark.parametrize("chunk_size", [1, 1 << 20])
def test_the_clock_is_chosen_on_the_first_twenty_messages(tmp_path, stamps, clock, chunk_size):
    encode = serialize_dynamic("p/PoseStamped", ros2.POSE_STAMPED)["p/PoseStamped"]
    messages = [
        encode({"header": {"stamp": {"sec": k, "nanosec": 0}, "frame_id": ""}, "pose": pose_of(0, 0, 0)})
        for k in stamps
    ]
    channel = ("/p", "p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode(), "cdr", messages)
    reader, *_ = read(write(tmp_path / "a.mcap", channel, chunk_size=chunk_size))
    assert reader.clock_notes[0].startswith(f"/p: {clock}")


@pytest.mark.parametrize(("first_s", "n_left_out"), [(10**9, 3), (1, 0)])
def test_zero_among_stamps_far_from_it_is_no_stamp(tmp_path, first_s, n_left_out):
    encode = serialize_dynamic("p/PoseStamped", ros2.POSE_STAMPED)["p/PoseStamped"]
    stamps = [0, 0, *range(first_s, first_s + 38), 0]
    messages = [
        encode({"header": {"stamp": {"sec": k, "nanosec": 0}, "frame_id": ""}, "pose": pose_of(0, 0, 0)})
        for k in stamps
    ]
    channel = ("/p", "p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode(), "cdr", messages)
    reader, pose, *_ = read(write(tmp_path / "a.mcap", channel))
    assert pose.t_ns.tolist() == [k * 10**9 for k in stamps if k or not n_left_out]
    said = [remark for remark in reader.remarks if "carry no stamp" in remark]
    assert said == ([f"/p: {n_left_out} messages carry no stamp and are left out"] if n_left_out else [])


def test_the_order_of_recording_tells_whether_stamps_run_backwards(tmp_path):
    poses = ros2.CODEC.encode_pose(PoseTrack(np.arange(1, 31), *np.zeros((3, 30))))
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("p/PoseStamped", "ros2msg", ros2.POSE_STAMPED.encode())
        channel = writer.register_channel("/p", "cdr", schema)
        for k in reversed(range(30)):
            writer.add_message(channel, T0 + k, poses[k], T0 + k)
        writer.finish()
    reader, *_ = read(path)
    assert reader.clock_notes[0].startswith("/p: header stamp")


# protobuf ----------------------------------------


def protobuf_class(schema):
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.definition).file:
        pool.AddSerializedFile(file.SerializeToString())
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))


finite = st.one_of(st.just(0.0), st.floats(-1e6, 1e6))
stamps_ns = st.integers(0, 2**33 * 10**9)


@settings(max_examples=40, deadline=None)
@given(
    rows=st.lists(st.tuples(stamps_ns, finite, finite, finite, st.sampled_from(["", "m", "map"])), min_size=1)
)
def test_protobuf_poses_equal_what_googles_encoder_wrote(tmp_path_factory, rows):
    kind = protobuf_class(proto.CODEC.pose)
    messages = []
    for t_ns, x, y, yaw, frame in [(T0, 1.0, 2.0, 3.0, "map"), *rows]:
        message = kind(frame_id=frame)
        message.timestamp.seconds, message.timestamp.nanos = divmod(t_ns, 10**9)
        message.pose.position.x, message.pose.position.y = x, y
        message.pose.orientation.z, message.pose.orientation.w = np.sin(yaw), np.cos(yaw)
        messages.append(message.SerializeToString())
    schema = proto.CODEC.pose
    path = write(
        tmp_path_factory.mktemp("p") / "a.mcap",
        ("/pose", schema.name, "protobuf", schema.definition, "protobuf", messages),
    )
    reader, pose, *_ = read(path, LogMapping(clock="header"))
    assert pose.t_ns.tolist() == [T0, *(row[0] for row in rows)]
    np.testing.assert_array_equal(pose.values[:2, 1:].T, [row[1:3] for row in rows])
    angles = pose.values[2, 1:] - [2 * row[3] for row in rows]
    np.testing.assert_allclose(np.cos(angles), 1.0, atol=1e-9)
    assert not reader.losses.any()


def test_protobuf_joint_states_and_modes(tmp_path):
    state, mode, pose = (protobuf_class(s) for s in (proto.CODEC.torque, proto.CODEC.mode, proto.CODEC.pose))
    names = ["right_wheel_joint", "left_wheel_joint"]
    states = [state(name=names, velocity=[1, 2], effort=[3, 4]), state(name=names[::-1], effort=[5, 6])]
    states.append(state(name=names, velocity=[7, 8]))
    first = pose()
    first.pose.orientation.w = 1
    entries = [
        (
            topic,
            schema.name,
            "protobuf",
            schema.definition,
            "protobuf",
            [m.SerializeToString() for m in messages],
        )
        for topic, schema, messages in (
            ("/pose", proto.CODEC.pose, [first]),
            ("/js", proto.CODEC.torque, states),
            ("/ground_truth/mode", proto.CODEC.mode, [mode(mode=3), mode(), mode(mode=2)]),
        )
    ]
    reader, _, torque, truth = read(write(tmp_path / "a.mcap", *entries))
    nan = np.nan
    np.testing.assert_array_equal(torque.values.T, [[4, 3, 2, 1], [5, 6, nan, nan], [nan, nan, 8, 7]])
    assert truth.values.tolist() == [[3.0, 0.0, 2.0]]
    assert reader.losses.n_torque_empty == 1


# JSON ----------------------------------------


def json_pose(k: int, x: float, y: float, yaw: float, **more: object) -> dict[str, object]:
    return {
        "timestamp": {"sec": T0 // 10**9, "nsec": T0 % 10**9 + k},
        "frame_id": "m",
        "pose": pose_of(x, y, yaw),
    } | more


numbers = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=40, deadline=None)
@given(
    rows=st.lists(st.tuples(numbers, numbers, st.floats(-3, 3)), min_size=1, max_size=20),
    indent=st.sampled_from([None, 0, 3]),
    text=st.text(),
)
def test_json_poses_equal_what_json_wrote_to_the_last_bit(tmp_path_factory, rows, indent, text):
    messages = [json.dumps(json_pose(k, *row), indent=indent).encode() for k, row in enumerate(rows)]
    extra = json_pose(len(rows), 1.0, 2.0, 0.5, note=text, list=[1, [], {"a": None}])
    messages.append(json.dumps(extra, ensure_ascii=False).encode(errors="replace"))
    path = write(
        tmp_path_factory.mktemp("j") / "a.mcap",
        ("/pose", "foxglove.PoseInFrame", "jsonschema", b"{}", "json", messages),
    )
    reader, pose, *_ = read(path)
    assert pose.t_ns.tolist() == [T0 + k for k in range(len(messages))]
    np.testing.assert_array_equal(pose.values[:2].T, [*(row[:2] for row in rows), (1.0, 2.0)])
    assert not reader.losses.any()


def test_json_without_schema_nulls_and_changing_keys(tmp_path):
    def state(names, **arrays):
        return json.dumps({"timestamp": {"sec": 1, "nsec": 0}, "name": names} | arrays).encode()

    names = ["left_wheel_joint", "right_wheel_joint"]
    states = [
        state(names, velocity=[1, 2], effort=[3, 4e0]),
        state(names[::-1], velocity=[1, 2], effort=[3, 4]),
        state(names, effort=[None, 5]),
        b'{"timestamp": {"sec": 1',
        b"[1, 2]",
        state(names, velocity=[], effort=[]),
    ]
    poses = [json.dumps(json_pose(0, 1.0, 2.0, 0.0)).encode()]
    path = write(
        tmp_path / "a.mcap", ("/pose", "", "", b"", "json", poses), ("/js", "", "", b"", "json", states)
    )
    reader, _, torque, _ = read(path)
    nan = np.nan
    expected = [[3, 4, 1, 2], [4, 3, 2, 1], [nan, 5, nan, nan], [nan, nan, nan, nan]]
    np.testing.assert_array_equal(torque.values.T, expected)
    assert reader.losses.n_undecodable == 2
    assert reader.losses.n_torque_empty == 2


# all encodings ----------------------------------------


@pytest.mark.parametrize("chunk_size", [1, 300, 5_000, 1 << 20])
@pytest.mark.parametrize("options", [{}, {"use_chunking": False}, {"compression": CompressionType.LZ4}])
def test_rows_and_their_order_do_not_depend_on_chunking(tmp_path, chunk_size, options):
    states = [
        joint_state(k, ["left_wheel_joint", "right_wheel_joint"], [k, -k], [k / 7, 0.0]) for k in range(60)
    ]
    _, whole_pose, whole, _ = read(write_joints(tmp_path / "whole.mcap", states))
    path = write_joints(tmp_path / "cut.mcap", states, chunk_size=chunk_size, **options)
    _, pose, torque, _ = read(path)
    for a, b in ((whole_pose, pose), (whole, torque)):
        np.testing.assert_array_equal(a.t_ns, b.t_ns)
        np.testing.assert_array_equal(a.order, b.order)
        np.testing.assert_array_equal(a.values, b.values)
