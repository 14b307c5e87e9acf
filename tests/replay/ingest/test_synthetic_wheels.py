"""A synthetic log of a robot by wheel speeds, read back as it was made."""

import numpy as np
import pytest

from wmr_replay.ingest.between import Between
from wmr_replay.ingest.tracks import read_whole
from wmr_replay.regress.decoded import first_difference
from wmr_schemas.mapping_file import LogMapping
from wmr_synth import record, synthesise


def written(path, encoding, commands, seed=2):
    made = synthesise("skid-steer", seed=seed, duration_s=3.0, commands_as=commands)
    record(made, path, encoding=encoding)
    return made.log


@pytest.mark.parametrize("encoding", ["ros2", "protobuf", "json"])
@pytest.mark.parametrize("commands", ["wheels", "twist", "none"])
def test_pose_wheel_speeds_and_commands_come_back(tmp_path, encoding, commands):
    path = tmp_path / "a.mcap"
    made = written(path, encoding, commands)
    read = read_whole(path, LogMapping(), Between(), need="wheel_speed").log
    assert read.torque is None
    assert read.robot == made.robot
    assert np.array_equal(read.pose.x_m, made.pose.x_m)
    for name in ("t_ns", "left_radps", "right_radps"):
        assert np.array_equal(getattr(read.wheels, name), getattr(made.wheels, name)), name
    if commands == "none":
        assert read.commands is None
        return
    assert np.array_equal(read.commands.t_ns, made.commands.t_ns)
    assert read.commands.left_radps == pytest.approx(made.commands.left_radps, abs=1e-9)
    assert read.commands.right_radps == pytest.approx(made.commands.right_radps, abs=1e-9)


def test_two_logs_that_differ_in_their_commands_alone_are_not_the_same(tmp_path):
    for name, commands in (("a", "wheels"), ("b", "wheels"), ("c", "none")):
        written(tmp_path / f"{name}.mcap", "ros2", commands)
    assert first_difference(tmp_path / "a.mcap", tmp_path / "b.mcap") is None
    assert "command" in (first_difference(tmp_path / "a.mcap", tmp_path / "c.mcap") or "")
