"""What is named on drives whose truth is known, what is not, and what calibration says."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.made_up_wheels import ROBOT, drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds, problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.calibrate import calibrate_wheel_speeds
from wmr_replay.gap.wheel_speed.modes import slip_mask
from wmr_replay.gap.wheel_speed.plausible import logs_apart
from wmr_replay.gap.wheel_speed.record import record_of
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log, WheelSpeedTrack

RTK = (0.01, 0.005)
OPTIONS = GapOptions(max_effects=8)


def spin(t_s):
    """The right wheel spins for a second, five times."""
    begins = np.array([8.0, 19.0, 31.0, 42.0, 53.0])
    since = t_s - begins[np.clip(np.searchsorted(begins, t_s, side="right") - 1, 0, 4)]
    return np.where((since >= 0) & (since < 1.0), 8.0 * np.sin(np.pi * since), 0.0)


def test_nothing_is_named_where_nothing_is_missing():
    result = analyse_wheel_speeds([drive({}, noise=RTK, seed=2)], None, OPTIONS)

    assert result.verdict == "nothing_missing"
    assert result.base_model == "wheel_speed"
    assert 0 < result.minimum_detectable["wheel_scale"].value < 0.02


def test_two_effects_are_named_with_intervals_that_hold_the_truth():
    truth = {"effective_track": {"ratio": 0.15}, "icr_offset": {"offset_m": 0.08}}
    result = analyse_wheel_speeds([drive(truth, noise=RTK, seed=4)], None, OPTIONS)

    assert result.verdict == "named"
    assert {effect.name for effect in result.effects} == set(truth)
    for effect in result.effects:
        (key,) = truth[effect.name]
        low, high = effect.parameters[key].ci95
        assert low <= truth[effect.name][key] <= high
    (icr,) = (effect for effect in result.effects if effect.name == "icr_offset")
    assert "pose_lever_arm" in icr.confound_class
    assert result.position.held_out.after < 0.5 * result.position.held_out.before
    assert result.odometry.position_rms_after_m < result.odometry.position_rms_before_m


def test_what_the_base_model_holds_is_not_missing():
    log = drive({"effective_track": {"ratio": 0.15}}, noise=RTK, seed=5)
    base = Model(robot=ROBOT, effects=(Effect("effective_track", {"ratio": 0.15}),))

    assert analyse_wheel_speeds([log], base, OPTIONS).verdict == "nothing_missing"


def test_a_spinning_wheel_is_a_mode_and_no_effect():
    log = drive({}, noise=RTK, seed=6, spin=spin)
    problem = problem_of([log], base_of(ROBOT, None), OPTIONS, "wheel_speed")
    mask, spins = slip_mask(problem), np.abs(spin(problem.record.pose_s + 0.5)) > 2.0

    assert mask[spins].mean() > 0.95
    assert mask[~spins].mean() < 0.15
    assert analyse_wheel_speeds([log], None, OPTIONS).verdict == "nothing_missing"


def test_a_steady_loss_in_an_interval_is_an_effect():
    truth = {"slip_interval": {"start_s": 22.0, "end_s": 29.0, "loss": 0.4}}
    result = analyse_wheel_speeds([drive(truth, noise=RTK, seed=14)], None, OPTIONS)

    assert [effect.name for effect in result.effects] == ["slip_interval"]
    found = result.effects[0].parameters
    assert found["loss"].value == pytest.approx(0.4, abs=0.03)
    assert found["start_s"].value == pytest.approx(22.0, abs=0.5)


def test_commands_show_the_lag_of_the_drive():
    log = drive({}, noise=(0.001, 0.002), seed=8, lag_s=0.25, seconds=30.0)
    result = analyse_wheel_speeds([log], None, GapOptions(max_effects=1), driven_by="command")

    assert result.effects[0].name == "actuator_lag"
    assert result.effects[0].parameters["time_constant_s"].value == pytest.approx(0.25, abs=0.03)


def test_calibration_finds_a_robot_that_spins_its_wheels():
    truth = {
        "wheel_scale": {"ratio": -0.05},
        "wheel_scale_difference": {"ratio": 0.01},
        "effective_track": {"ratio": 0.3},
        "icr_offset": {"offset_m": -0.06},
        "pose_delay": {"delay_s": 0.08},
    }
    model, notes = calibrate_wheel_speeds([drive(truth, noise=RTK, seed=9, spin=spin)], ROBOT)

    assert not notes
    for effect in model.effects:
        for key, value in effect.parameters.items():
            assert abs(value - truth[effect.name][key]) < 4 * effect.sd[key] + 1e-3, effect
    assert model.odometry.position_rms_after_m < model.odometry.position_rms_before_m


def test_what_straight_driving_does_not_show_is_left_out():
    log = drive({"wheel_scale": {"ratio": 0.03}}, noise=RTK, seed=10)
    straight = np.full(len(log.wheels), 5.0)
    wheels = type(log.wheels)(log.wheels.t_ns, straight, straight)
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    rng = np.random.default_rng(0)
    pose = type(log.pose)(
        log.pose.t_ns, 0.515 * t_s + rng.normal(0, 0.01, len(t_s)), *rng.normal(0, 0.005, (2, len(t_s)))
    )
    model, notes = calibrate_wheel_speeds([Log(pose, robot=ROBOT, wheels=wheels)], ROBOT)

    assert model.effects[0].name == "wheel_scale"
    assert model.effects[0].parameters["ratio"] == pytest.approx(0.03, abs=0.005)
    assert any("effective_track" in note for note in notes)


def test_several_logs_are_one_data_set():
    truth = {"wheel_scale": {"ratio": 0.06}}
    logs = [drive(truth, noise=RTK, seed=seed, seconds=20.0) for seed in (11, 12, 13)]

    assert record_of(logs, OPTIONS.gates.wheel_speed.layout).n_stretches == 3
    result = analyse_wheel_speeds(logs, None, OPTIONS)
    assert [effect.name for effect in result.effects] == ["wheel_scale"]


def test_a_pose_that_restarts_and_a_break_begin_a_stretch():
    log = drive({}, seconds=20.0)
    middle = len(log.pose) // 2
    x, y, yaw = (np.array(c) for c in (log.pose.x_m, log.pose.y_m, log.pose.yaw_rad))
    for column in (x, y, yaw):
        column[middle:] -= column[middle]
    restarted = Log(type(log.pose)(log.pose.t_ns, x, y, yaw), robot=ROBOT, wheels=log.wheels)
    broken = Log(log.pose, robot=ROBOT, wheels=log.wheels, breaks_ns=(int(log.pose.t_ns[middle]),))
    layout = OPTIONS.gates.wheel_speed.layout

    assert record_of([log], layout).n_stretches == 1
    for one in (restarted, broken):
        assert record_of([one], layout).first_pose.tolist() == [0, middle, len(log.pose)]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"wheels": None}, "no measured wheel speeds"),
        ({"robot": type(ROBOT)(wheel_radius_m=0.1)}, "half_track_m needed"),
    ],
)
def test_a_log_without_what_is_needed_is_refused(change, said):
    log = drive({}, seconds=20.0)
    parts = {"robot": ROBOT, "wheels": log.wheels} | change
    with pytest.raises(InvalidSignal, match=said):
        analyse_wheel_speeds([Log(log.pose, **parts)], None, OPTIONS)


def turned(log, left, right):
    """The log with other wheel speeds."""
    return replace(log, wheels=WheelSpeedTrack(log.wheels.t_ns, left, right))


def test_wheels_that_contradict_the_motion_are_refused():
    log = drive({}, noise=RTK, seed=15, seconds=30.0)
    left, right = log.wheels.left_radps, log.wheels.right_radps
    still = np.zeros_like(left)

    for one, said in ((turned(log, -left, -right), "turn backward"), (turned(log, right, left), "swapped")):
        with pytest.raises(InvalidSignal, match=said):
            calibrate_wheel_speeds([one], ROBOT)
    with pytest.raises(InvalidSignal, match="in log 2 the wheels turn backward"):
        calibrate_wheel_speeds([log, turned(log, -left, -right)], ROBOT)
    with pytest.raises(InvalidSignal, match="the wheels drive 0 m"):
        calibrate_wheel_speeds([turned(log, still, still)], ROBOT)


def test_logs_of_two_robots_are_said():
    logs = [drive({"wheel_scale": {"ratio": r}}, noise=RTK, seed=16, seconds=30.0) for r in (0.0, -0.3)]
    problem = problem_of(logs, base_of(ROBOT, None), OPTIONS, "wheel_speed")

    assert "roll 1.00, 0.70 times as far as stated" in logs_apart(problem)[0]
    assert logs_apart(problem_of(logs[:1] * 2, base_of(ROBOT, None), OPTIONS, "wheel_speed")) == ()
