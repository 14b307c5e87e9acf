"""How calibration logs differ is part of a base's uncertainty: sizes by hand, no code of the analysis."""

from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.settings.wheel_speed import WheelSpeedSettings
from wmr_replay.gap.wheel_speed.base import Base
from wmr_replay.gap.wheel_speed.between_logs import (
    CENTRE_SD,
    CREEP_SD_OF_ONE,
    MOVES_SD_OF_ONE,
    SCRUB_SD,
    SCRUBS,
    SIDES_SD,
    TURNING_SD,
    misfit_between,
    of_scrubbing,
    sd_of_another_log,
    sides_apart_m,
    variance_between,
)
from wmr_replay.gap.wheel_speed.drive import Chassis
from wmr_replay.gap.wheel_speed.evidence import hardly_turns, within_calibration
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters

GATES = WheelSpeedSettings().gates


def fit_of(size, sd, effect="wheel_scale", key="ratio"):
    which = SimpleNamespace(effect=effect, key=key)
    values = {effect: {key: size}}
    return SimpleNamespace(parameters=(which,), sizes=np.array([size]), sd=np.array([sd]), values=values)


ROBOT = SimpleNamespace(chassis=Chassis(0.1, 0.25))


def test_one_log_says_no_more_than_its_own_deviation():
    assert sd_of_another_log(ROBOT, fit_of(0.01, 0.002), []) == pytest.approx([0.002])


def test_one_log_does_not_show_how_far_the_centre_of_rotation_moves():
    centre = fit_of(0.01, 0.0006, "icr_offset", "offset_m")
    assert sd_of_another_log(ROBOT, centre, []) == pytest.approx([np.hypot(0.0006, CENTRE_SD * 0.25)])
    assert sd_of_another_log(ROBOT, centre, [(None, centre)] * 2) == pytest.approx([0.0006])


def test_logs_that_differ_by_more_than_their_noise_widen_the_deviation():
    alone = [(None, fit_of(0.00, 0.002)), (None, fit_of(0.04, 0.002))]
    between = 0.0008 - 0.002**2
    expected = np.sqrt(0.001**2 + 1.5 * between)
    assert sd_of_another_log(ROBOT, fit_of(0.02, 0.001), alone) == pytest.approx([expected])


def test_logs_that_differ_by_their_noise_do_not():
    alone = [(None, fit_of(0.019, 0.01)), (None, fit_of(0.021, 0.01))]
    assert sd_of_another_log(ROBOT, fit_of(0.02, 0.007), alone) == pytest.approx([0.007])


def test_a_scrubbing_track_is_known_no_better_than_its_form():
    same = fit_of(1.4, 0.001, "effective_track")
    sd = sd_of_another_log(ROBOT, same, [(None, same), (None, same)])
    assert sd == pytest.approx([np.hypot(0.001, SCRUB_SD * 1.4)])
    problem = SimpleNamespace(chassis=Chassis(0.1, 0.25))
    assert sides_apart_m(problem, same) == pytest.approx(SIDES_SD * 1.4 * 0.25)


@pytest.mark.parametrize(
    ("sizes", "sds", "expected"),
    [
        ((0.0, 1.4), (0.015, 0.015), 0.98 - 0.015**2),
        ((0.01, 0.02), (0.02, 0.02), 0.0),
        ((0.04, 0.3), (0.02, 0.5), 0.0004),
    ],
    ids=["two drives differ", "noise", "one log hardly shows it"],
)
def test_what_single_logs_show_beside_the_base(sizes, sds, expected):
    """By hand: with one noise it is mean(x²) − s²; a log that hardly shows it takes part with its x² less."""
    found = variance_between(np.array(sizes)[:, None], np.square(sds)[:, None])
    assert found == pytest.approx(expected, rel=0.5, abs=1e-9)
    if found:
        assert np.sum(np.square(sizes) / (np.square(sds) + found)) == pytest.approx(2.0)


def test_a_rest_of_the_size_of_the_misfit_is_no_finding():
    held = Effect("wheel_scale", {"ratio": 0.01}, {"ratio": 0.001})
    base = Base(RobotParameters(), (held,), "model file", misfit={"turning_slip": 0.1, "wheel_scale": 9.0})
    assert base.values_sd == {"turning_slip": {"s_per_m": 0.1}, "wheel_scale": {"ratio": 0.001 / 1.01}}
    small, large = (fit_of(size, 0.01, "turning_slip", "s_per_m") for size in (0.2, 0.6))
    assert within_calibration(base.values_sd, small, "turning_slip", GATES)
    assert not within_calibration(base.values_sd, large, "turning_slip", GATES)


@pytest.mark.parametrize(("turned_rad", "doubted"), [(0.1, True), (2.0, False)])
def test_a_log_that_hardly_turns_does_not_doubt_a_calibrated_track(turned_rad, doubted):
    measured = np.stack([np.zeros(50), np.zeros(50), np.linspace(0, turned_rad, 50)])
    settings = WheelSpeedSettings()
    known = {"effective_track": {"ratio": 0.02}}
    problem = SimpleNamespace(measured=measured, settings=settings, base_sd=known)
    assert hardly_turns(problem, "effective_track") is doubted
    assert hardly_turns(problem, "unnamed:yaw_rate:v*v*yaw_rate") is doubted
    assert not hardly_turns(problem, "unnamed:yaw_rate:v")
    assert not hardly_turns(problem, "unnamed:v_lat:v*yaw_rate")
    assert not hardly_turns(
        SimpleNamespace(measured=measured, settings=settings, base_sd={}), "effective_track"
    )


def test_a_robot_that_scrubs_slips_ahead_in_turns_otherwise_on_another_drive():
    wide, narrow = fit_of(1.2, 0.01, "effective_track"), fit_of(0.0, 0.01, "effective_track")
    found = of_scrubbing(ROBOT, wide, n_logs=2)
    assert found["turning_slip"] == pytest.approx(1.2 * TURNING_SD)
    assert found["pose_lever_arm"] == pytest.approx(sides_apart_m(ROBOT, wide))
    assert set(of_scrubbing(ROBOT, narrow, n_logs=1, form_sd=0.1).values()) == {0.0}


def test_a_robot_that_scrubs_is_known_by_one_log_less_well_than_by_two():
    wide = fit_of(0.4, 0.01, "effective_track")
    one, two = (of_scrubbing(ROBOT, wide, n_logs=n) for n in (1, 2))
    assert {"icr_offset", "lateral_slip"} == one.keys() - two.keys()
    assert one["icr_offset"] == pytest.approx(MOVES_SD_OF_ONE * 0.25)
    assert of_scrubbing(ROBOT, fit_of(SCRUBS / 4, 0.01, "effective_track"), n_logs=1)[
        "lateral_slip"
    ] == pytest.approx(CREEP_SD_OF_ONE / 4)
    assert one["effective_track"] == two["effective_track"] == pytest.approx(SCRUB_SD * 0.4)
    by_turn = of_scrubbing(ROBOT, wide, n_logs=1, form_sd=0.05)["effective_track"]
    assert by_turn == pytest.approx(np.hypot(SCRUB_SD * 0.4, 0.05 * 1.4))
    assert sd_of_another_log(ROBOT, wide, [], 0.05) == pytest.approx([np.hypot(0.01, by_turn)])
    narrow = fit_of(-0.2, 0.01, "effective_track")  # a data sheet that is wrong, no scrubbing
    assert sd_of_another_log(ROBOT, narrow, [], 0.05) == pytest.approx([0.01])


def test_what_a_robot_that_scrubs_may_do_elsewhere_is_misfit_where_the_base_does_not_hold_it():
    wide = fit_of(0.4, 0.01, "effective_track")
    found = misfit_between(ROBOT, wide, [])
    assert found.keys() == {"pose_lever_arm", "turning_slip", "icr_offset", "lateral_slip"}
    assert found["lateral_slip"] == pytest.approx(CREEP_SD_OF_ONE)
    wide.values["lateral_slip"] = {"seconds": 0.05}
    assert "lateral_slip" not in misfit_between(ROBOT, wide, [])
    assert misfit_between(ROBOT, fit_of(0.0, 0.01, "effective_track"), []) == {}
