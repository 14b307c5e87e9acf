"""``robot.toml``: the mapping of topics, and each rejected input with the key at fault."""

import math
import re
from pathlib import Path

import pytest

from wmr_schemas import RobotParameters
from wmr_schemas.errors import InvalidFile
from wmr_schemas.mapping_file import LogMapping, mapping_toml, read_mapping

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
    "speed = 1": "speed: unknown key; known are pose, torque, truth, wheel_speeds, commands, robot",
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
    "[wheel_speeds]\nspeed = 1": "[wheel_speeds] speed: unknown key; known are topic, left, right, names",
    "[wheel_speeds]\nunit = 'erpm'": "[wheel_speeds] unit: expected rad/s, rpm, deg/s, rev/s, m/s, rad, deg, "
    "rev or ticks, found 'erpm'",
    "[wheel_speeds]\nunit = 'ticks'": '[wheel_speeds] ticks_per_rev: has to be given with unit = "ticks"',
    "[wheel_speeds]\nticks_per_rev = 0": "[wheel_speeds] ticks_per_rev: expected a number above 0, found 0",
    "[wheel_speeds]\nticks_per_rev = 9\nunit = 'rpm'": "[wheel_speeds] ticks_per_rev: goes with unit = ",
    "[wheel_speeds]\nwraps_at = 65536": "[wheel_speeds] wraps_at: is for positions: give unit",
    "[wheel_speeds]\nleft_fields = 'a'": "[wheel_speeds] right_fields: has to be given with left_fields",
    "[wheel_speeds]\nlinear = 'v'": "[wheel_speeds] angular: has to be given with linear",
    "[wheel_speeds]\nleft = 3": "[wheel_speeds] left: expected a list of joint names, found 3",
    "[commands]\nunit = 'rad'": "[commands] unit: expected rad/s, rpm, deg/s, rev/s or m/s, found 'rad'",
    "[commands]\nscale = -1": "[commands] scale: expected a number above 0, found -1",
    "[commands]\nticks_per_rev = 9": "[commands] ticks_per_rev: unknown key; known are topic, left, right",
    "[commands]\nlinear = 'v'\nangular = 'w'\nunit = 'm/s'": "[commands] unit: a twist is in m/s and rad/s",
    "[commands]\nleft_sign = 2": "[commands] left_sign: expected 1 or -1, found 2",
    "[commands]\ntopic = 3": "[commands] topic: expected a string, found 3",
    "[pose": "is not TOML: ",
}


@pytest.mark.parametrize(("text", "message"), REFUSALS.items(), ids=REFUSALS.values())
def test_a_bad_mapping_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InvalidFile, match=rf"robot\.toml: {re.escape(message)}"):
        read_text(tmp_path, text)


ENCODERS = """
[wheel_speeds]
topic = "/encoders"
left_fields = ["ticks[0]", "ticks[2]"]
right_fields = ["ticks[1]", "ticks[3]"]
right_sign = -1
gear_ratio = 4
ticks_per_rev = 2048
wraps_at = 65536

[commands]
topic = "/motors"
left = ["a"]
right = "b"
unit = "rpm"
scale = 0.5
"""


def test_wheel_speeds_and_commands_are_read_and_written_again(tmp_path: Path) -> None:
    mapping = read_text(tmp_path, ENCODERS)
    assert mapping.wheel_speeds.are_positions
    left, right = mapping.wheel_speeds.gains(wheel_radius_m=9.0)
    assert (left, right) == pytest.approx((math.tau / 2048 / 4, -math.tau / 2048 / 4))
    assert mapping.command_joints == (("a",), ("b",))
    assert mapping.commands.gains(1.0) == pytest.approx((math.tau / 120, math.tau / 120))
    assert read_text(tmp_path, mapping_toml(mapping)) == mapping


def test_the_speed_of_a_rim_is_turned_by_the_wheels_radius(tmp_path: Path) -> None:
    mapping = read_text(tmp_path, "[wheel_speeds]\nunit = 'm/s'\n")
    assert mapping.wheel_speeds.gains(0.25) == (4.0, 4.0)


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InvalidFile, match=r"cannot be read \(No such file or directory\)$"):
        read_mapping(tmp_path / "robot.toml")
