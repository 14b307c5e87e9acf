"""Robots that stick in yaw until their torques overcome a dry friction.

The oracle has no creep: its yaw rate is 0 as long as the torques are below the friction.
"""

from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions, calibrate
from wmr_replay.gap.estimation import calibrate as calibrate_module
from wmr_replay.gap.estimation.calibrate import calibrate_on_log, sticking
from wmr_replay.gap.estimation.sticking import rough_sticking
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.rests import likelier
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.model_file import model_to_toml, read_model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

SETTINGS = GateSettings()
ALPHA, ALPHA_YAW, HALF_TRACK_M, STEP_S, N = 0.16, 0.14, 0.25, 0.01, 8000
ROBOT = RobotParameters(half_track_m=HALF_TRACK_M, wheel_radius_m=0.1)


def after(w: float, push: float, friction: float) -> float:
    """The speed in yaw [m/s] one step after ``w``, under a push and a dry friction [m/s²]."""
    free = w + STEP_S * push
    return float(np.sign(free) * max(abs(free) - STEP_S * friction, 0.0))


@lru_cache
def driven(friction_mps2: float) -> Log:
    """80 s of a robot whose heading controller winds up while the robot sticks, without noise of the pose."""
    rng = np.random.default_rng(5)
    v, w, heading_error, pose = 0.0, 0.0, 0.0, np.zeros(3)
    poses, torques = np.empty((3, N)), np.empty((2, N))
    for k in range(N):
        if k % 400 == 0:
            wanted = rng.uniform(-0.3, 0.8), rng.choice([0.0, 0.0, 0.15, -0.15, 0.25, -0.25])
            heading_error = 0.0
        error = wanted[1] - w
        heading_error += error * STEP_S
        asked = 2.0 * (wanted[0] - v) / ALPHA, (3.0 * error + 2.0 * heading_error) / ALPHA_YAW
        poses[:, k], torques[:, k] = pose, ((asked[0] - asked[1]) / 2, (asked[0] + asked[1]) / 2)
        turned = w
        v, w = v + STEP_S * ALPHA * asked[0], after(w, ALPHA_YAW * asked[1], friction_mps2)
        at = pose[2] + (turned + w) / 2 / HALF_TRACK_M * STEP_S / 2
        pose = pose + STEP_S * np.array([v * np.cos(at), v * np.sin(at), (turned + w) / 2 / HALF_TRACK_M])
    poses += np.array([[1e-3], [1e-3], [1e-3]]) * rng.normal(size=(3, N))
    none, t_ns = np.full(N, np.nan), np.arange(N, dtype=np.int64) * 10_000_000
    return Log(PoseTrack(t_ns, *poses), TorqueTrack(t_ns, *torques, none, none), None, ROBOT)


def test_a_calibration_finds_the_yaw_gain_and_the_friction_of_a_robot_that_sticks():
    found = calibrate(driven(0.3), ROBOT)
    (held,) = (one for one in found.effects if one.name == "scrub_torque")
    assert found.robot.alpha == pytest.approx(ALPHA, rel=0.05)
    assert found.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.1)
    assert held.parameters["d0_mps2"] == pytest.approx(0.3, rel=0.1)
    assert held.sign_change_mps <= 0.005
    assert found.misfit["yaw_inertia"] < 0.25  # a quarter of the torques' share that the friction takes


def test_the_friction_holds_the_robot_until_the_torques_overcome_it():
    log, options = driven(0.3), GapOptions()
    rolling = calibrate_on_log(log, options)
    found = sticking(rolling, log, options)
    assert rolling.model.robot.alpha_yaw < 0.92 * ALPHA_YAW
    assert found.model.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.05)
    (held,) = found.model.effects
    assert held.sign_change_mps == SETTINGS.sticking.sign_change_mps
    assert held.parameters["d0_mps2"] == pytest.approx(0.3, rel=0.1)
    assert sticking(calibrate_on_log(driven(0.0), options), driven(0.0), options) is None
    assert likelier([rolling, found]) is found
    assert likelier([found]) is found


def test_a_robot_without_friction_holds_none():
    found = calibrate(driven(0.0), ROBOT)
    assert found.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.05)
    assert "scrub_torque" not in {one.name for one in found.effects}


def test_the_friction_and_its_form_are_kept_in_a_model_file(tmp_path):
    found = calibrate(driven(0.3), ROBOT)
    path = tmp_path / "robot.model.toml"
    path.write_text(model_to_toml(found), encoding="utf-8")
    read = read_model(path)
    assert [(one.name, one.sign_change_mps) for one in read.effects] == [
        (one.name, one.sign_change_mps) for one in found.effects
    ]


@pytest.mark.parametrize(("friction_mps2", "tried"), [(0.3, True), (0.0, False)])
def test_friction_is_tried_where_the_windows_of_turning_show_some(friction_mps2, tried):
    start = rough_sticking(
        bin_log(driven(friction_mps2), SETTINGS),
        ROBOT.overridden_by(RobotParameters(alpha=ALPHA)),
        SETTINGS.sticking,
    )
    assert (start is not None) is tried
    if start is not None:
        assert start.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.25)
        assert dict(start.holding.known)["scrub_torque"]["d0_mps2"] == pytest.approx(0.3, rel=0.25)


def test_a_robot_that_drives_straight_on_has_no_windows_to_tell():
    log = driven(0.3)
    straight = PoseTrack(log.pose.t_ns, np.linspace(0.0, 40.0, N), np.zeros(N), np.zeros(N))
    binned = bin_log(Log(straight, log.torque, None, ROBOT), SETTINGS)
    assert (
        rough_sticking(binned, ROBOT.overridden_by(RobotParameters(alpha=ALPHA)), SETTINGS.sticking) is None
    )


def test_a_stiffness_of_tyres_that_none_was_stated_of_is_none_of_the_robot(monkeypatch):
    """It was a rest of the log, relative to a usual skid."""
    robot = RobotParameters(alpha=0.3, alpha_yaw=0.2, half_track_m=0.25)
    sizes = {
        "payload": {"mass_ratio": 0.2},
        "yaw_inertia": {"ratio": 0.0},
        "cornering_stiffness": {"ratio": 2.0},
    }
    fit = SimpleNamespace(
        extension=Extension(base_of(robot), sizes),
        keys=[(name, key) for name, size in sizes.items() for key in size],
    )
    spread = np.diag(np.full(3, 1e-4)), 10
    monkeypatch.setattr(calibrate_module, "robust_covariance", lambda *_: spread)
    changed, sd = calibrate_module.calibrated(robot, None, fit)
    assert changed.cornering_stiffness_over_epsilon is None
    assert changed.alpha == pytest.approx(0.25)
    assert set(sd) == {"alpha", "alpha_yaw"}
