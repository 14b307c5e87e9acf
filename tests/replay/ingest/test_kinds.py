"""Messages, containers and mappings beyond the canonical log, against bytes from independent code."""

import json
import struct

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer
from mcap_ros2._dynamic import serialize_dynamic
from scipy.spatial.transform import Rotation

from wmr_replay.ingest import Between, open_log
from wmr_replay.ingest.channels.mapping_proposal import proposed_mapping
from wmr_schemas import PoseTrack
from wmr_schemas.errors import ChannelNotFound, InvalidSetting, LogUnusable
from wmr_schemas.mapping_file import (
    LogMapping,
    PoseFields,
    TorqueFields,
    TruthFields,
    mapping_toml,
    read_mapping,
)
from wmr_schemas.messages import ros2

T0, STEP = 1_700_000_000_000_000_000, 10_000_000
N = 40
BAR = "=" * 80
GEOMETRY = (
    f"{BAR}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    f"{BAR}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
)
HEADER = ros2.JOINT_STATE[ros2.JOINT_STATE.index("====") :]
TF = (
    "geometry_msgs/TransformStamped[] transforms\n"
    f"{BAR}\nMSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n"
    f"{BAR}\nMSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
    f"geometry_msgs/Quaternion rotation\n{GEOMETRY}{HEADER}"
)
DYNAMIC = (
    "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
    f"{BAR}\nMSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n{HEADER}"
)


def write(path, *channels, step_ns=STEP, **options):
    """Channels: (topic, schema name, schema encoding, definition, message encoding, messages)."""
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="", library="test")
        ids = []
        for topic, name, schema_encoding, definition, encoding, _ in channels:
            schema = writer.register_schema(name, schema_encoding, definition.encode()) if name else 0
            ids.append(writer.register_channel(topic, encoding, schema))
        rows = [
            (T0 + k * step_ns, i, message)
            for i, channel in enumerate(channels)
            for k, message in enumerate(channel[5])
        ]
        for log_ns, i, message in sorted(rows, key=lambda row: row[:2]):
            writer.add_message(ids[i], log_ns, message, log_ns + 5)
        writer.finish()
    return path


def columns(reader, signal):
    batches = [getattr(batch, signal) for batch in reader.batches()]
    return np.concatenate([b.t_ns for b in batches]), np.concatenate([b.values for b in batches], axis=1)


def stamp(k):
    return {"sec": (T0 + k * STEP) // 10**9, "nanosec": (T0 + k * STEP) % 10**9}


def transform(k, parent, child, place, turn):
    x, y, z, w = turn.as_quat()
    return {
        "header": {"stamp": stamp(k), "frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", place, strict=True)),
            "rotation": {"x": x, "y": y, "z": z, "w": w},
        },
    }


def tf_channel(topic, messages):
    encode = serialize_dynamic("tf2_msgs/msg/TFMessage", TF)["tf2_msgs/msg/TFMessage"]
    content = [encode({"transforms": list(message)}) for message in messages]
    return topic, "tf2_msgs/msg/TFMessage", "ros2msg", TF, "cdr", content


def moving(k):
    return np.array([0.1 * k, np.sin(k), 0.2]), Rotation.from_euler("ZYX", [0.05 * k, 0.1, -0.2])


def tf_log(tmp_path):
    """/tf holds odom → base beside an arm and, in every third message, nothing of the base."""
    mount = np.array([0.3, -0.1, 0.5]), Rotation.from_euler("ZYX", [0.4, 0.0, 0.1])
    origin = np.array([5.0, 6.0, 0.0]), Rotation.from_euler("Z", 1.2)
    arm = Rotation.identity()
    dynamic = [
        [transform(k, "base_link", "arm", (k, 0, 0), arm)]
        + ([] if k % 3 == 2 else [transform(k, "odom", "base_link", *moving(k))])
        for k in range(N)
    ]
    static = [[transform(0, "map", "odom", *origin), transform(0, "base_link", "tracker", *mount)]]
    path = write(tmp_path / "tf.mcap", tf_channel("/tf", dynamic), tf_channel("/tf_static", static))
    return path, origin, mount


def test_a_transform_is_found_by_its_frames_among_others(tmp_path):
    path, _, _ = tf_log(tmp_path)
    reader = open_log(path)
    assert reader.pose_is_odometry
    t_ns, values = columns(reader, "pose")
    kept = [k for k in range(N) if k % 3 != 2]
    assert t_ns.tolist() == [T0 + k * STEP for k in kept]
    yaws = [moving(k)[1].as_euler("ZYX")[0] for k in kept]
    np.testing.assert_allclose(values, [[0.1 * k for k in kept], np.sin(kept), yaws], atol=1e-12)


def test_transforms_are_composed_with_static_ones_on_both_sides(tmp_path):
    path, origin, mount = tf_log(tmp_path)
    mapping = LogMapping(pose_topic="/tf", pose=PoseFields(parent="map", child="tracker"))
    _, values = columns(open_log(path, mapping), "pose")
    for column, k in enumerate(k for k in range(N) if k % 3 != 2):
        place, turn = moving(k)
        expected = origin[0] + origin[1].apply(place + turn.apply(mount[0]))
        yaw = (origin[1] * turn * mount[1]).as_euler("ZYX")[0]
        np.testing.assert_allclose(values[:, column], [*expected[:2], yaw], atol=1e-12)


def test_frames_that_no_moving_transforms_join_are_refused(tmp_path):
    path, _, _ = tf_log(tmp_path)
    mapping = LogMapping(pose_topic="/tf", pose=PoseFields(parent="map", child="hand"))
    with pytest.raises(ChannelNotFound, match="no one or two moving transforms from map to hand; it moves"):
        open_log(path, mapping)


def localised(tmp_path, n=40, every=7, ahead=3):
    """A localiser's map → odom, now and then and stamped ahead; odom → base_link always, late at times."""
    mount = np.array([0.3, -0.1, 0.5]), Rotation.from_euler("ZYX", [0.4, 0.0, 0.1])
    rng = np.random.default_rng(5)
    drift = {
        k: (rng.normal(size=3), Rotation.from_euler("ZYX", rng.normal(size=3))) for k in range(0, n, every)
    }
    stamps = list(range(n))
    stamps[20], stamps[21] = 21, 20
    messages, expected, told = [], [], {}
    for k, at in enumerate(stamps):
        if k in drift and k:
            told[k + ahead] = drift[k]
            messages.append([transform(k + ahead, "map", "odom", *drift[k])])
        messages.append([transform(at, "odom", "base_link", *moving(at))])
        known = [j for j in told if j <= at]
        if known:
            place, turn = moving(at)
            first = told[max(known)]
            whole = first[0] + first[1].apply(place + turn.apply(mount[0]))
            expected.append((T0 + at * STEP, *whole[:2], (first[1] * turn * mount[1]).as_euler("ZYX")[0]))
    static = [[transform(0, "base_link", "tracker", *mount)]]
    return messages, static, expected


@pytest.mark.parametrize("chunk_size", [1, 3000, 1 << 20])
def test_two_moving_transforms_are_composed_with_what_was_known_by_the_stamp(tmp_path, chunk_size):
    messages, static, expected = localised(tmp_path)
    channels = tf_channel("/tf", messages), tf_channel("/tf_static", static)
    path = write(tmp_path / "tf.mcap", *channels, chunk_size=chunk_size)
    mapping = LogMapping(pose_topic="/tf", pose=PoseFields(parent="map", child="tracker"))
    reader = open_log(path, mapping)
    t_ns, values = columns(reader, "pose")
    assert not reader.pose_is_odometry
    assert t_ns.tolist() == [row[0] for row in expected]
    np.testing.assert_allclose(values.T[:, :2], [row[1:3] for row in expected], atol=1e-12)
    np.testing.assert_allclose(np.cos(values[2] - [row[3] for row in expected]), 1.0, atol=1e-12)


def test_of_one_message_with_both_transforms_both_are_taken(tmp_path):
    far = np.array([10.0, 0.0, 0.0]), Rotation.from_euler("Z", np.pi / 2)
    messages = [
        [transform(k, "odom", "base_link", *moving(k)), transform(k, "map", "odom", *far)] for k in range(N)
    ]
    path = write(tmp_path / "tf.mcap", tf_channel("/tf", messages))
    mapping = LogMapping(pose_topic="/tf", pose=PoseFields(parent="map", child="base_link"))
    _, values = columns(open_log(path, mapping), "pose")
    np.testing.assert_allclose(values[0], 10.0 - np.sin(range(N)), atol=1e-12)
    np.testing.assert_allclose(values[1], 0.1 * np.arange(N), atol=1e-12)


def test_foxglove_transforms_in_json_without_schema_serve(tmp_path):
    messages = [
        json.dumps({
            "transforms": [{
                "timestamp": {"sec": stamp(k)["sec"], "nsec": stamp(k)["nanosec"]},
                "parent_frame_id": "map",
                "child_frame_id": "base_link",
                "translation": {"x": k, "y": -k, "z": 0},
                "rotation": {"x": 0, "y": 0, "z": np.sin(0.1), "w": np.cos(0.1)},
            }]
        }).encode()
        for k in range(N)
    ]  # fmt: skip
    channel = ("/tf", "foxglove.FrameTransforms", "jsonschema", "{}", "json", messages)
    t_ns, values = columns(open_log(write(tmp_path / "a.mcap", channel)), "pose")
    assert t_ns.tolist() == [T0 + k * STEP for k in range(N)]
    np.testing.assert_allclose(values, [np.arange(N), -np.arange(N), np.full(N, 0.2)], atol=1e-12)


QUATERNION = GEOMETRY[GEOMETRY.index(BAR, 1) :]
ROS1_ODOMETRY = (
    "Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    f"{BAR}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    f"{BAR}\nMSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n"
    f"{BAR}\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"
    f"{BAR}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n{QUATERNION}"
)


def test_ros_1_messages_are_read_without_alignment(tmp_path):
    def message(k):
        head = struct.pack("<IIII", k, stamp(k)["sec"], stamp(k)["nanosec"], 4) + b"odom"
        head += struct.pack("<I", 9) + b"base_link"
        return head + struct.pack("<7d", k, 2 * k, 0, 0, 0, np.sin(0.3), np.cos(0.3)) + bytes(8 * 36)

    channel = ("/odom", "nav_msgs/Odometry", "ros1msg", ROS1_ODOMETRY, "ros1", [message(k) for k in range(N)])
    t_ns, values = columns(open_log(write(tmp_path / "a.mcap", channel)), "pose")
    assert t_ns.tolist() == [T0 + k * STEP for k in range(N)]
    np.testing.assert_allclose(values, [np.arange(N), 2 * np.arange(N), np.full(N, 0.6)], atol=1e-12)


def test_interfaces_of_joints_are_found_by_name(tmp_path):
    encode = serialize_dynamic("control_msgs/msg/DynamicJointState", DYNAMIC)[
        "control_msgs/msg/DynamicJointState"
    ]
    messages = [
        encode({
            "header": {"stamp": stamp(k), "frame_id": ""},
            "joint_names": ["imu", "right_wheel_joint", "left_wheel_joint"],
            "interface_values": [
                {"interface_names": ["temperature"], "values": [20.0]},
                {"interface_names": ["position", "effort", "velocity"], "values": [0.0, 2.0 * k, 5.0]},
                {"interface_names": ["effort", "velocity"], "values": [1.0 * k, 4.0]},
            ],
        })
        for k in range(N)
    ]  # fmt: skip
    channel = ("/dyn", "control_msgs/msg/DynamicJointState", "ros2msg", DYNAMIC, "cdr", messages)
    path = write(tmp_path / "a.mcap", channel)
    _, values = columns(open_log(path, need_pose=False), "torque")
    k = np.arange(N)
    assert values.tolist() == [(1.0 * k).tolist(), (2.0 * k).tolist(), [4.0] * N, [5.0] * N]


MOTORS = "builtin_interfaces/Time stamp\nfloat32[4] current\nfloat64 heading\nfloat64[2] place\n" + (
    f"{BAR}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)


def motors_log(tmp_path):
    def message(k):
        return (
            b"\0\1\0\0" + struct.pack("<iI4f", stamp(k)["sec"], stamp(k)["nanosec"], k, 2, 3, 4)
            + struct.pack("<3d", 0.1 * k, k, -k)
        )  # fmt: skip

    channel = ("/motors", "my_msgs/msg/Motors", "ros2msg", MOTORS, "cdr", [message(k) for k in range(N)])
    other = ("/state", *channel[1:])
    return write(tmp_path / "motors.mcap", channel, other)


def test_currents_become_torques_by_constant_ratio_and_sign(tmp_path):
    fields = TorqueFields(
        left_fields=("current[0]", "current[1]"),
        right_fields=("current[2]",),
        right_sign=-1.0,
        torque_constant_nm_per_a=0.05,
        gear_ratio=20.0,
    )
    mapping = LogMapping(torque_topic="/motors", torque=fields)
    t_ns, values = columns(open_log(motors_log(tmp_path), mapping, need_pose=False), "torque")
    assert t_ns.tolist() == [T0 + k * STEP for k in range(N)]
    np.testing.assert_allclose(values[:2], [np.arange(N) + 2.0, np.full(N, -3.0)])
    assert np.isnan(values[2:]).all()


def test_a_pose_of_plain_numbers_is_moved_to_the_axle(tmp_path):
    fields = PoseFields(
        x="place[0]", y="place[1]", yaw="heading", yaw_offset_rad=0.3, lever_arm_m=(0.5, -0.2)
    )
    mapping = LogMapping(pose_topic="/state", pose=fields)
    _, values = columns(open_log(motors_log(tmp_path), mapping), "pose")
    k = np.arange(N)
    yaw = 0.1 * k - 0.3
    lever = Rotation.from_euler("Z", yaw[:, None]).apply([0.5, -0.2, 0.0])
    np.testing.assert_allclose(values, [k - lever[:, 0], -k - lever[:, 1], yaw], atol=1e-12)


def test_torque_and_speed_have_scales_units_and_signs_of_their_own(tmp_path):
    fields = TorqueFields(
        left_fields=("current[0]", "current[1]"),
        right_fields=("current[2]",),
        left_speed_fields=("place[0]",),
        right_speed_fields=("place[1]",),
        left_sign=-1.0,
        left_speed_sign=1.0,
        right_speed_sign=-1.0,
        torque_scale=0.001,
        torque_constant_nm_per_a=0.05,
        gear_ratio=20.0,
        speed_scale=1 / 7,
        speed_unit="rpm",
        speeds_before_gear=True,
    )
    mapping = LogMapping(torque_topic="/motors", torque=fields)
    _, values = columns(open_log(motors_log(tmp_path), mapping, need_pose=False), "torque")
    k = np.arange(N)
    np.testing.assert_allclose(values[:2], [-0.001 * (k + 2.0), np.full(N, 0.003)])
    turns_per_s = k / 7 / 60 / 20
    np.testing.assert_allclose(values[2:], np.tile(turns_per_s * 2 * np.pi, (2, 1)), atol=1e-15)


def test_a_position_in_millimetres_and_a_clockwise_heading_in_degrees(tmp_path):
    fields = PoseFields(
        x="place[0]",
        y="place[1]",
        yaw="heading",
        position_scale=0.001,
        yaw_unit="deg",
        yaw_sign=-1.0,
        yaw_offset_rad=-np.pi / 2,
    )
    _, values = columns(open_log(motors_log(tmp_path), LogMapping(pose_topic="/state", pose=fields)), "pose")
    k = np.arange(N)
    np.testing.assert_allclose(values, [k / 1000, -k / 1000, np.pi / 2 - np.deg2rad(0.1 * k)], atol=1e-12)


def test_a_unit_of_yaw_does_not_go_with_a_quaternion(tmp_path):
    path = write(tmp_path / "a.mcap", pose_channel(REGULAR))
    with pytest.raises(ChannelNotFound, match="yaw_unit and yaw_sign are for a pose of the fields"):
        open_log(path, LogMapping(pose_topic="/pose", pose=PoseFields(yaw_unit="deg")))


def test_a_field_that_is_not_there_is_refused_by_name(tmp_path):
    mapping = LogMapping(pose_topic="/state", pose=PoseFields(x="place[0]", y="place[1]", yaw="direction"))
    with pytest.raises(ChannelNotFound, match="no field direction"):
        open_log(motors_log(tmp_path), mapping)


@pytest.mark.parametrize(("clock", "offset_ns"), [("publish", 5), ("log", 0)])
def test_the_clock_that_is_named_is_used(tmp_path, clock, offset_ns):
    fields = PoseFields(x="place[0]", y="place[1]", yaw="heading")
    mapping = LogMapping(pose_topic="/state", pose=fields, clock=clock)
    t_ns, _ = columns(open_log(motors_log(tmp_path), mapping), "pose")
    assert t_ns.tolist() == [T0 + k * STEP + offset_ns for k in range(N)]


def pose_channel(stamps, topic="/pose"):
    zeros = np.zeros(1)
    messages = [
        m for t in stamps for m in ros2.CODEC.encode_pose(PoseTrack(np.array([t]), zeros, zeros, zeros))
    ]
    schema = ros2.CODEC.pose
    return topic, schema.name, "ros2msg", schema.definition.decode(), "cdr", messages


def test_irregular_stamps_are_counted_and_none_is_dropped(tmp_path):
    steps = [10, 10, 0, 10, -30, 10, 10, 200, 10, 10, 0, 10, 10]
    stamps = (T0 + np.cumsum(steps) * 1_000_000).tolist()
    reader = open_log(write(tmp_path / "a.mcap", pose_channel(stamps)))
    t_ns, _ = columns(reader, "pose")
    assert t_ns.tolist() == stamps
    found = reader.clocks["pose"].steps
    assert (found.n_duplicate, found.n_backward, found.n_gaps) == (2, 1, 1)
    assert (found.furthest_back_s, found.longest_s) == (0.03, 0.19)  # from 30 to 220 ms
    assert "2 stamps repeat the one before; 1 run backwards, by 0.03 s at most" in reader.stamp_notes[0]


def test_the_usual_step_and_the_gaps_of_a_shuffled_log_are_those_of_its_order_in_time(tmp_path):
    rng, late_ns = np.random.default_rng(3), 50 * STEP
    t_ns = T0 + np.arange(200) * STEP + np.repeat([0, late_ns], 100)
    shuffled = np.concatenate([rng.permutation(part) for part in np.split(t_ns, 5)])
    reader = open_log(write(tmp_path / "a.mcap", pose_channel(shuffled.tolist()), chunk_size=2000))
    for _ in reader.batches():
        pass
    found = reader.clocks["pose"].steps
    assert found.usual_ns == STEP
    assert (found.n_gaps, found.longest_s, found.jitter_s) == (1, 0.51, 0.0)
    backward = np.diff(shuffled)[np.diff(shuffled) < 0]
    assert (found.n_backward, found.furthest_back_s) == (len(backward), -backward.min() / 1e9)


REGULAR = [T0 + k * STEP for k in range(N)]


@pytest.mark.parametrize("options", [{"chunk_size": 400}, {"use_chunking": False}, {"use_statistics": False}])
@pytest.mark.parametrize(
    ("between", "first", "last"),
    [
        (Between("0.1", "0.2"), 10, 20),
        (Between(str(T0 + 5 * STEP), None), 5, N - 1),
        (Between(None, "2023-11-14T22:13:20.07"), 0, 7),
        (Between("1700000000.3", "1700000000.39+"[:-1]), 30, 39),
    ],
)
def test_start_and_end_cut_by_log_time(tmp_path, options, between, first, last):
    path = write(tmp_path / "a.mcap", pose_channel(REGULAR), **options)
    t_ns, _ = columns(open_log(path, between=between), "pose")
    assert t_ns.tolist() == REGULAR[first : last + 1]


def test_times_that_make_no_sense_are_refused(tmp_path):
    path = write(tmp_path / "a.mcap", pose_channel(REGULAR))
    with pytest.raises(InvalidSetting, match="'noon' is no time"):
        open_log(path, between=Between("noon"))
    with pytest.raises(InvalidSetting, match=r"the end \(1\) lies before the start \(2\)"):
        open_log(path, between=Between("2", "1"))


def spans_read(reader, monkeypatch):
    """Offsets of the chunks that are opened while the batches are read."""
    from wmr_replay.ingest import reading

    opened, load = [], reading.load
    monkeypatch.setattr(
        reading, "load", lambda file, span, space: opened.append(span.offset) or load(file, span, space)
    )
    for _ in reader.batches():
        pass
    return sorted(opened)


def test_only_chunks_with_wanted_channels_within_the_time_are_opened(tmp_path, monkeypatch):
    text = ("/chat", "std_msgs/msg/String", "ros2msg", "string data", "cdr", [b"\0\1\0\0" + bytes(600)] * N)
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=500, compression=CompressionType.NONE)
        writer.start()
        ids = []
        for topic, name, schema_encoding, definition, encoding, _ in (pose_channel(REGULAR), text):
            schema = writer.register_schema(name, schema_encoding, definition.encode())
            ids.append(writer.register_channel(topic, encoding, schema))
        for channel, content, start in ((ids[1], text[5], 0), (ids[0], pose_channel(REGULAR)[5], N * STEP)):
            for k, message in enumerate(content):
                writer.add_message(channel, T0 + start + k * STEP, message, T0)
        writer.finish()
    reader = open_log(path)
    with_pose = [s.offset for s in reader.survey.spans if ids[0] in s.counts]
    assert 0 < len(with_pose) < len(reader.survey.spans) / 2
    assert spans_read(reader, monkeypatch) == with_pose
    late = open_log(path, between=Between(str(2 * N * STEP / 1e9 - 0.015)))
    assert spans_read(late, monkeypatch) == with_pose[-1:]


def test_an_index_that_does_not_add_up_is_not_believed(tmp_path, monkeypatch):
    path = write(tmp_path / "a.mcap", pose_channel(REGULAR), chunk_size=400)
    reader = open_log(path, between=Between("0.3"))
    reader.survey.statistics = {1: N + 1}
    assert len(spans_read(reader, monkeypatch)) == len(reader.survey.spans)


def test_the_files_of_a_rosbag2_directory_are_one_log(tmp_path):
    bag = tmp_path / "bag"
    bag.mkdir()
    chat = ("/chat", "std_msgs/msg/String", "ros2msg", "string data", "cdr", [b"\0\1\0\0\1\0\0\0\0"])
    write(bag / "bag_10.mcap", pose_channel(REGULAR[20:]))
    write(bag / "bag_9.mcap", chat, pose_channel(REGULAR[:20]))
    for listed in (False, True):
        if listed:
            (bag / "metadata.yaml").write_text(
                "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n"
                "    - bag_9.mcap\n    - bag_10.mcap\n  duration:\n    nanoseconds: 1\n"
            )
        reader = open_log(bag)
        t_ns, _ = columns(reader, "pose")
        assert t_ns.tolist() == REGULAR
        assert [c.topic for c in reader.survey.catalogue.channels.values()].count("/pose") == 1
        assert reader.position_bytes == reader.size_bytes
        assert not reader.losses.any()


def test_a_packed_log_is_unpacked_as_far_as_it_goes(tmp_path):
    path = write(tmp_path / "a.mcap", pose_channel(REGULAR), use_chunking=False)
    packed = tmp_path / "a.mcap.zst"
    packed.write_bytes(zstandard.compress(path.read_bytes()))
    reader = open_log(packed)
    assert columns(reader, "pose")[0].tolist() == REGULAR
    assert not reader.losses.any()
    packed.write_bytes(zstandard.compress(path.read_bytes())[:20])
    with pytest.raises(LogUnusable, match="zstd data"):
        open_log(packed)
    stamps = [T0 + k * STEP for k in range(8000)]
    whole = zstandard.compress(write(path, pose_channel(stamps), use_chunking=False).read_bytes())
    packed.write_bytes(whole[: len(whole) // 2])
    cut = open_log(packed)
    t_ns, _ = columns(cut, "pose")
    assert 1000 < len(t_ns) < 8000
    assert t_ns.tolist() == stamps[: len(t_ns)]
    assert cut.losses.truncated


@pytest.mark.parametrize(
    ("topic", "kind", "code", "severity"),
    [
        ("/ackermann_cmd", "steered", "steered", "warning"),
        ("/front_steering/state", "steered", "steered", "warning"),
        ("/mecanum_controller/odom", "omnidirectional", "drives_sideways", "bars"),
        ("/holonomic_base/pose2", "omnidirectional", "drives_sideways", "bars"),
    ],
)
def test_a_robot_that_the_model_does_not_fit_is_told_so(tmp_path, topic, kind, code, severity):
    reader = open_log(write(tmp_path / "a.mcap", pose_channel(REGULAR), pose_channel(REGULAR, topic)))
    assert [(f.code, f.severity) for f in reader.findings] == [(code, severity)]
    assert reader.findings[0].text == f"the robot seems to be {kind} ({topic})"


@pytest.mark.parametrize("topic", ["/skid_steer_controller/odom", "/nonholonomic/odom", "/diff_steering"])
def test_skid_steering_is_a_differential_drive(tmp_path, topic):
    reader = open_log(write(tmp_path / "a.mcap", pose_channel(REGULAR), pose_channel(REGULAR, topic)))
    assert reader.findings == []


def test_another_robots_names_bar_nothing_where_the_channels_are_named(tmp_path):
    path = write(tmp_path / "a.mcap", pose_channel(REGULAR), pose_channel(REGULAR, "/mecanum/pose"))
    (found,) = open_log(path, LogMapping(pose_topic="/pose")).findings
    assert (found.code, found.severity) == ("drives_sideways", "warning")


def test_the_mapping_that_was_found_finds_the_same_again(tmp_path):
    path, _, _ = tf_log(tmp_path)
    reader = open_log(path)
    file = tmp_path / "robot.toml"
    file.write_text(mapping_toml(proposed_mapping(reader.plan, LogMapping(), reader.robot)), encoding="utf-8")
    mapping = read_mapping(file)
    assert mapping.pose == PoseFields(parent="odom", child="base_link")
    again = open_log(path, mapping)
    assert again.plan.as_dict() == reader.plan.as_dict()
    assert columns(again, "pose")[1].tolist() == columns(reader, "pose")[1].tolist()


def test_a_mapping_reads_back_as_it_was_written(tmp_path):
    full = LogMapping(
        pose_topic="/p",
        torque_topic="/t",
        left_joints=("a", "b"),
        right_joints=("c",),
        truth_topic="/m",
        pose=PoseFields("a", "b", "c", "d", "e", "f", "g", 0.001, "deg", -1.0, 0.1, (0.2, -0.3), "log"),
        torque=TorqueFields(
            "n", "e", "v", ("a",), ("b",), ("c",), ("d",), -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 2.0, 3.0, "rpm",
            0.1, 30.0, True, "publish",
        ),
        truth=TruthFields("data", "header"),
        clock="log",
        robot_from_log=False,
    )  # fmt: skip
    file = tmp_path / "robot.toml"
    file.write_text(mapping_toml(full), encoding="utf-8")
    assert read_mapping(file) == full
