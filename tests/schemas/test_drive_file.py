"""Drive files: what is written reads back, and what is wrong is named."""

from dataclasses import replace

import pytest

from wmr_schemas.drive_file import Controller, DriveFile, drive_to_toml, read_drive
from wmr_schemas.errors import InvalidFile
from wmr_schemas.robot import RobotParameters

ROBOT = RobotParameters(alpha=0.25, half_track_m=0.3, wheel_radius_m=0.1)
SPEEDS = DriveFile(
    "turn",
    "speeds",
    (0.0, 1.0, 2.5),
    (0.0, 1.0, 0.0),
    (0.0, -0.5, 0.0),
    ROBOT,
    Controller(2.0, 0.5, 4.0),
    "a turn",
)
TORQUES = replace(SPEEDS, follow="torques", controller=None)


ON_A_PATH = replace(SPEEDS, controller=Controller(2.0, 0.5, 4.0, 0.6, 0.8, 1.2))


@pytest.mark.parametrize("drive", [SPEEDS, TORQUES, ON_A_PATH])
def test_a_drive_reads_back_as_it_was_written(drive, tmp_path):
    file = tmp_path / "drive.toml"
    file.write_text(drive_to_toml(drive))
    assert read_drive(file) == drive
    assert drive.duration_s == 2.5


@pytest.mark.parametrize(
    ("found", "instead", "said"),
    [
        ("2.5", "0.5", r"\[drive\] t_s: expected two times or more, increasing"),
        ("speeds", "spirit", r"\[drive\] follow: expected speeds or torques, found 'spirit'"),
        ("limit_nm = 4.0", "limit_nm = 0.0", r"\[controller\].*limit above 0"),
        ("limit_nm = 4.0", "", r"\[controller\].*lacks limit_nm"),
        ("heading_per_s = 0.0", "heading_per_s = 1.2", r"\[controller\].*belong together"),
        ("ahead_per_s = 0.0", "ahead_per_s = -1.2", r"\[controller\].*not be negative"),
        ("-0.5,", "", r"\[drive\] yaw_rate_radps: 2 values for 3 times"),
        ("-0.5,", "true,", "yaw_rate_radps: expected a list of finite numbers"),
        ("[controller]", "[control]", "unknown key"),
        ("name =", "title =", r"\[drive\].*title"),
    ],
)
def test_a_wrong_drive_is_told_with_its_key(found, instead, said, tmp_path):
    file = tmp_path / "drive.toml"
    text = drive_to_toml(SPEEDS)
    assert found in text
    file.write_text(text.replace(found, instead))
    with pytest.raises(InvalidFile) as error:
        read_drive(file)
    assert str(file) in str(error.value)
    assert error.match(f".*{said}")


def test_speeds_need_a_controller_and_torques_none(tmp_path):
    file = tmp_path / "drive.toml"
    for drive in (replace(SPEEDS, controller=None), replace(TORQUES, controller=SPEEDS.controller)):
        file.write_text(drive_to_toml(drive))
        with pytest.raises(InvalidFile, match="controller"):
            read_drive(file)
