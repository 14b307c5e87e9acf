"""``wmr-replay info``: channels, roles and reasons, as text and as JSON."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

import wmr_replay as wr
from wmr_replay.cli.info import command
from wmr_replay.ingest.mcap import stretches
from wmr_replay.ingest.mcap.index_survey import indexed_survey
from wmr_schemas import PAPER_ROBOT, ModeTrack, PoseTrack, TorqueTrack
from wmr_schemas.errors import ChannelNotFound, InvalidSetting
from wmr_schemas.messages import METADATA_NAME, MODE_TOPIC, POSE_TOPIC, TORQUE_TOPIC, ros2
from wmr_schemas.signals import Log
from wmr_synth import write_mcap

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
        "pose",
    ]
    assert lines[TORQUE_TOPIC][-1] == "torque"
    assert lines[MODE_TOPIC][-1] == "truth"
    assert " ".join(lines["/[chat]"]).endswith("1 – 0.00 0.00 – no pose, joint state or contact mode")


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
    assert facts["robot"] == PAPER_ROBOT.known() | {"alpha": 2.0}


@pytest.mark.parametrize("source", ["made", "real"])
def test_a_turtlebots_log_warns_of_odometry_and_empty_efforts(source, shared_data, real_shapes, tmp_path):
    if source == "real":
        path = shared_data("logs", "fuse_turtlebot3.mcap")
    else:
        path = real_shapes.turtlebot(tmp_path / "turtlebot.mcap")
    text = run(path)
    assert "by its name the pose is odometry" in text
    assert "2741 torque messages without an effort" in text


def test_a_mapping_file_that_exists_is_kept_and_a_written_one_is_told(log, tmp_path):
    target = tmp_path / "robot.toml"
    written = run(log, "--write-map", target)
    assert f"wrote {target}: pose {POSE_TOPIC}; torque {TORQUE_TOPIC} (left " in written
    mine = target.read_text().replace("alpha = 0.0255", "alpha = 0.0266")
    target.write_text(mine)
    refused = CliRunner().invoke(command, [str(log), "--write-map", str(target)])
    assert refused.exit_code == 2
    assert f"{target} exists and is left as it is; --force replaces it" in refused.output
    assert target.read_text() == mine
    with pytest.raises(InvalidSetting, match="exists and is left as it is"):
        wr.open_log(log).write_mapping(target)
    json.loads(
        CliRunner().invoke(command, [str(log), "--json", "--write-map", str(target), "--force"]).stdout
    )
    assert target.read_text() != mine


def drive(path: Path, yaw_factor: float = 1.0, n: int = 1500) -> Path:
    """A log at 50 Hz of a robot that winds at .8 m/s, its yaw times a factor; the torques are constant."""
    t_ns, rng = T0 + np.arange(n) * 20_000_000, np.random.default_rng(4)
    yaw, rate = 2.5 * np.sin(np.arange(n) * 0.02), 2.5 * np.cos(np.arange(n) * 0.02)
    x, y = (np.cumsum(part(yaw)) * 0.016 + 0.002 * rng.standard_normal(n) for part in (np.cos, np.sin))
    measured = np.remainder(yaw_factor * yaw + np.pi, 2 * np.pi) - np.pi + 0.002 * rng.standard_normal(n)
    ahead, side = (
        0.8 / PAPER_ROBOT.wheel_radius_m,
        rate * PAPER_ROBOT.half_track_m / PAPER_ROBOT.wheel_radius_m,
    )
    torque = TorqueTrack(t_ns, np.full(n, 0.1), np.full(n, 0.1), ahead - side, ahead + side)
    write_mcap(Log(PoseTrack(t_ns, x, y, measured), torque, None, PAPER_ROBOT), path)
    return path


def test_findings_on_the_quality_are_told_and_a_clean_log_has_none(tmp_path):
    clean = drive(tmp_path / "clean.mcap")
    assert "quality nothing found in 1500 poses over 29.98 s; run looks at every pose" in run(clean)
    facts = json.loads(run(clean, "--json"))
    assert (facts["findings"], facts["n_poses_looked_at"], facts["looked_at_s"]) == ([], 1500, 29.98)
    degrees = drive(tmp_path / "degrees.mcap", 180 / np.pi)
    assert "quality bars  yaw_unit: the yaw turns" in run(degrees)
    (found,) = json.loads(run(degrees, "--json"))["findings"]
    assert (found["code"], found["severity"]) == ("yaw_unit", "bars")
    assert found["advice"].startswith("give yaw_unit or yaw_sign")


def test_the_same_is_found_in_the_stretches_of_a_large_log_and_with_full(tmp_path, monkeypatch):
    degrees = drive(tmp_path / "degrees.mcap", 180 / np.pi, n=30_000)
    monkeypatch.setattr(stretches, "WHOLE_BYTES", 1 << 16)
    monkeypatch.setattr(stretches, "SAMPLED_BYTES", 1 << 20)
    sampled, full = (json.loads(run(degrees, "--json", *more)) for more in ([], ["--full"]))
    assert (sampled["complete"], full["complete"]) == (False, True)
    assert sampled["n_poses_looked_at"] < full["n_poses_looked_at"] == 30_000
    assert [f["code"] for f in sampled["findings"]] == [f["code"] for f in full["findings"]] == ["yaw_unit"]


def test_findings_of_the_reader_stand_under_quality_and_not_among_the_notes(tmp_path):
    path = tmp_path / "radius.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata(METADATA_NAME, {"wheel_radius_m": "100"})
        writer.finish()
    facts = json.loads(run(path, "--json"))
    assert [f["code"] for f in facts["findings"]] == ["parameter_without_sense"]
    assert not any("wheel_radius_m" in remark for remark in facts["remarks"])
    assert "quality warning  parameter_without_sense: " in run(path)


@pytest.fixture
def large(tmp_path, monkeypatch):
    """A log of some 60 chunks, and limits by which it is a large one."""
    path = tmp_path / "large.mcap"
    n, codec = 2000, ros2.CODEC
    t_ns, angle = T0 + np.arange(n) * 10_000_000, np.arange(n) * 0.01
    pose = codec.encode_pose(PoseTrack(t_ns, np.cos(angle), np.sin(angle), angle))
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4096)
        writer.start()
        ids = [writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")]
        ids.append(writer.register_schema(codec.pose.name, "ros2msg", codec.pose.definition))
        text, poses = (
            writer.register_channel(topic, "cdr", k) for topic, k in zip(("/chat", "/pose"), ids, strict=True)
        )
        for k, (t, message) in enumerate(zip(t_ns.tolist(), pose, strict=True)):
            writer.add_message(poses, t, message, t)
            if k == 1000:
                writer.add_message(text, t, b"\0\1\0\0\1\0\0\0\0", t)
        writer.finish()
    monkeypatch.setattr(stretches, "WHOLE_BYTES", 1 << 14)
    monkeypatch.setattr(stretches, "SAMPLED_BYTES", 1 << 16)
    return path


def test_a_large_log_is_sampled_with_the_index_for_its_counts(large):
    quick, full = (json.loads(run(large, "--json", *more)) for more in ([], ["--full"]))
    assert (quick["complete"], full["complete"]) == (False, True)
    assert quick["chunks"] == full["chunks"] == full["chunks_read"] > 40
    assert 5 <= quick["chunks_read"] < 25
    for a, b in zip(quick["channels"], full["channels"], strict=True):
        assert a | dict.fromkeys(("first_ns", "last_ns", "rate_hz")) == b | dict.fromkeys(
            ("first_ns", "last_ns", "rate_hz")
        )
        assert abs(a["first_ns"] - b["first_ns"]) < 5e8
        assert abs(a["last_ns"] - b["last_ns"]) < 5e8
    assert quick["channels"][1]["rate_hz"] == pytest.approx(100, rel=0.01)
    assert quick["clocks"]["pose"] == full["clocks"]["pose"]
    text = run(large)
    assert f"read    {quick['chunks_read']} of {quick['chunks']} chunks" in text
    assert "--full" not in run(large, "--full")


def test_damage_between_the_stretches_is_told_by_full_and_not_denied_before(large):
    data = bytearray(large.read_bytes())
    with large.open("rb") as file:
        spans = indexed_survey(file, len(data)).spans
    middle = spans[len(spans) // 3]
    data[middle.data_offset + 50] ^= 0xFF
    large.write_bytes(data)
    assert "lost    nothing\nread    " in run(large)
    assert f"the chunk at byte {middle.offset} is left out" in run(large, "--full")


def test_the_rows_of_the_stretches_are_those_of_the_log(large):
    opened = wr.open_log(large)
    whole = opened.signals().pose
    parts = [part.pose for part in opened.stretches()]
    assert len(parts) == 5
    for part in parts:
        first = whole["t_ns"].index_of(part["t_ns"][0])
        assert part.equals(whole[first : first + len(part)])
    assert parts[0]["t_ns"][0] == whole["t_ns"][0]
    assert parts[-1]["t_ns"][-1] == whole["t_ns"][-1]


def test_a_part_of_a_large_log_is_sampled_within_its_limits(large):
    facts = json.loads(run(large, "--json", "--start", "5", "--end", "15"))
    assert facts["channels"][1]["messages"] == pytest.approx(1000, abs=60)
    assert not facts["complete"]


@pytest.mark.parametrize("efforts", [(), (float("nan"), float("nan"))])
def test_a_joint_state_without_efforts_is_called_a_wheel_speed(tmp_path, efforts):
    store, name = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/JointState"
    kinds, empty = store.types, np.empty(0)
    header = kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](1_700_000_000, 0), "")
    joints = ["left_wheel", "right_wheel"]
    message = kinds[name](header, joints, empty, np.array([1.0, 2.0]), np.array(efforts, np.float64))
    path = tmp_path / "speeds.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        text = store.generate_msgdef(name, ros_version=2)[0].encode()
        channel = writer.register_channel(
            "/joint_states", "cdr", writer.register_schema(name, "ros2msg", text)
        )
        for k in range(30):
            writer.add_message(channel, T0 + k * 10_000_000, bytes(store.serialize_cdr(message, name)), T0)
        writer.finish()
    facts = json.loads(run(path, "--json"))
    assert facts["channels"][0]["serves_as"] == ["wheel speed"]
    assert facts["channels"][0]["role"] == "wheel_speed"
    assert facts["used"]["torque"] is None
    assert facts["used"]["wheel_speed"]["topic"] == "/joint_states"
    assert "torque  none: /joint_states holds wheel speeds, but no effort" in run(path)
