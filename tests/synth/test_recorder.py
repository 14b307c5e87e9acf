"""Canonical logs on disk, read by independent packages."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoder
from mcap_ros2.decoder import DecoderFactory as Ros2Decoder

from wmr_schemas import PAPER_ROBOT, Log, RobotParameters, TorqueTrack, __version__
from wmr_synth import SCENARIOS, SimulatedLog, record, synthesise, write_mcap

ENCODINGS = ("ros2", "protobuf", "json")


@pytest.fixture(scope="module")
def simulated() -> SimulatedLog:
    sensors = replace(SCENARIOS["stop-and-go"].sensors, jitter_s=0.001, noise_effort_sd_nm=0.1)
    return synthesise("stop-and-go", seed=4, duration_s=15, sensors=sensors)


def ros2_columns(path: Path) -> dict[str, list[list[float]]]:
    rows: dict[str, list[list[float]]] = {}
    with path.open("rb") as file:
        for _, channel, raw, message in make_reader(
            file, decoder_factories=[Ros2Decoder()]
        ).iter_decoded_messages():
            t_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert raw.log_time == raw.publish_time == t_ns
            rows.setdefault(channel.topic, []).append([t_ns, *ros2_values(channel.topic, message)])
    return rows


def ros2_values(topic: str, message) -> list[float]:
    if topic == "/pose":
        turn = message.pose.orientation
        return [message.pose.position.x, message.pose.position.y, 2 * np.arctan2(turn.z, turn.w)]
    if topic == "/wheel_torques":
        return [*message.effort, *message.velocity, *message.position]
    return [message.mode]


def test_ros2_log_is_read_back_with_equal_values(simulated, tmp_path):
    record(simulated, tmp_path / "a.mcap")
    rows = ros2_columns(tmp_path / "a.mcap")
    log = simulated.log
    pose, torque, mode = rows["/pose"], rows["/wheel_torques"], rows["/ground_truth/mode"]
    assert [row[0] for row in pose] == log.pose.t_ns.tolist()
    assert [row[1] for row in pose] == log.pose.x_m.tolist()
    assert [row[2] for row in pose] == log.pose.y_m.tolist()
    turn = np.array([row[3] for row in pose]) - log.pose.yaw_rad
    assert np.abs(np.angle(np.exp(1j * turn))).max() < 1e-12
    expected = np.stack([*list(vars(log.torque).values())[1:], *simulated.wheel_angles_rad], axis=1)
    assert np.array_equal(np.array([row[1:] for row in torque]), expected)
    assert mode == np.stack([log.mode.t_ns, log.mode.mode], axis=1).tolist()


def test_protobuf_log_is_read_back_with_equal_values(simulated, tmp_path):
    record(simulated, tmp_path / "a.mcap", encoding="protobuf")
    x_m, effort_nm = [], []
    with (tmp_path / "a.mcap").open("rb") as file:
        for schema, _, _, message in make_reader(
            file, decoder_factories=[ProtobufDecoder()]
        ).iter_decoded_messages():
            if schema.name == "foxglove.PoseInFrame":
                x_m.append(message.pose.position.x)
            elif schema.name == "wmr.JointState":
                effort_nm.append(list(message.effort))
    assert x_m == simulated.log.pose.x_m.tolist()
    assert (
        effort_nm == np.stack([simulated.log.torque.left_nm, simulated.log.torque.right_nm], axis=1).tolist()
    )


def test_json_log_is_read_back_with_equal_values(simulated, tmp_path):
    record(simulated, tmp_path / "a.mcap", encoding="json")
    with (tmp_path / "a.mcap").open("rb") as file:
        messages = [json.loads(raw.data) for _, _, raw in make_reader(file).iter_messages(topics=["/pose"])]
    assert [message["pose"]["position"]["x"] for message in messages] == simulated.log.pose.x_m.tolist()


def test_messages_are_in_stamp_order_with_counting_sequences(simulated, tmp_path):
    record(simulated, tmp_path / "a.mcap")
    sequences: dict[str, list[int]] = {}
    topics: list[str] = []
    with (tmp_path / "a.mcap").open("rb") as file:
        stamps = []
        for _, channel, raw in make_reader(file).iter_messages(log_time_order=False):
            stamps.append(raw.log_time)
            topics.append(channel.topic)
            sequences.setdefault(channel.topic, []).append(raw.sequence)
    assert stamps == sorted(stamps)
    assert topics[:3] == ["/ground_truth/mode", "/wheel_torques", "/pose"]
    for counted in sequences.values():
        assert counted == list(range(len(counted)))


@pytest.mark.parametrize(("encoding", "profile"), [("ros2", "ros2"), ("protobuf", ""), ("json", "")])
def test_header_metadata_and_indexes_are_what_other_tools_expect(simulated, tmp_path, encoding, profile):
    record(simulated, tmp_path / "a.mcap", encoding=encoding)
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == profile
        assert reader.get_header().library == f"wmr-replay/{__version__}"
        records = {entry.name: entry.metadata for entry in reader.iter_metadata()}
        summary = reader.get_summary()
    assert RobotParameters.from_metadata(records["wmr_replay"]) == PAPER_ROBOT
    assert summary is not None
    assert summary.chunk_indexes
    assert all(chunk.compression == "zstd" and chunk.message_index_length for chunk in summary.chunk_indexes)
    with_qos = ["offered_qos_profiles" in channel.metadata for channel in summary.channels.values()]
    assert with_qos == [encoding == "ros2"] * 3


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_rerun_finds_nothing_wrong_with_the_file(simulated, tmp_path, encoding):
    record(simulated, tmp_path / "a.mcap", encoding=encoding)
    rerun = Path(sys.executable).with_name("rerun")
    done = subprocess.run(
        [rerun, "mcap", "check", tmp_path / "a.mcap"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("ok ") == 3


def test_side_files_hold_the_truth_and_the_options(simulated, tmp_path):
    paths = record(simulated, tmp_path / "a.b.mcap")
    assert [path.name for path in paths] == ["a.b.mcap", "a.b.truth.json", "a.b.truth.parquet"]
    facts = json.loads(paths[1].read_text(encoding="utf-8"))
    assert (facts["scenario"], facts["seed"], facts["effects"]) == ("stop-and-go", 4, [])
    assert facts["robot"] == PAPER_ROBOT.known()
    assert facts["sensors"]["noise_effort_sd_nm"] == 0.1
    assert [entry["mode"] for entry in facts["modes"]] == simulated.log.mode.mode.tolist()
    states = pl.read_parquet(paths[2])
    assert states["t_ns"].to_list() == simulated.log.pose.t_ns.tolist()
    assert states.schema["mode"] == pl.Int8
    assert states.null_count().sum_horizontal().item() == 0


def test_without_truth_neither_mode_nor_side_files_remain(simulated, tmp_path):
    record(simulated, tmp_path / "a.mcap")
    record(simulated, tmp_path / "a.mcap", truth=False)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    assert set(ros2_columns(tmp_path / "a.mcap")) == {"/pose", "/wheel_torques"}


def test_an_interrupted_recording_leaves_nothing_and_keeps_what_was_there(simulated, tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"before")

    def interrupt(_written: int, _total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(simulated, tmp_path / "a.mcap", progress=interrupt)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    assert (tmp_path / "a.mcap").read_bytes() == b"before"


def test_progress_ends_at_the_total(simulated, tmp_path):
    calls: list[tuple[int, int]] = []
    record(simulated, tmp_path / "a.mcap", progress=lambda *counts: calls.append(counts))
    assert calls[-1][0] == calls[-1][1]


def test_blocks_do_not_change_the_file(simulated, tmp_path, monkeypatch):
    record(simulated, tmp_path / "whole.mcap")
    monkeypatch.setattr("wmr_synth.recorder.BLOCK_MESSAGES", 97)
    record(simulated, tmp_path / "blocks.mcap")
    assert (tmp_path / "whole.mcap").read_bytes() == (tmp_path / "blocks.mcap").read_bytes()


def test_a_log_made_by_hand_may_lack_torques_wheel_speeds_and_truth(simulated, tmp_path):
    pose, torque = simulated.log.pose, simulated.log.torque
    write_mcap(Log(pose), tmp_path / "pose.mcap")
    assert set(ros2_columns(tmp_path / "pose.mcap")) == {"/pose"}
    unknown = np.full(len(torque), np.nan)
    bare = TorqueTrack(torque.t_ns, torque.left_nm, torque.right_nm, unknown, unknown)
    write_mcap(Log(pose, bare), tmp_path / "torque.mcap")
    rows = ros2_columns(tmp_path / "torque.mcap")["/wheel_torques"]
    assert {len(row) for row in rows} == {3}


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_same_seed_gives_the_same_bytes_in_two_processes(tmp_path, encoding):
    code = (
        "import sys; from pathlib import Path; from wmr_synth import record, synthesise; "
        "record(synthesise('random', seed=9, duration_s=5), Path(sys.argv[1]), encoding=sys.argv[2])"
    )
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        subprocess.run([sys.executable, "-c", code, tmp_path / name / "a.mcap", encoding], check=True)
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["a.mcap", "a.truth.json", "a.truth.parquet"]
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name
