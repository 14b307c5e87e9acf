"""Drives out of files, played by the simulator."""

import numpy as np
import pytest

from wmr_schemas.drive_file import Controller, DriveFile, drive_to_toml
from wmr_schemas.errors import InvalidFile, InvalidSetting
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_synth import World, synthesise
from wmr_synth.driving.patrol import SMALL_ROBOT

KNOTS = (0.0, 1.0, 3.0, 4.0, 5.0)
SPEED, TURN = (0.0, 0.8, 0.8, 0.0, 0.0), (0.0, 0.4, -0.4, 0.0, 0.0)
LIMIT_NM = 5.0


@pytest.fixture
def played(tmp_path):
    """``played(drive, …)``: the log that the file gives."""

    def play(drive: DriveFile, **options):
        file = tmp_path / "drive.toml"
        file.write_text(drive_to_toml(drive))
        return synthesise(str(file), **options)

    return play


def by_speeds(robot: RobotParameters = SMALL_ROBOT, limit_nm: float = LIMIT_NM) -> DriveFile:
    return DriveFile("turn", "speeds", KNOTS, SPEED, TURN, robot, Controller(2.0, 0.5, limit_nm))


def test_speeds_are_followed_to_within_a_torque_step(played):
    made = played(by_speeds(), world=World())
    t_s = made.truth.t_ns / 1e9
    assert np.max(np.abs(made.truth.v_long_mps - np.interp(t_s, KNOTS, SPEED))) < 0.01
    assert np.max(np.abs(made.truth.yaw_rate_radps - np.interp(t_s, KNOTS, TURN))) < 0.01
    assert set(made.log.mode.mode) == {ContactMode.IDEAL}
    assert made.facts["scenario"] == "turn"
    assert made.facts["duration_s"] == 5.0


def test_no_torque_exceeds_the_controllers_limit(played):
    made = played(by_speeds(limit_nm=1.0))
    torques = np.abs([made.log.torque.left_nm, made.log.torque.right_nm])
    assert np.max(torques) == pytest.approx(1.0)


def test_torques_are_played_as_they_are(played):
    drive = DriveFile("pulse", "torques", (0.0, 1.0, 2.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), SMALL_ROBOT)
    made = played(drive, world=World())
    t_s = (made.log.torque.t_ns - made.log.torque.t_ns[0]) / 1e9
    assert np.array_equal(made.log.torque.left_nm[t_s < 0.995], np.full(100, 0.5))
    assert np.array_equal(made.log.torque.left_nm[(t_s > 0.995) & (t_s < 1.995)], np.full(100, -0.5))
    at_one = np.searchsorted(made.truth.t_ns, 1_000_000_000)
    assert made.truth.v_long_mps[at_one] == pytest.approx(SMALL_ROBOT.alpha, rel=1e-6)


def test_one_seed_gives_one_log(played):
    one, other = played(by_speeds(), seed=4), played(by_speeds(), seed=4)
    assert np.array_equal(one.log.pose.x_m, other.log.pose.x_m)


def test_what_cannot_be_played_is_refused(played, tmp_path):
    with pytest.raises(InvalidSetting, match="alpha and half_track_m"):
        played(by_speeds(RobotParameters(wheel_radius_m=0.1)))
    with pytest.raises(InvalidFile, match="cannot be read"):
        synthesise(str(tmp_path / "none.toml"))
