"""Real logs against mcap and mcap-ros2-support: each file is read, or rejected with the reason."""

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

LOGS = Path(__file__).parents[2].parent / "shared" / "data" / "logs"
pytestmark = pytest.mark.skipif(not LOGS.is_dir(), reason="the real logs are not beside the project")

WITHOUT_POSE = {
    "replay_testing_cmd_vel_only": "/vehicle/cmd_vel (geometry_msgs/msg/TwistStamped): velocities, no pose",
    "rosbag2_reindex_0": "/chatter (std_msgs/msg/String)",
    "rosbag2_reindex_1": "/chatter (std_msgs/msg/String)",
    "rosbag2_rewriter_b_0": "c_strings (test_msgs/msg/Strings)",
    "rosbag2_topics_and_services": "/add_two_ints/_service_event (example_interfaces/srv/AddTwoInts_Event)",
    **{f"rosbag2_wbag_{k}": "AAA (std_msgs/msg/String)" for k in range(5)},
    "rosbag2parquet_array_msgs_0": "its joints are joint1, joint2, joint3; wanted: a left and a right wheel",
}


def reference(path: Path, topic: str):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for item in reader.iter_decoded_messages(topics=[topic], log_time_order=False):
            yield item.message, item.decoded_message


def joined(batches, name):
    parts = [getattr(batch, name) for batch in batches]
    return np.concatenate([p.t_ns for p in parts]), np.concatenate([p.values for p in parts], axis=1)


@pytest.fixture(scope="module")
def turtlebot():
    reader = open_log(LOGS / "fuse_turtlebot3.mcap")
    return reader, list(reader.batches())


def test_turtlebot_odometry_equals_the_independent_reader(turtlebot):
    t_ns, (x_m, y_m, yaw_rad) = joined(turtlebot[1], "pose")
    messages = [m for _, m in reference(turtlebot[0].path, "/odom")]
    assert len(t_ns) == len(messages) == 2741
    assert t_ns.tolist() == [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages]
    poses = [m.pose.pose for m in messages]
    assert x_m.tolist() == [p.position.x for p in poses]
    assert y_m.tolist() == [p.position.y for p in poses]
    turns = Rotation.from_quat([[getattr(p.orientation, axis) for axis in "xyzw"] for p in poses])
    np.testing.assert_allclose(yaw_rad, turns.as_euler("ZYX")[:, 0], rtol=0, atol=1e-14)


def test_turtlebot_joint_states_are_all_there_and_all_empty(turtlebot):
    reader, batches = turtlebot
    t_ns, values = joined(batches, "torque")
    messages = [m for _, m in reference(reader.path, "/joint_states")]
    assert t_ns.tolist() == [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages]
    assert all(len(m.effort) == len(m.velocity) == 0 for m in messages)
    assert np.isnan(values).all()
    assert reader.losses.n_torque_empty == len(messages) == 2741
    assert not reader.losses.any()


def test_turtlebot_pose_is_told_to_be_odometry_and_its_clock_to_be_off(turtlebot):
    reader, _ = turtlebot
    assert reader.pose_is_odometry
    assert {role: use.channel.id for role, use in reader.plan.uses.items()} == {"pose": 3, "torque": 2}
    offsets = [
        m.header.stamp.sec * 10**9 + m.header.stamp.nanosec - raw.log_time
        for raw, m in reference(reader.path, "/odom")
    ]
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


def test_the_log_of_94_types_gives_its_pose():
    reader = open_log(LOGS / "rosbags-rs_test_bag.mcap")
    t_ns, values = joined(list(reader.batches()), "pose")
    messages = [m for _, m in reference(reader.path, "/test/geometry_msgs/pose_stamped")]
    assert reader.plan.pose.topic == "/test/geometry_msgs/pose_stamped"
    assert t_ns.tolist() == [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages]
    assert values[:2].T.tolist() == [[m.pose.position.x, m.pose.position.y] for m in messages]
    assert len(reader.survey.catalogue.channels) == 94


@pytest.mark.parametrize("stem", WITHOUT_POSE)
def test_a_log_without_a_pose_says_what_was_looked_for_what_it_holds_and_what_to_do(stem):
    with pytest.raises(ChannelNotFound) as caught:
        open_log(LOGS / f"{stem}.mcap")
    text = str(caught.value)
    assert "no pose (PoseStamped, PoseInFrame" in text
    assert WITHOUT_POSE[stem] in text
    assert "--pose TOPIC" in text
    assert "--map FILE" in text


def test_every_log_is_read_to_its_end_and_found_whole():
    paths = sorted(LOGS.glob("*.mcap"))
    assert len(paths) == 13
    for path in paths:
        reader = open_log(path, need_pose=False)
        for _ in reader.batches(everything=True):
            pass
        with path.open("rb") as file:
            records = StreamReader(file, validate_crcs=True).records
            expected = Counter(record.channel_id for record in records if isinstance(record, Message))
        assert {k: tally.n for k, tally in reader.message_counts.by_channel.items()} == expected, path.name
        assert not reader.losses.any(), path.name
        assert reader.position_bytes == reader.size_bytes == path.stat().st_size


def test_a_mapped_topic_that_does_not_serve_is_refused_with_the_reason():
    path = LOGS / "fuse_turtlebot3.mcap"
    with pytest.raises(
        ChannelNotFound, match=r"/imu \(sensor_msgs/msg/Imu\): no position with an orientation"
    ):
        open_log(path, LogMapping(pose_topic="/imu"))
    with pytest.raises(ChannelNotFound, match=r"/odom .*: would serve as pose, but /nowhere was named"):
        open_log(path, LogMapping(pose_topic="/nowhere"))
    with pytest.raises(ChannelNotFound, match="joints are wheel_right_joint, wheel_left_joint; wanted: a, b"):
        open_log(path, LogMapping(left_joints=("a",), right_joints=("b",)))


def test_the_hash_is_the_files():
    path = LOGS / "fuse_turtlebot3.mcap"
    assert sha256_of(path) == hashlib.sha256(path.read_bytes()).hexdigest()
