"""The role of each channel, and the reasons for the channels without a role."""

import json
from dataclasses import replace

import numpy as np
import pytest
from mcap.writer import Writer

from wmr_replay.ingest import open_log
from wmr_replay.ingest.channels.clocks import short_time
from wmr_replay.ingest.channels.pose_accuracy import decades
from wmr_replay.ingest.channels.wheel_joints import wheel_joints
from wmr_schemas import PAPER_ROBOT, RobotParameters
from wmr_schemas.errors import ChannelNotFound, LogUnusable
from wmr_schemas.mapping_file import LogMapping

POSE = {
    "timestamp": {"sec": 1, "nsec": 0},
    "pose": {"position": {"x": 1, "y": 2}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
}
ODOM = {"timestamp": {"sec": 1, "nsec": 0}, "pose": {"pose": POSE["pose"]}}
JOINTS = {
    "timestamp": {"sec": 1, "nsec": 0},
    "name": ["left_wheel", "right_wheel"],
    "velocity": [],
    "effort": [1, 2],
}
EMPTY_JOINTS = JOINTS | {"effort": []}
MODE = {"timestamp": {"sec": 1, "nsec": 0}, "mode": 2}


def write(path, *channels, metadata=None):
    """Channels of JSON messages: (topic, schema name, message or None, how many)."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        ids = []
        for topic, name, _, _ in channels:
            ids.append(
                writer.register_channel(topic, "json", writer.register_schema(name, "jsonschema", b"{}"))
            )
        for channel, (_, _, message, n) in zip(ids, channels, strict=True):
            for k in range(n):
                writer.add_message(channel, 10 + k, json.dumps(message).encode(), 10 + k)
        for name, content in (metadata or {}).items():
            writer.add_metadata(name, content)
        writer.finish()
    return path


def topics(reader):
    return {role: use.channel.topic for role, use in reader.plan.uses.items()}


@pytest.mark.parametrize(
    ("channels", "expected"),
    [
        ([("/odom", "Odometry", ODOM, 9), ("/mocap", "PoseStamped", POSE, 3)], "/mocap"),
        ([("/odom", "Odometry", ODOM, 9)], "/odom"),
        ([("/gnss", "PoseStamped", POSE, 9), ("/pose", "PoseInFrame", POSE, 3)], "/pose"),
        ([("/a", "PoseWithCovarianceStamped", ODOM, 9), ("/b", "PoseStamped", POSE, 3)], "/b"),
        ([("/wheel_odom", "PoseStamped", POSE, 9), ("/b", "PoseWithCovarianceStamped", ODOM, 3)], "/b"),
        ([("/a", "PoseStamped", POSE, 2), ("/b", "PoseStamped", POSE, 9)], "/b"),
        ([("/move_base_simple/goal", "PoseStamped", POSE, 9), ("/odom", "Odometry", ODOM, 1)], "/odom"),
        ([("/pose", "PoseStamped", POSE, 0), ("/odom", "Odometry", ODOM, 1)], "/odom"),
        ([("/pose", "PoseStamped", {"x": 1}, 5), ("/odom", "Odometry", ODOM, 1)], "/odom"),
    ],
)
def test_an_external_pose_comes_before_odometry_and_canonical_topics_first(tmp_path, channels, expected):
    reader = open_log(write(tmp_path / "a.mcap", *channels))
    assert topics(reader) == {"pose": expected}
    assert reader.pose_is_odometry == ("odom" in expected)
    others = {k for k in reader.survey.catalogue.channels if k != reader.plan.pose.id}
    assert reader.plan.why_not.keys() == others


def test_two_channels_on_one_topic_stay_apart(tmp_path):
    path = write(tmp_path / "a.mcap", ("/pose", "PoseStamped", POSE, 2), ("/pose", "PoseStamped", POSE, 5))
    reader = open_log(path, LogMapping(pose_topic="/pose"))
    assert sum(len(batch.pose) for batch in reader.batches()) == 5
    assert reader.plan.pose.id == 2
    assert reader.plan.why_not == {1: "/pose comes first as pose"}


def test_a_joint_state_with_efforts_comes_before_one_without(tmp_path):
    channels = [("/wheel_torques", "JointState", EMPTY_JOINTS, 3), ("/joint_states", "JointState", JOINTS, 3)]
    reader = open_log(write(tmp_path / "a.mcap", ("/p", "PoseStamped", POSE, 1), *channels))
    assert topics(reader) == {"pose": "/p", "torque": "/joint_states"}


def test_the_truth_is_known_by_its_schema(tmp_path):
    channels = [("/mode", "my_msgs/msg/ContactMode", MODE, 3), ("/gear", "Gear", MODE, 3)]
    reader = open_log(write(tmp_path / "a.mcap", ("/p", "PoseStamped", POSE, 1), *channels))
    assert topics(reader) == {"pose": "/p", "truth": "/mode"}
    assert np.concatenate([b.mode.values for b in reader.batches()], axis=1).tolist() == [[2.0, 2.0, 2.0]]


def test_what_the_user_names_wins(tmp_path):
    path = write(
        *(tmp_path / "a.mcap", ("/pose", "PoseStamped", POSE, 1), ("/mine", "Whatever", ODOM, 1)),
        *(("/t", "Thing", JOINTS, 1), ("/wheel_torques", "JointState", JOINTS, 1), ("/m", "Gear", MODE, 1)),
    )
    reader = open_log(path, LogMapping(pose_topic="/mine", torque_topic="/t", truth_topic="/m"))
    assert topics(reader) == {"pose": "/mine", "torque": "/t", "truth": "/m"}
    assert reader.plan.why_not[1] == "would serve as pose, but /mine was named"
    assert reader.plan.as_dict()["pose"] == {"id": 2, "topic": "/mine", "schema": "Whatever"}


def test_the_logs_robot_is_read_and_the_mappings_robot_overrides_it(tmp_path):
    metadata = {"wmr_replay": PAPER_ROBOT.to_metadata() | {"colour": "blue"}}
    path = write(tmp_path / "a.mcap", ("/p", "PoseStamped", POSE, 1), metadata=metadata)
    assert open_log(path).robot == PAPER_ROBOT
    mine = RobotParameters(alpha=1.0)
    assert open_log(path, LogMapping(robot=mine)).robot == replace(PAPER_ROBOT, alpha=1.0)
    assert open_log(path, LogMapping(robot=RobotParameters())).robot == PAPER_ROBOT
    assert open_log(path, LogMapping(robot=mine, robot_from_log=False)).robot == mine


def test_parameters_of_the_logs_own_that_make_no_sense_are_found_and_left_out(tmp_path):
    record = {"alpha": "heavy", "wheel_radius_m": "100", "mass_kg": "20"}
    path = write(tmp_path / "a.mcap", ("/p", "PoseStamped", POSE, 1), metadata={"wmr_replay": record})
    reader = open_log(path)
    assert reader.robot == RobotParameters(mass_kg=20.0)
    assert [f.code for f in reader.findings] == ["parameter_without_sense"] * 2
    assert "alpha: 'heavy' is no number above 0" in reader.findings[0].text
    assert "wheel_radius_m: 100 makes no sense; expected 0.001 to 5 m" in reader.findings[1].text


@pytest.mark.parametrize(
    ("names", "left", "right"),
    [
        ("left_wheel_joint right_wheel_joint", [0], [1]),
        ("wheel_right_joint wheel_left_joint", [1], [0]),
        ("left_joint right_joint", [0], [1]),
        ("fl_wheel fr_wheel rl_wheel rr_wheel", [0, 2], [1, 3]),
        (
            "front_left_wheel_joint front_right_wheel_joint rear_left_wheel_joint rear_right_wheel_joint",
            [0, 2],
            [1, 3],
        ),
        ("FrontLeftWheel FrontRightWheel", [0], [1]),
        ("wheel_front_l wheel_front_r caster_left_wheel", [0], [1]),
        ("drivewhl_l_joint drivewhl_r_joint", [0], [1]),
        ("left_shoulder right_shoulder left_wheel right_wheel", [2], [3]),
        ("front_left_steer front_right_steer left_wheel right_wheel", [2], [3]),
    ],
)
def test_wheels_are_known_by_name(names, left, right):
    assert wheel_joints(names.split()) == (tuple(left), tuple(right))


@pytest.mark.parametrize(
    "names", ["", "joint1 joint2", "left_wheel", "left_shoulder right_shoulder", "wheel_1 wheel_2"]
)
def test_other_joints_are_no_wheels(names):
    assert wheel_joints(names.split()) is None


@pytest.mark.parametrize(
    ("content", "problem", "advice"),
    [
        (b"", "the file is empty", "Nothing was recorded"),
        (b"\x89MCAP", "ends inside MCAP's magic", "Copying"),
        (b"SQLite format 3\0" + bytes(90), "its database cannot be read", "copy it again"),
        (b"#ROSBAG V2.0\n", "its header is damaged", "Copy it again"),
        (b"#ROSBAG V1.2\n", "a ROS 1 bag of another version", "rosbag fix"),
        (b"hello, world", "not an MCAP file nor a ROS bag", "Give a .mcap, .db3 or .bag file"),
    ],
)
def test_what_is_no_mcap_file_is_refused_with_advice(tmp_path, content, problem, advice):
    path = tmp_path / "log.mcap"
    path.write_bytes(content)
    with pytest.raises(LogUnusable) as caught:
        open_log(path)
    assert problem in caught.value.problem
    assert advice.format(path=path) in caught.value.advice


def test_an_empty_directory_and_a_missing_file_are_refused(tmp_path):
    with pytest.raises(LogUnusable, match=r"a directory without any \.mcap or \.db3 file"):
        open_log(tmp_path)
    (tmp_path / "bag_0.db3").touch()
    with pytest.raises(LogUnusable, match="the file is empty"):
        open_log(tmp_path)
    with pytest.raises(LogUnusable, match="there is no such file"):
        open_log(tmp_path / "nothing.mcap")


def test_a_log_without_channels_says_so(tmp_path):
    with pytest.raises(ChannelNotFound, match="the file holds no channel at all"):
        open_log(write(tmp_path / "a.mcap"))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"),
        (-0.0254532, "-25.45 ms"),
        (1.78e9, "+1780000000 s"),
        (2e-6, "+2 µs"),
        (3e-9, "+3 ns"),
        (-12.5, "-12.5 s"),
    ],
)
def test_offsets_are_said_in_the_unit_that_suits_them(seconds, text):
    assert short_time(seconds) == text


@pytest.mark.parametrize(
    ("channels", "expected"),
    [
        ([("/amcl_pose", 1.4), ("/odom", 30.0), ("/base_pose", 50.0)], "/base_pose"),
        ([("/amcl_pose", 1.4), ("/odom", 30.0)], "/odom"),
        ([("/amcl_pose", 10.0), ("/odom", 30.0)], "/amcl_pose"),
        ([("/amcl_pose", 1.4), ("/odom", 2.0)], "/amcl_pose"),
    ],
)
def test_a_pose_too_rare_to_follow_motion_is_no_first_choice(tmp_path, channels, expected):
    schemas = {"/amcl_pose": "PoseWithCovarianceStamped", "/odom": "Odometry", "/base_pose": "PoseStamped"}
    messages = {"PoseStamped": POSE}
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        rows = []
        for topic, rate_hz in channels:
            name = schemas[topic]
            schema = writer.register_schema(name, "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            data = json.dumps(messages.get(name, ODOM)).encode()
            rows += [(int(k / rate_hz * 1e9), channel, data) for k in range(int(20 * rate_hz))]
        for t_ns, channel, data in sorted(rows):
            writer.add_message(channel, t_ns, data, t_ns)
        writer.finish()
    assert topics(open_log(tmp_path / "a.mcap")) == {"pose": expected}


def with_covariance(position_sd_m: float, yaw_sd_rad: float) -> dict:
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = position_sd_m * abs(position_sd_m)
    covariance[35] = yaw_sd_rad * abs(yaw_sd_rad)
    return ODOM | {"pose": {"pose": POSE["pose"], "covariance": covariance}}


@pytest.mark.parametrize(
    ("coarse", "fine", "expected"),
    [
        ((0.5, 0.2), (0.02, 0.02), "/fine"),
        ((0.04, 0.5), (0.03, 0.05), "/fine"),
        ((0.04, 0.02), (0.005, 0.02), "/coarse"),
        ((0.0, 0.0), (0.02, 0.02), "/coarse"),
        ((-1.0, -1.0), (0.02, 0.02), "/coarse"),
        ((0.5, 0.2), (0.0, 0.0), "/fine"),
    ],
    ids=[
        "position",
        "yaw",
        "both fine",
        "zeros state nothing",
        "-1 states nothing",
        "unknown before coarse",
    ],
)
def test_among_poses_of_one_kind_the_one_that_states_less_noise_comes_first(tmp_path, coarse, fine, expected):
    """Else the one with more messages, which is the coarse one here."""
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("PoseWithCovarianceStamped", "jsonschema", b"{}")
        for topic, sd, step_ns in (("/coarse", coarse, 20_000_000), ("/fine", fine, 50_000_000)):
            channel = writer.register_channel(topic, "json", schema)
            data = json.dumps(with_covariance(*sd)).encode()
            for k in range(60):
                writer.add_message(channel, k * step_ns, data, k * step_ns)
        writer.finish()
    assert topics(open_log(tmp_path / "a.mcap")) == {"pose": expected}


def test_accuracy_counts_in_decades_from_what_localisers_state_at_best():
    sd = np.array([0.0001, 0.05, 0.06, 0.5, 0.51, 100.0])
    assert [decades(np.full(20, s**2), 0.05) for s in sd] == [0, 0, 1, 1, 2, 3]
    assert decades(np.array([-1.0, np.inf, np.nan, 0.0, 25.0]), 0.05) == 0
