"""Verification of a suite from another platform: other bytes pass only if the decoded columns agree."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

from wmr_replay.api.suite import SAME_BYTES, SAME_COLUMNS, compared
from wmr_replay.regress.decoded import first_difference
from wmr_schemas.signals import Log
from wmr_synth import SimulatedLog, record, synthesise
from wmr_synth.suites import MANIFEST, LogSpec, Suite, read_manifest, write_suite


@pytest.fixture(scope="module")
def simulated() -> SimulatedLog:
    return synthesise("stop-and-go", seed=3, duration_s=3)


def with_pose(simulated: SimulatedLog, **shift: float) -> SimulatedLog:
    pose = simulated.log.pose
    moved = replace(pose, **{name: getattr(pose, name) + by for name, by in shift.items()})
    log = Log(moved, simulated.log.torque, simulated.log.mode, simulated.log.robot)
    return replace(simulated, log=log)


@pytest.mark.parametrize(
    ("shift", "difference"),
    [
        ({}, None),
        ({"x_m": 5e-10}, None),
        ({"t_ns": 1}, None),
        ({"x_m": 1e-6}, "pose: column 0 at row 0"),
        ({"yaw_rad": 1e-6}, "pose: column 2 at row 0"),
        ({"t_ns": 50}, "pose: stamps differ"),
    ],
)
def test_rounding_is_no_difference_and_anything_larger_is(simulated, tmp_path, shift, difference):
    record(simulated, tmp_path / "a.mcap")
    record(with_pose(simulated, **shift), tmp_path / "b.mcap", encoding="ros2", chunk_bytes=10_000)
    assert (tmp_path / "a.mcap").read_bytes() != (tmp_path / "b.mcap").read_bytes()
    found = first_difference(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert (found is None) if difference is None else found.startswith(difference)


def test_another_length_and_a_log_beyond_use_are_differences(simulated, tmp_path):
    record(simulated, tmp_path / "a.mcap")
    record(synthesise("stop-and-go", seed=3, duration_s=2), tmp_path / "b.mcap")
    (tmp_path / "c.mcap").write_bytes(b"")
    (tmp_path / "d.mcap").write_bytes(b"")
    assert first_difference(tmp_path / "a.mcap", tmp_path / "b.mcap") == "pose: 301 rows, not 201"
    assert "the file is empty" in first_difference(tmp_path / "a.mcap", tmp_path / "c.mcap")
    assert first_difference(tmp_path / "c.mcap", tmp_path / "d.mcap") is None


def test_verify_takes_other_bytes_of_the_same_columns(tmp_path):
    """A log of other chunks, listed with its own hash: as a suite from another platform is."""
    log = LogSpec("log", "stop-and-go", 3, {"duration_s": 3.0})
    again = write_suite(Suite("own", 1, "", (log,)), tmp_path / "here")
    write_suite(Suite("own", 1, "", (log,)), tmp_path / "there")
    path = tmp_path / "there" / "log.mcap"
    assert outcome(tmp_path, again) == SAME_BYTES
    relist(path, synthesise("stop-and-go", seed=3, duration_s=3))
    assert outcome(tmp_path, again) == SAME_COLUMNS
    relist(path, synthesise("stop-and-go", seed=4, duration_s=3))
    assert outcome(tmp_path, again).startswith("pose: column 0")


def outcome(folder: Path, again) -> str:
    manifest = read_manifest(folder / "there")
    return compared(manifest.suite.logs[0], manifest, again, folder / "there", folder / "here")


def relist(path: Path, simulated: SimulatedLog) -> None:
    """Replace a log of a suite by another, and its hash in the manifest."""
    record(simulated, path, truth=True, chunk_bytes=10_000)
    manifest = json.loads((path.parent / MANIFEST).read_text())
    files = manifest["logs"][0]["files"]
    manifest["logs"][0]["files"] = {
        name: sha256((path.parent / name).read_bytes()).hexdigest() for name in files
    }
    (path.parent / MANIFEST).write_text(json.dumps(manifest))
