"""``wmr-replay info``: channels, roles and reasons, as text and as JSON."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from mcap.writer import Writer

from wmr_replay.cli.info import command
from wmr_schemas import PAPER_ROBOT, ModeTrack, PoseTrack, TorqueTrack
from wmr_schemas.errors import ChannelNotFound
from wmr_schemas.messages import METADATA_NAME, MODE_TOPIC, POSE_TOPIC, TORQUE_TOPIC, ros2

T0 = 1_700_000_000_000_000_000
N = 101


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    """A canonical log of one second at 100 Hz, recorded 2 s after its stamps, with one channel more."""
    path = tmp_path_factory.mktemp("info") / "demo.mcap"
    t_ns = T0 + np.arange(N) * 10_000_000
    zeros = np.zeros(N)
    codec = ros2.CODEC
    messages = {
        POSE_TOPIC: (codec.pose, codec.encode_pose(PoseTrack(t_ns, zeros, zeros, zeros))),
        TORQUE_TOPIC: (
            codec.torque,
            codec.encode_torque(TorqueTrack(t_ns, zeros, zeros, zeros, zeros), None),
        ),
        MODE_TOPIC: (codec.mode, codec.encode_mode(ModeTrack(t_ns, np.zeros(N, np.int8)))),
    }
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="wmr-replay/test")
        for topic, (schema, content) in messages.items():
            schema_id = writer.register_schema(schema.name, "ros2msg", schema.definition)
            channel = writer.register_channel(topic, "cdr", schema_id)
            for t, message in zip(t_ns.tolist(), content, strict=True):
                writer.add_message(channel, t + 2_000_000_000, message, t)
        text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        writer.add_message(writer.register_channel("/[chat]", "cdr", text), T0, b"\0\1\0\0\1\0\0\0\0", T0)
        writer.add_metadata(METADATA_NAME, PAPER_ROBOT.to_metadata())
        writer.finish()
    return path


def run(*arguments: object) -> str:
    result = CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_the_table_lists_every_channel_with_its_role_or_the_reason_against_it(log):
    rows = [line.split() for line in run(log).splitlines() if line.strip()]
    lines = {row[1]: row for row in rows if row[0].isdigit()}
    assert list(lines) == [POSE_TOPIC, TORQUE_TOPIC, MODE_TOPIC, "/[chat]"]
    assert lines[POSE_TOPIC] == [
        "1",
        "/pose",
        "geometry_msgs/PoseStamped",
        "cdr",
        "101",
        "100",
        "2.00",
        "3.00",
        "pose",
    ]
    assert lines[TORQUE_TOPIC][-1] == "torque"
    assert lines[MODE_TOPIC][-1] == "truth"
    assert " ".join(lines["/[chat]"]).endswith("1 – 0.00 0.00 no pose, joint state or contact mode")


def test_the_lines_below_tell_clocks_robot_and_losses(log):
    text = run(log)
    assert "pose    /pose: header stamp, -2 s off log time\n" in text
    assert "robot   alpha 0.025521, half_track_m 1," in text
    assert text.endswith("lost    nothing\n")
    assert "\x1b" not in text
    assert not any(line != line.rstrip() for line in text.splitlines())


def test_json_holds_the_same_for_machines(log):
    facts = json.loads(run(log, "--json"))
    assert [c["topic"] for c in facts["channels"]] == [POSE_TOPIC, TORQUE_TOPIC, MODE_TOPIC, "/[chat]"]
    assert [c["messages"] for c in facts["channels"]] == [N, N, N, 1]
    assert [c["role"] for c in facts["channels"]] == ["pose", "torque", "truth", None]
    assert facts["channels"][0]["rate_hz"] == pytest.approx(100)
    clock = facts["clocks"]["pose"]
    assert (clock["clock"], clock["offset_s"], clock["n_backward"]) == ("header stamp", -2.0, 0)
    assert facts["robot"] == PAPER_ROBOT.known()
    assert facts["losses"] == {
        "n_undecodable": 0,
        "n_chunks_damaged": 0,
        "n_torque_empty": 0,
        "truncated": False,
        "notes": [],
    }


def test_a_cut_file_says_what_is_lost(log, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:-200])
    assert "lost    byte " in run(cut)


def test_a_log_without_a_pose_is_described_nevertheless(tmp_path):
    path = tmp_path / "empty.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    text = run(path)
    assert "pose    none found; name one with --pose TOPIC or --map FILE" in text


def test_a_topic_that_is_not_there_is_an_error(log):
    with pytest.raises(ChannelNotFound, match="on topic /nowhere"):
        run(log, "--pose", "/nowhere")


def test_a_mapping_file_is_heeded(log, tmp_path):
    mapping = tmp_path / "robot.toml"
    mapping.write_text('[torque]\ntopic = "/wheel_torques"\n[robot]\nalpha = 2.0\n')
    facts = json.loads(run(log, "--json", "--map", mapping))
    assert facts["robot"] == {"alpha": 2.0}


@pytest.mark.parametrize("source", ["made", "real"])
def test_a_turtlebots_log_warns_of_odometry_and_empty_efforts(source, shared_data, real_shapes, tmp_path):
    if source == "real":
        path = shared_data("logs", "fuse_turtlebot3.mcap")
    else:
        path = real_shapes.turtlebot(tmp_path / "turtlebot.mcap")
    text = run(path)
    assert "by its name the pose is odometry" in text
    assert "2741 torque messages without an effort" in text
