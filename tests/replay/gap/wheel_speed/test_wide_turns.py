"""Tyres that scrub widen the track more in wide turns than on the spot: held by a base, not named."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.made_up_wheels import ROBOT, drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import Estimate
from wmr_replay.gap.wheel_speed import calibrate
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds
from wmr_replay.gap.wheel_speed.calibrate import calibrate_wheel_speeds, form_left
from wmr_replay.gap.wheel_speed.predict import Parameter
from wmr_replay.gap.wheel_speed.remarks import of_one_wheel, remarks_on
from wmr_replay.gap.wheel_speed.rolling import widened_by_turns

RTK = (0.01, 0.005)
SCRUBS = {"effective_track": {"ratio": 0.4}, "wide_turn_scrub": {"ratio": 0.25}}


@pytest.fixture(scope="module")
def base():
    return calibrate_wheel_speeds([drive(SCRUBS, noise=RTK, seed=31)], ROBOT).model


def held(model):
    return {effect.name: effect.parameters for effect in model.effects}


def test_one_log_shows_how_the_track_goes_by_the_turn(base):
    assert held(base)["wide_turn_scrub"]["ratio"] == pytest.approx(0.25, abs=0.06)
    assert held(base)["effective_track"]["ratio"] == pytest.approx(0.4, abs=0.02)


def test_a_robot_that_does_not_scrub_holds_none():
    model = calibrate_wheel_speeds([drive({}, noise=RTK, seed=32)], ROBOT).model
    assert "wide_turn_scrub" not in held(model)
    assert "lateral_slip" not in model.misfit


def test_no_other_track_is_named_on_another_drive(base):
    log = drive(SCRUBS, noise=RTK, seed=33)
    assert analyse_wheel_speeds([log], base, GapOptions()).verdict == "nothing_missing"


def test_another_track_is_named_beside_it(base):
    other = SCRUBS | {"effective_track": {"ratio": 1.4 * 1.25 - 1}}
    result = analyse_wheel_speeds([drive(other, noise=RTK, seed=34)], base, GapOptions())
    assert [effect.name for effect in result.effects] == ["effective_track"]
    low, high = result.effects[0].parameters["ratio"].ci95
    assert low < 0.25 < high


def test_the_track_is_that_of_the_model_half_way_between_the_tightest_turn_and_the_widest():
    effects = {"wide_turn_scrub": {"ratio": 0.2}}
    ahead, around = np.array([0.0, 3.0, -3.0, 1.0, 0.0]), np.array([0.5, 1.0, 1.0, 0.0, 0.0])
    assert widened_by_turns(ahead, around, effects, 1) == pytest.approx([0.9, 1.0, 1.0, 1.1, 0.9])
    assert np.all(widened_by_turns(ahead, around, {}, 1) == 1.0)


@pytest.mark.parametrize(("held", "left"), [(True, 0.0), (False, 0.05 / 2)])
def test_a_track_is_open_by_what_the_log_leaves_of_how_it_goes_by_the_turn(monkeypatch, held, left):
    values = {"wide_turn_scrub": {"ratio": 0.03}}
    trial = SimpleNamespace(values=values, parameters=[Parameter("wide_turn_scrub", "ratio")], sd=[0.04])
    monkeypatch.setattr(calibrate, "fitted_with", lambda *_: trial)
    assert form_left(None, SimpleNamespace(values=values if held else {})) == pytest.approx(left)


def size(value, half=0.001):
    return Estimate(value, (value - half, value + half), "1")


@pytest.mark.parametrize(
    ("both", "apart", "said"),
    [
        (-0.0095, 0.0096, "left wheel alone: -1.90%"),
        (0.02, 0.0198, "right wheel alone: +4.02%"),
        (-0.007, 0.00544, "left wheel alone: -1.24%"),
        (0.02, 0.005, ""),
    ],
)
def test_one_wheel_of_another_size_is_said_to_be_one(both, apart, said):
    notes = [*of_one_wheel(size(both), size(apart))]
    assert len(notes) == bool(said)
    assert all(said in note for note in notes)


@pytest.mark.parametrize(
    ("delay_s", "measured", "said"), [(-0.108, True, True), (0.108, True, False), (-0.108, False, False)]
)
def test_measured_wheel_speeds_that_are_late_are_said_to_be(delay_s, measured, said):
    late = SimpleNamespace(name="pose_delay", parameters={"delay_s": size(delay_s)})
    notes = [*remarks_on([late], measured=measured)]
    assert [("0.108 s later" in note) for note in notes] == [True] * said
