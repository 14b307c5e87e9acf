"""Logs in the shapes of real ones, and the real ones, against mcap and mcap-ros2-support.

The shapes are made here, see ``real_shapes.py``; the real logs are read too where the shared data lie beside
the project.
"""

import hashlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from wmr_replay.ingest import open_log, sha256_of
from wmr_schemas.errors import ChannelNotFound
from wmr_schemas.mapping_file import LogMapping

REAL_WITHOUT_POSE = {
    "replay_testing_cmd_vel_only": "/vehicle/cmd_vel (geometry_msgs/msg/TwistStamped): velocities, no pose",
    "rosbag2_reindex_0": "/chatter (std_msgs/msg/String)",
    "rosbag2_reindex_1": "/chatter (std_msgs/msg/String)",
    "rosbag2_rewriter_b_0": "c_strings (test_msgs/msg/Strings)",
    "rosbag2_topics_and_services": "/add_two_ints/_service_event (example_interfaces/srv/AddTwoInts_Event)",
    **{f"rosbag2_wbag_{k}": "AAA (std_msgs/msg/String)" for k in range(5)},
    "rosbag2parquet_array_msgs_0": "its joints are joint1, joint2, joint3; wanted: a left and a right wheel",
}
MADE_WITHOUT_POSE = ("commands_only", "chatter", "service_events", "array_messages")
SOURCES = ("made", "real")


def reference(path: Path, topic: str):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for item in reader.iter_decoded_messages(topics=[topic], log_time_order=False):
            yield item.message, item.decoded_message


def stamp_ns(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def columns(batches, name):
    parts = [getattr(batch, name) for batch in batches]
    return np.concatenate([p.t_ns for p in parts]), np.concatenate([p.values for p in parts], axis=1)


@pytest.fixture(scope="module", params=SOURCES)
def turtlebot_path(request, shared_data, real_shapes, tmp_path_factory):
    """A TurtleBot's log: odometry, and joint states without efforts."""
    if request.param == "real":
        return shared_data("logs", "fuse_turtlebot3.mcap")
    return real_shapes.turtlebot(tmp_path_factory.mktemp("made") / "turtlebot.mcap")


@pytest.fixture(scope="module")
def turtlebot(turtlebot_path):
    reader = open_log(turtlebot_path)
    return reader, list(reader.batches())


def test_turtlebot_odometry_equals_the_independent_reader(turtlebot):
    t_ns, (x_m, y_m, yaw_rad) = columns(turtlebot[1], "pose")
    messages = [m for _, m in reference(turtlebot[0].path, "/odom")]
    assert len(t_ns) == len(messages) == 2741
    assert t_ns.tolist() == [stamp_ns(m) for m in messages]
    poses = [m.pose.pose for m in messages]
    assert x_m.tolist() == [p.position.x for p in poses]
    assert y_m.tolist() == [p.position.y for p in poses]
    turns = Rotation.from_quat([[getattr(p.orientation, axis) for axis in "xyzw"] for p in poses])
    np.testing.assert_allclose(yaw_rad, turns.as_euler("ZYX")[:, 0], rtol=0, atol=1e-14)


def test_turtlebot_joint_states_have_no_effort_and_speeds_by_their_positions(turtlebot):
    reader, batches = turtlebot
    t_ns, values = columns(batches, "torque")
    messages = [m for _, m in reference(reader.path, "/joint_states")]
    assert t_ns.tolist() == [stamp_ns(m) for m in messages]
    assert all(len(m.effort) == len(m.velocity) == 0 for m in messages)
    assert np.isnan(values[:2]).all()
    places = np.array(
        [[m.position[m.name.index(f"wheel_{side}_joint")] for m in messages] for side in ("left", "right")]
    )
    speeds = np.diff(places) / np.diff(t_ns) * 1e9
    np.testing.assert_allclose(values[2:, 1:], speeds, rtol=1e-9, atol=1e-9)
    assert reader.losses.n_torque_empty == len(messages) == 2741
    assert not reader.losses.any()


def test_turtlebot_pose_is_told_to_be_odometry_and_its_clock_to_be_off(turtlebot):
    reader, _ = turtlebot
    assert reader.pose_is_odometry
    assert {role: use.channel.id for role, use in reader.uses.items()} == {"pose": 3, "torque": 2}
    offsets = [stamp_ns(m) - raw.log_time for raw, m in reference(reader.path, "/odom")]
    assert min(offsets) < 0 < max(offsets)
    assert reader.clocks["pose"].name == "header stamp"
    assert reader.clocks["pose"].offset_s == pytest.approx(np.median(offsets) / 1e9, abs=2e-3)


def test_turtlebot_orders_are_those_of_the_file(turtlebot):
    reader, batches = turtlebot
    ours = sorted(
        [(n, "/odom") for b in batches for n in b.pose.order.tolist()]
        + [(n, "/joint_states") for b in batches for n in b.torque.order.tolist()]
    )
    with reader.path.open("rb") as file:
        items = make_reader(file).iter_messages(topics=["/odom", "/joint_states"], log_time_order=False)
        theirs = list(enumerate(channel.topic for _, channel, _ in items))
    assert ours == theirs


def test_a_mapped_topic_that_does_not_serve_is_refused_with_the_reason(turtlebot_path):
    with pytest.raises(
        ChannelNotFound, match=r"/imu \(sensor_msgs/msg/Imu\): no position with an orientation"
    ):
        open_log(turtlebot_path, LogMapping(pose_topic="/imu"))
    with pytest.raises(ChannelNotFound, match=r"/odom .*: would serve as pose, but /nowhere was named"):
        open_log(turtlebot_path, LogMapping(pose_topic="/nowhere"))
    with pytest.raises(ChannelNotFound, match="joints are wheel_right_joint, wheel_left_joint; wanted: a, b"):
        open_log(turtlebot_path, LogMapping(left_joints=("a",), right_joints=("b",)))


def test_the_hash_is_the_files(turtlebot_path):
    assert sha256_of(turtlebot_path) == hashlib.sha256(turtlebot_path.read_bytes()).hexdigest()


@pytest.mark.parametrize("source", SOURCES)
def test_a_log_of_many_types_without_statistics_gives_its_pose(source, shared_data, real_shapes, tmp_path):
    if source == "real":
        path, n_channels = shared_data("logs", "rosbags-rs_test_bag.mcap"), 94
    else:
        path, n_channels = real_shapes.many_types(tmp_path / "many.mcap"), 19
    reader = open_log(path)
    t_ns, values = columns(list(reader.batches()), "pose")
    messages = [m for _, m in reference(path, "/test/geometry_msgs/pose_stamped")]
    assert reader.plan.pose.topic == "/test/geometry_msgs/pose_stamped"
    assert len(messages) == 2
    assert t_ns.tolist() == [stamp_ns(m) for m in messages]
    assert values[:2].T.tolist() == [[m.pose.position.x, m.pose.position.y] for m in messages]
    assert reader.survey.statistics is None
    assert len(reader.survey.catalogue.channels) == n_channels


def check_refusal(path: Path, fact: str) -> None:
    with pytest.raises(ChannelNotFound) as caught:
        open_log(path)
    for text in ("no pose (PoseStamped, PoseInFrame", fact, "--pose TOPIC", "--map FILE"):
        assert text in str(caught.value)


@pytest.mark.parametrize("shape", MADE_WITHOUT_POSE)
def test_a_log_without_a_pose_says_what_was_looked_for_what_it_holds_and_what_to_do(
    shape, real_shapes, tmp_path
):
    make = getattr(real_shapes, shape)
    check_refusal(make(tmp_path / "a.mcap"), real_shapes.WITHOUT_POSE[make])


@pytest.mark.parametrize("stem", REAL_WITHOUT_POSE)
def test_a_real_log_without_a_pose_does_so_too(stem, shared_data):
    check_refusal(shared_data("logs", f"{stem}.mcap"), REAL_WITHOUT_POSE[stem])


def test_of_two_metadata_records_of_one_name_the_first_counts(real_shapes, tmp_path):
    reader = open_log(real_shapes.chatter(tmp_path / "a.mcap"), need_pose=False)
    assert reader.survey.metadata == {"rosbag2": {"ROS_DISTRO": "rolling"}}


def check_whole(path: Path) -> None:
    """Every message is counted as by mcap's own reader, and nothing is called lost."""
    reader = open_log(path, need_pose=False)
    for _ in reader.batches(everything=True):
        pass
    with path.open("rb") as file:
        records = StreamReader(file, validate_crcs=True).records
        expected = Counter(record.channel_id for record in records if isinstance(record, Message))
    assert expected
    assert {k: count.n for k, count in reader.message_counts.by_channel.items()} == expected, path.name
    assert not reader.losses.any(), path.name
    assert reader.position_bytes == reader.size_bytes == path.stat().st_size


def test_every_shape_is_read_to_its_end_and_found_whole(real_shapes, tmp_path):
    for make in real_shapes.ALL:
        check_whole(make(tmp_path / f"{make.__name__}.mcap"))


def test_every_real_log_is_read_to_its_end_and_found_whole(shared_data):
    paths = sorted(shared_data("logs").glob("*.mcap"))
    assert len(paths) == 13
    for path in paths:
        check_whole(path)
