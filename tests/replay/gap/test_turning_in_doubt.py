"""What an α_yaw that a calibration log hardly shows leaves on another drive."""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.effects.motion import com_yaw_per_m
from wmr_replay.gap.analyse import calibrate
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.misfit import gain_as_inertia, gain_is_rest, is_rest, is_slight_term
from wmr_replay.gap.scan.turning_in_doubt import (
    doubts,
    held_in_doubt,
    terms_in_doubt,
    with_turning_in_doubt,
)
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack
from wmr_synth import synthesise

SETTINGS = GateSettings()
L, ALPHA, ALPHA_YAW = 0.24, 0.14, 0.13
ROBOT = RobotParameters(wheel_radius_m=0.11, half_track_m=L, alpha=ALPHA, alpha_yaw=ALPHA_YAW)
V, YAW_RATE, APART_NM = 0.5, 0.3, 0.4
"""A circle at .5 m/s and .3 rad/s, which takes .4 N·m between the wheels."""


def base(share):
    """A calibrated base model with α_yaw known to a share."""
    misfit = {"yaw_inertia": share, "yaw_damping": 0.1, "scrub_torque": 0.02, "com_offset": 0.01}
    return Extension(base_of(ROBOT), {}, 0.11, misfit=misfit | {"viscous_drag": 0.01})


def circle():
    """40 s of the circle, at 100 Hz."""
    t = np.arange(0.0, 40.0, 0.01)
    t_ns, yaw = np.rint(t * 1e9).astype(np.int64), YAW_RATE * t
    radius = V / YAW_RATE
    pose = PoseTrack(t_ns, radius * np.sin(yaw), radius * (1 - np.cos(yaw)), yaw)
    unknown, one = np.full(len(t), np.nan), np.ones(len(t))
    return Log(pose, TorqueTrack(t_ns, 1 - APART_NM / 2 * one, 1 + APART_NM / 2 * one, unknown, unknown))


def test_an_effect_is_a_rest_up_to_what_the_error_of_alpha_yaw_turns():
    """By hand: s α_yaw Δu over what one unit turns; with m, I of these α: l m/I = α_yaw/(α l)."""
    share = 2.0
    wider = with_turning_in_doubt(base(share), bin_log(circle(), SETTINGS))
    left_mps2 = share * ALPHA_YAW * APART_NM
    mass_kg = 1 / (0.11 * ALPHA)
    inertia_kgm2 = L**2 / (0.11 * ALPHA_YAW)
    assert wider.misfit["yaw_damping"] == pytest.approx(left_mps2 / (L * YAW_RATE), rel=0.01)
    assert wider.misfit["scrub_torque"] == pytest.approx(left_mps2, rel=0.01)
    by_centre_mps2 = L * mass_kg / inertia_kgm2 * V * YAW_RATE
    assert wider.misfit["com_offset"] == pytest.approx(left_mps2 / by_centre_mps2, rel=0.01)
    assert wider.misfit["viscous_drag"] == 0.01


def test_a_centre_of_mass_turns_a_robot_of_unknown_masses_as_one_of_known_masses():
    """By hand: wheels of radius r push the mass m with 1/(m r), and turn the inertia I with l²/(I r)."""
    mass_kg, inertia_kgm2 = 1 / (0.11 * ALPHA), L**2 / (0.11 * ALPHA_YAW)
    weighed = ROBOT.overridden_by(RobotParameters(mass_kg=mass_kg, yaw_inertia_kgm2=inertia_kgm2))
    assert com_yaw_per_m(ROBOT) == pytest.approx(L * mass_kg / inertia_kgm2)
    assert com_yaw_per_m(weighed) == pytest.approx(L * mass_kg / inertia_kgm2)
    assert com_yaw_per_m(RobotParameters(half_track_m=L, alpha=ALPHA)) == 0.0
    assert com_yaw_per_m(RobotParameters(alpha=ALPHA, alpha_yaw=ALPHA_YAW)) == 0.0


@pytest.mark.parametrize(("share", "rest"), [(2.0, True), (0.03, False)])
def test_on_swivel_casters_a_small_yaw_damping_is_no_finding_and_on_balls_it_is(share, rest):
    seen = with_turning_in_doubt(base(share), bin_log(circle(), SETTINGS)).with_effect(
        "yaw_damping", {"d1_per_s": 0.5}
    )
    assert is_rest("yaw_damping", seen, SETTINGS.misfit) is rest


def test_what_is_well_known_is_left_alone():
    known = base(0.03)
    assert with_turning_in_doubt(known, bin_log(circle(), SETTINGS)).misfit == known.misfit
    uncalibrated = Extension(base_of(ROBOT))
    assert with_turning_in_doubt(uncalibrated, bin_log(circle(), SETTINGS)) is uncalibrated


def test_an_effect_in_turning_that_the_base_holds_is_known_to_the_share_of_alpha_yaw():
    """By hand: twice a share of .2 of the held size, on top of the misfit."""
    held = (("com_offset", {"offset_m": -0.1}), ("viscous_drag", {"c1_per_s": 0.5}))
    straight = circle()
    t_s = np.arange(len(straight.pose.t_ns)) * 0.01
    log = Log(PoseTrack(straight.pose.t_ns, V * t_s, 0 * t_s, 0 * t_s), straight.torque)
    wider = with_turning_in_doubt(replace(base(0.2), known=held), bin_log(log, SETTINGS))
    assert wider.misfit["com_offset"] == pytest.approx(0.01 + 2 * 0.2 * 0.1)
    assert wider.misfit["viscous_drag"] == 0.01


@pytest.mark.parametrize(("share", "open_to"), [(0.2, 0.4), (2.0, 1.0)])
def test_a_held_imbalance_is_known_no_better_and_may_be_none_on_another_drive(share, open_to):
    held = (("torque_imbalance", {"ratio": -0.05}),)
    known = base(share)
    known = replace(known, known=held, misfit={**known.misfit, "torque_imbalance": 0.01})
    wider = with_turning_in_doubt(known, bin_log(circle(), SETTINGS))
    by_error = share * APART_NM / 2
    assert wider.misfit["torque_imbalance"] == pytest.approx(0.01 + open_to * 0.05 + by_error)


def test_torques_that_do_not_follow_the_turn_widen_no_scrub():
    """Half of the circle with the right wheel ahead, half with the left one: no part is along its sign."""
    turning = circle()
    half = len(turning.pose.t_ns) // 2
    apart = np.where(np.arange(2 * half) < half, APART_NM, -APART_NM)
    unknown, t_ns = np.full(2 * half, np.nan), turning.pose.t_ns
    log = Log(turning.pose, TorqueTrack(t_ns, 1 - apart / 2, 1 + apart / 2, unknown, unknown))
    wider = with_turning_in_doubt(base(2.0), bin_log(log, SETTINGS))
    assert wider.misfit["scrub_torque"] == pytest.approx(0.02, abs=0.002)
    assert wider.misfit["yaw_damping"] > 1.0


def test_a_drive_that_does_not_turn_widens_no_effect_of_turning_beyond_bounds():
    straight = circle()
    t_s = np.arange(len(straight.pose.t_ns)) * 0.01
    pose = PoseTrack(straight.pose.t_ns, V * t_s, 0 * t_s, 0 * t_s)
    wider = with_turning_in_doubt(base(2.0), bin_log(Log(pose, straight.torque), SETTINGS))
    assert wider.misfit["com_offset"] == 0.01


def test_it_is_said_of_a_base_model_that_hardly_shows_how_torques_turn_it():
    (said,) = doubts({"yaw_inertia": 2.1}, SETTINGS.misfit)
    assert "a factor of 3.1" in said
    assert "swivel casters" in said
    assert "no formula, no yaw damping" in said
    assert "no yaw inertia of less than 525%" in said
    assert "no formula in turning, " in doubts({"yaw_inertia": 0.2}, SETTINGS.misfit)[0]
    assert doubts({"yaw_inertia": 0.081}, SETTINGS.misfit)
    assert doubts({"yaw_inertia": 0.079}, SETTINGS.misfit) == ()
    assert doubts({}, SETTINGS.misfit) == ()


@pytest.mark.parametrize(("factor", "in_doubt"), [(0.9, True), (1.1, False)])
def test_a_term_of_turning_is_no_finding_up_to_what_the_error_of_alpha_yaw_turns(factor, in_doubt):
    share, name = 2.0, "unnamed:yaw:yaw_rate"
    size = factor * share * ALPHA_YAW * APART_NM / YAW_RATE
    seen, rows = base(share).with_effect(name, {"coefficient": size}), bin_log(circle(), SETTINGS)
    assert terms_in_doubt(seen, rows, [name]) is in_doubt
    ahead = seen.with_effect("unnamed:longitudinal:v", {"coefficient": 0.001})
    assert not terms_in_doubt(ahead, rows, [name, "unnamed:longitudinal:v"])
    assert not terms_in_doubt(seen, rows, ["scrub_torque"])


@pytest.mark.parametrize(("mps2", "slight"), [(0.029, True), (0.031, False)])
def test_a_term_is_slight_that_accelerates_a_calibrated_robot_by_no_more_than_is_negligible(mps2, slight):
    name, rows = "unnamed:longitudinal:v*abs(yaw_rate)", bin_log(circle(), SETTINGS)
    seen = base(0.1).with_effect(name, {"coefficient": -mps2 / (V * YAW_RATE)})
    assert is_slight_term(name, seen, rows, SETTINGS.misfit) is slight
    assert not is_slight_term(name, replace(seen, misfit={}), rows, SETTINGS.misfit)
    slope = seen.with_effect("slope", {"grade_x_mps2": 0.0})
    assert not is_slight_term("slope", slope, rows, SETTINGS.misfit)


def test_a_gain_and_a_load_that_turn_the_robot_within_the_doubt_are_an_inertia():
    """(1 + p)/(1 + g) = 1 and 1/(1 + g) = 2: α as it was, and half of α_yaw."""
    both = base(1.2).with_effect("drive_gain", {"ratio": -0.5}).with_effect("payload", {"mass_ratio": -0.5})
    same = gain_as_inertia(both)
    assert same.effects == {"payload": {"mass_ratio": 0.0}, "yaw_inertia": {"ratio": 1.0}}
    assert gain_is_rest(both, SETTINGS.misfit)
    assert not gain_is_rest(replace(both, misfit={"yaw_inertia": 0.3}), SETTINGS.misfit)
    assert not gain_is_rest(both.without("payload"), SETTINGS.misfit)


def test_a_calibration_that_never_turns_leaves_alpha_yaw_by_the_masses_and_open():
    """The paper's acceleration pushes both wheels alike: its α is found, its α_yaw not shown at all."""
    log = synthesise("paper-acceleration", seed=2, duration_s=24).log
    model = calibrate(log, log.robot)
    assert model.robot.alpha == pytest.approx(log.robot.alpha, rel=0.01)
    assert model.robot.alpha_yaw == base_of(log.robot).alpha_yaw
    assert "alpha" in model.robot_sd
    assert "alpha_yaw" not in model.robot_sd
    assert model.misfit["yaw_inertia"] == SETTINGS.misfit.most_open
    (said,) = doubts(model.misfit, SETTINGS.misfit)
    assert "it hardly turns" in said


@pytest.mark.parametrize(("share", "whole"), [(0.06, False), (0.2, True)])
def test_where_alpha_yaw_is_not_known_all_that_supports_take_may_be_a_moved_centre_of_mass(share, whole):
    """On the circle .2·w/V is as large as a centre of mass by (α_yaw/α l)·d·V·yaw_rate."""
    supports = (("support_friction", {"p0_mps2": 0.1, "d0_mps2": 0.2}),)
    w = L * YAW_RATE
    like_m = 0.2 * w / np.hypot(V, w) / (ALPHA_YAW / (ALPHA * L) * V * YAW_RATE)
    found = held_in_doubt(replace(base(share), known=supports), bin_log(circle(), SETTINGS))["com_offset"]
    assert found == pytest.approx(like_m if whole else 2 * share * like_m, rel=0.05)


@pytest.mark.parametrize(("share", "known"), [(0.06, True), (0.2, False)])
@pytest.mark.parametrize("both_ways", [False, True])
def test_on_a_drive_that_turns_one_way_what_supports_take_may_be_an_imbalance(share, known, both_ways):
    """By hand: on the circle, d₀ l·w/V at torques of 1 N·m is an imbalance of that over α_yaw·2 N·m, and a
    bias of it over 2 α_yaw; so is s α_yaw Δu. Both ways about it is neither.
    """
    log = circle()
    if both_ways:
        turned = np.where(np.arange(len(log.pose.t_ns)) < len(log.pose.t_ns) // 2, 1, -1)
        yaw = np.cumsum(YAW_RATE * turned) * 0.01
        x, y = (np.cumsum(V * part) * 0.01 for part in (np.cos(yaw), np.sin(yaw)))
        torque = replace(log.torque, left_nm=1 - APART_NM / 2 * turned, right_nm=1 + APART_NM / 2 * turned)
        log = replace(log, pose=PoseTrack(log.pose.t_ns, x, y, yaw), torque=torque)
    d0_mps2, misfit = 0.14, {"yaw_inertia": share, "torque_imbalance": 0.01, "torque_bias_differential": 0.01}
    held = (("support_friction", {"p0_mps2": 0.1, "d0_mps2": d0_mps2}),)
    wider = with_turning_in_doubt(
        Extension(base_of(ROBOT), {}, 0.11, known=held, misfit=misfit), bin_log(log, SETTINGS)
    ).misfit
    taken_mps2 = d0_mps2 * L * YAW_RATE / np.hypot(V, L * YAW_RATE)
    by_error = share * APART_NM / 2
    open_to = 0.0 if both_ways else by_error + (0.0 if known else taken_mps2 / (2 * ALPHA_YAW))
    assert wider["torque_imbalance"] == pytest.approx(0.01 + open_to, rel=0.02, abs=0.002)
    assert wider["torque_bias_differential"] == pytest.approx(0.01 + open_to, rel=0.02, abs=0.002)
