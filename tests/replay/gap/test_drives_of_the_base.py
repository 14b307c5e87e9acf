"""A base model holds what the robot's drives do to every torque, and nothing of the calibration's ground."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from wmr_replay.gap import GapOptions, analyse, calibrate
from wmr_replay.gap.search.rests import lasting, may_be_held
from wmr_schemas.robot import RobotParameters
from wmr_synth import hidden_log

GIVEN = GapOptions(modes="given")
FRICTION = "rolling_resistance:c0_mps2=.15"


def fitted_on(hide: list[str], seed: int):
    """The base model that ``fit`` calibrates on a log of the paper's robot with effects."""
    log, _ = hidden_log("patrol", seed=seed, hide=hide, noise="rtk")
    known = RobotParameters(half_track_m=log.robot.half_track_m, wheel_radius_m=log.robot.wheel_radius_m)
    return calibrate(replace(log, robot=known), known, GIVEN), log.robot


def sizes_held(model) -> dict[str, dict[str, float]]:
    return {effect.name: dict(effect.parameters) for effect in model.effects}


def test_a_delay_of_the_drives_is_held_beside_what_brakes():
    model, robot = fitted_on(["input_delay:delay_s=.06", FRICTION], seed=90_301)
    held = sizes_held(model)
    assert held["input_delay"]["delay_s"] == pytest.approx(0.06, rel=0.1)
    assert held["rolling_resistance"]["c0_mps2"] == pytest.approx(0.15, rel=0.15)
    assert model.robot.alpha == pytest.approx(robot.alpha, rel=0.03)


def test_a_delay_is_held_beside_as_many_others_as_a_base_model_holds():
    others = [
        FRICTION,
        "scrub_torque:d0_mps2=.2",
        "torque_imbalance:ratio=.08",
        "wheel_viscous:nm_per_radps=.1",
        "com_offset:offset_m=.06",
        "heading_misalignment:angle_rad=.05",
    ]
    model, _ = fitted_on(["input_delay:delay_s=.03", *others], seed=90_307)
    held = sizes_held(model)
    late_s = [*held.get("input_delay", {}).values(), *held.get("actuator_lag", {}).values()]
    assert sum(late_s) == pytest.approx(0.03, rel=0.25)
    assert len(held) > 5


@pytest.mark.parametrize("delay_s", [0.0, 0.025])
def test_a_delay_that_a_noisy_calibration_does_not_show_is_left_open(delay_s):
    hide = [f"input_delay:delay_s={delay_s}"] if delay_s else []
    log, _ = hidden_log("patrol", seed=90_308, hide=hide, noise="poor", duration_s=45.0)
    known = RobotParameters(half_track_m=log.robot.half_track_m, wheel_radius_m=log.robot.wheel_radius_m)
    model = calibrate(replace(log, robot=known), known, GIVEN)
    held = sizes_held(model).get("input_delay", {}).get("delay_s", 0.0)
    for name in ("input_delay", "actuator_lag"):
        assert delay_s - held <= model.misfit[name] < 0.08


def test_a_dead_zone_of_the_drives_is_held():
    model, robot = fitted_on(["torque_deadzone:threshold_nm=.3"], seed=90_305)
    assert sizes_held(model)["torque_deadzone"]["threshold_nm"] == pytest.approx(0.3, rel=0.1)
    assert model.robot.alpha == pytest.approx(robot.alpha, rel=0.03)


def test_with_the_delay_in_the_base_model_another_log_lacks_nothing():
    model, _ = fitted_on(["input_delay:delay_s=.06"], seed=90_302)
    other, _ = hidden_log("random", seed=90_303, hide=["input_delay:delay_s=.06"], noise="rtk")
    found = analyse(other, model, GIVEN)
    assert found.verdict == "nothing_missing"
    assert found.effects == ()


def test_a_tilted_floor_is_no_part_of_the_robot_and_hides_none_of_it():
    model, robot = fitted_on(["slope:grade_x_mps2=.3,grade_y_mps2=.2", FRICTION], seed=90_304)
    held = sizes_held(model)
    assert "slope" not in held
    assert held["rolling_resistance"]["c0_mps2"] == pytest.approx(0.15, rel=0.15)
    assert model.robot.alpha == pytest.approx(robot.alpha, rel=0.03)


@pytest.mark.parametrize(
    ("name", "held"),
    [
        ("input_delay", True),
        ("torque_saturation", True),
        ("wheel_viscous", True),
        ("slope", False),
        ("load_step", False),
    ],
)
def test_what_always_acts_on_a_robot_belongs_to_it(name, held):
    assert may_be_held(name) is held


@pytest.mark.parametrize(
    ("found", "taken"),
    [
        (("support_friction", "slope", "slip_interval", "com_offset"), ["support_friction", "slope"]),
        (("unnamed:yaw:v", "input_delay"), ["unnamed:yaw:v", "input_delay"]),
        (("undeclared_skid", "com_offset"), []),
        ((), []),
    ],
)
def test_nothing_is_taken_from_a_log_behind_a_slip(found, taken):
    assert lasting(SimpleNamespace(found=[SimpleNamespace(name=name) for name in found])) == taken
