"""Text that is none: invalid UTF-8 in JSON messages, and parameters in the metadata that are no numbers."""

import json
import math
from pathlib import Path

import pytest
from mcap.writer import Writer
from worker import run

from wmr_replay.ingest import open_log
from wmr_schemas import PAPER_ROBOT
from wmr_schemas.messages import METADATA_NAME

T0_NS, STEP_NS, N = 1_700_000_000_000_000_000, 20_000_000, 200
SCHEMA = "geometry_msgs/msg/PoseStamped"


def pose(k: int) -> dict:
    """The k-th pose of a robot that drives in a wide circle."""
    stamp, angle = T0_NS + k * STEP_NS, 0.01 * k
    return {
        "header": {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "map"},
        "pose": {
            "position": {"x": 2 * math.sin(angle), "y": -2 * math.cos(angle), "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(angle / 2), "w": math.cos(angle / 2)},
        },
    }


def written(path: Path, messages: dict[int, bytes], metadata: dict[str, str]) -> Path:
    """A log of poses in JSON, some of them replaced."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata(METADATA_NAME, metadata)
        channel = writer.register_channel("/pose", "json", writer.register_schema(SCHEMA, "", b""))
        for k in range(N):
            t_ns = T0_NS + k * STEP_NS
            writer.add_message(channel, t_ns, messages.get(k, json.dumps(pose(k)).encode()), t_ns)
        writer.finish()
    return path


def in_value(message: bytes) -> bytes:
    """A lone byte of Latin-1 in a string."""
    return message.replace(b'"map"', b'"m\xe4p"')


def in_key(message: bytes) -> bytes:
    """A lone continuation byte in the name of a field that is read."""
    return message.replace(b'"position"', b'"posi\x80tion"')


def in_other_key(message: bytes) -> bytes:
    """A truncated character in the name of a field that is not read."""
    return message.replace(b'"frame_id"', b'"frame\xe2\x82"')


def in_number(message: bytes) -> bytes:
    """A byte that no UTF-8 has in a number."""
    return message.replace(b'"x": ', b'"x": \xff', 1)


def surrogate(message: bytes) -> bytes:
    """Half of a surrogate pair, spelled in three bytes."""
    return message.replace(b'"map"', b'"\xed\xa0\x80"')


@pytest.mark.parametrize("damage", [in_value, in_key, in_other_key, in_number])
@pytest.mark.parametrize("at", [(0,), (7, 8, 150), tuple(range(0, N, 2))], ids=["first", "some", "half"])
def test_invalid_utf8_in_json_is_a_counted_loss(tmp_path, damage, at):
    messages = {k: damage(json.dumps(pose(k)).encode()) for k in at}
    for message in messages.values():
        with pytest.raises(UnicodeDecodeError):
            message.decode()
    path = written(tmp_path / "a.mcap", messages, {})
    reader = open_log(path)
    n_poses = sum(len(batch.pose) for batch in reader.batches())
    assert (n_poses, reader.losses.n_undecodable) == (N - len(at), len(at))


def test_half_a_surrogate_pair_beside_the_pose_is_counted_or_passed_over(tmp_path):
    messages = {k: surrogate(json.dumps(pose(k)).encode()) for k in (0, 8, 150)}
    reader = open_log(written(tmp_path / "a.mcap", messages, {}))
    n_poses = sum(len(batch.pose) for batch in reader.batches())
    assert n_poses + reader.losses.n_undecodable == N


@pytest.mark.parametrize("damage", [in_value, in_key])
def test_run_and_info_end_well_beside_invalid_utf8(tmp_path, damage):
    messages = {k: damage(json.dumps(pose(k)).encode()) for k in (7, 8, 150)}
    path = written(tmp_path / "a.mcap", messages, {})
    for command in (["info", path], ["run", path, "--out", tmp_path / "out"]):
        code, text = run(command)
        assert code == 0, text


NO_NUMBERS = ("abc", "", " ", "[1, 2]", "{}", "None", "0,5", "1e", "\x00", "½")
SENSELESS = ("nan", "inf", "-inf", "1e400", "-1e400", "-1", "0", "-0.0", "1e-320", "1e300")


@pytest.mark.parametrize("value", NO_NUMBERS + SENSELESS)
@pytest.mark.parametrize("key", ["alpha", "mass_kg", "wheel_radius_m", "half_track_m"])
def test_a_damaged_parameter_is_a_finding_and_left_out(tmp_path, key, value):
    try:
        assert not 1e-7 < float(value) < 1e6
    except ValueError:
        assert value in NO_NUMBERS
    path = written(tmp_path / "a.mcap", {}, PAPER_ROBOT.to_metadata() | {key: value})
    reader = open_log(path)
    (found,) = reader.findings
    assert (found.code, found.severity) == ("parameter_without_sense", "warning")
    assert f" {key}: " in found.text
    assert reader.robot.known() == {k: v for k, v in PAPER_ROBOT.known().items() if k != key}


@pytest.mark.parametrize("value", ["abc", "", "nan", "1e400", "-1", "[1, 2]"])
def test_run_and_info_end_well_and_name_the_damaged_alpha(tmp_path, value):
    path = written(tmp_path / "a.mcap", {}, PAPER_ROBOT.to_metadata() | {"alpha": value})
    for command in (["info", path], ["run", path, "--out", tmp_path / "out"]):
        code, text = run(command)
        assert code == 0, text
        assert "parameter_without_sense: metadata record wmr_replay: alpha: " in text
