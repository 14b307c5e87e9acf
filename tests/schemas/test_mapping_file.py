"""``robot.toml``: the mapping of topics, and each rejected input with the key at fault."""

import re
from pathlib import Path

import pytest

from wmr_schemas import RobotParameters
from wmr_schemas.errors import InvalidFile
from wmr_schemas.mapping_file import LogMapping, read_mapping

FULL = """
[pose]
topic = "/vicon/pose"
[torque]
topic = "/joint_states"
left = ["front_left", "rear_left"]
right = "right"
[truth]
topic = "/mode"
[robot]
alpha = 0.5
half_track_m = 0.2
average_speed_mps = "auto"
"""


def read_text(tmp_path: Path, text: str) -> LogMapping:
    path = tmp_path / "robot.toml"
    path.write_text(text, encoding="utf-8")
    return read_mapping(path)


def test_every_key_is_read(tmp_path: Path) -> None:
    assert read_text(tmp_path, FULL) == LogMapping(
        pose_topic="/vicon/pose",
        torque_topic="/joint_states",
        left_joints=("front_left", "rear_left"),
        right_joints=("right",),
        truth_topic="/mode",
        robot=RobotParameters(alpha=0.5, half_track_m=0.2, average_speed_mps="auto"),
    )


def test_an_empty_file_leaves_everything_to_be_found(tmp_path: Path) -> None:
    assert read_text(tmp_path, "") == LogMapping(None, None, (), (), None, None)


def test_an_empty_robot_is_a_robot_of_which_nothing_is_known(tmp_path: Path) -> None:
    assert read_text(tmp_path, "[robot]\n").robot == RobotParameters()


REFUSALS = {
    "speed = 1": "speed: unknown key; known are pose, torque, truth, robot",
    "robot_from_log = 1": "robot_from_log: expected true or false, found 1",
    "[torque]\nspeed_unit = 'mph'": "[torque] speed_unit: expected rad/s, rpm, deg/s or rev/s, found 'mph'",
    "[torque]\ntorque_scale = 0": "[torque] torque_scale: expected a number above 0, found 0",
    "[torque]\nleft_speed_sign = 2": "[torque] left_speed_sign: expected 1 or -1, found 2",
    "[pose]\nposition_scale = -1": "[pose] position_scale: expected a number above 0, found -1",
    "[pose]\nyaw_unit = 3": "[pose] yaw_unit: expected rad or deg, found 3",
    "pose = '/pose'": "[pose]: expected a table, found '/pose'",
    "[pose]\nname = 'x'": "[pose] name: unknown key; known are topic",
    "[torque]\nwheels = []": "[torque] wheels: unknown key; known are topic, left, right",
    "[truth]\nname = 'x'": "[truth] name: unknown key; known are topic",
    "[pose]\ntopic = 1": "[pose] topic: expected a string, found 1",
    "[torque]\ntopic = []": "[torque] topic: expected a string, found []",
    "[truth]\ntopic = true": "[truth] topic: expected a string, found True",
    "[torque]\nleft = 3": "[torque] left: expected a list of joint names, found 3",
    "[torque]\nright = ['a', 1]": "[torque] right: expected a list of joint names, found ['a', 1]",
    "robot = 1": "[robot]: expected a table, found 1",
    "[robot]\nalpha = -1": "[robot] alpha: expected a number above 0, found -1",
    "[robot]\nr = 1": "[robot] r: unknown key; known are alpha, ",
    "[pose": "is not TOML: ",
}


@pytest.mark.parametrize(("text", "message"), REFUSALS.items(), ids=REFUSALS.values())
def test_a_bad_mapping_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidFile, match=rf"robot\.toml: {re.escape(message)}"):
        read_text(tmp_path, text)


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match=r"cannot be read \(No such file or directory\)$"):
        read_mapping(tmp_path / "robot.toml")
