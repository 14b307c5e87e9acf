"""A topic that does not serve: near names, and what its channel is instead."""

import pytest

from wmr_replay.ingest.channels.named import kinds, near_topics

THERE = ["/pose", "/wheel_torques", "/robot/amcl_pose"]


@pytest.mark.parametrize(
    ("topic", "said"),
    [
        ("/psoe", "There is no topic /psoe; did you mean /pose?"),
        ("pose", "There is no topic pose; did you mean /pose?"),
        (
            "/base/frames/amcl_pose",
            "There is no topic /base/frames/amcl_pose; did you mean /robot/amcl_pose?",
        ),
        ("/imu", "There is no topic /imu."),
        ("/pose", ""),
    ],
)
def test_near_names(topic, said):
    assert near_topics(topic, THERE) == said


def test_kinds():
    assert kinds("pose", {"torque": ("torque", "wheel speed")}) == "torque, wheel speed, no pose"
    assert kinds("torque", {"torque": ("wheel speed",)}) == ""
    assert kinds("pose", {}) == ""


@pytest.fixture(scope="module")
def log(tmp_path_factory, command):
    path = tmp_path_factory.mktemp("logs") / "drive.mcap"
    command("synth", "patrol", "--duration", 2, "--rate", 50, "--out", path)
    return path


def test_a_mistyped_topic_is_answered_with_the_nearest(log, command):
    said = command("run", log, "--pose", "/psoe", code=3).stderr
    assert "There is no topic /psoe; did you mean /pose?" in said
    assert "/wheel_torques (sensor_msgs/msg/JointState): torque, wheel speed, no pose" in said
    assert "/ground_truth/mode (wmr_msgs/msg/ContactMode): truth, no pose" in said
    assert "no pose, joint state or contact mode" not in said


def test_a_channel_of_another_kind_is_called_what_it_is(log, command):
    said = command("info", log, "--pose", "/wheel_torques", code=3).stderr
    assert "/wheel_torques (sensor_msgs/msg/JointState): torque, wheel speed, no pose" in said
    assert "There is no topic" not in said


def test_modes_lists_what_there_is(log, command):
    said = command("gap", log, "--modes", "foo", code=2).stderr
    assert said == "error: modes are identified, ideal, or topic:T with the topic T of the modes; not 'foo'\n"
    assert "did you mean topic:/truth?" in command("gap", log, "--modes", "/truth", code=2).stderr
    said = command("fit", log, "--modes", "topic:/ground_truth/mod", code=3).stderr
    assert "did you mean /ground_truth/mode?" in said
