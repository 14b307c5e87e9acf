"""A held resistance is known in size, not in form: what it may look like on another drive."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.misfit import (
    is_rest,
    misfit_beside,
    negligible,
    on_loaded_casters,
    turning_is_unknown,
    with_parameters,
    withholds_a_rest,
)
from wmr_replay.gap.scan.other_forms import speeds_of, with_other_forms
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search import fit_candidates
from wmr_replay.gap.search.eliminate import same_tyres
from wmr_replay.gap.search.rests import describes_rests, leaving_more, without_formula
from wmr_replay.gap.search.select import Selection, with_gain_as_inertia
from wmr_replay.gap.settings import GateSettings
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.model_file import Effect, Model, NoiseModel
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import PoseTrack

OWN = MisfitSettings()
ROBOT = RobotParameters(wheel_radius_m=0.125, half_track_m=0.21, alpha=0.266, alpha_yaw=0.475)
NONE = dict.fromkeys(("rolling_resistance", "viscous_drag", "torque_bias_common", "yaw_damping"), 1e-3)
PLATES = Extension(base_of(ROBOT), {}, 0.125, known=(("wheel_coulomb", {"torque_nm": 0.0427}),), misfit=NONE)
"""A robot on skid plates, that ``fit`` gave a dry friction of .0227 m/s²."""


def circle(v_mps, yaw_rate_radps, there_and_back=False):
    """Poses at 50 Hz of 40 s on a circle; with ``there_and_back`` half of it in reverse."""
    t = np.arange(0.0, 40.0, 0.02)
    v = np.where(there_and_back & (t > 20.0), -v_mps, v_mps)
    yaw = yaw_rate_radps * t
    x, y = (np.cumsum(v * part) * 0.02 for part in (np.cos(yaw), np.sin(yaw)))
    return PoseTrack(np.rint(t * 1e9).astype(np.int64), x, y, yaw)


def test_mean_speeds_of_a_log_have_a_sign_and_leave_halts_out():
    speeds = speeds_of(circle(0.3, 0.5, there_and_back=True), OWN)
    assert np.abs(speeds.ahead_mps) == pytest.approx(0.3, rel=0.02)
    assert (speeds.ahead_mps[2], speeds.ahead_mps[-2]) == pytest.approx((0.3, -0.3), rel=0.02)
    assert speeds.yaw_rate_radps == pytest.approx(0.5)
    assert len(speeds_of(circle(0.05, 0.5), OWN).ahead_mps) == 0


def test_what_slides_along_brakes_turns_while_the_robot_moves():
    """By the statics of a plate at a = l: (α_yaw/α) c l q/√(v² + l² q²), 11 % of l q at .3 m/s."""
    v, q, length = 0.3, 0.5, 0.21
    brakes = 0.475 / 0.266 * (2 * 0.266 * 0.0427) / np.hypot(v, length * q)
    wider = with_other_forms(PLATES, circle(v, q), OWN)
    assert wider.misfit["yaw_damping"] == pytest.approx(brakes, rel=0.02)
    seen_by_engine = {"d1_per_s": 0.12}
    assert not is_rest("yaw_damping", PLATES.with_effect("yaw_damping", seen_by_engine), OWN)
    assert is_rest("yaw_damping", wider.with_effect("yaw_damping", seen_by_engine), OWN)
    fast = with_other_forms(PLATES, circle(1.2, q), OWN)
    assert fast.misfit["yaw_damping"] < brakes / 3


def test_a_held_friction_may_be_a_drag_or_a_bias_of_its_size_and_is_a_friction_on_another_drive():
    wider = with_other_forms(PLATES, circle(0.5, 0.1), OWN).misfit
    held_mps2 = 2 * 0.266 * 0.0427
    assert wider["rolling_resistance"] == NONE["rolling_resistance"]
    assert wider["viscous_drag"] == pytest.approx((held_mps2 + 0.001) / 0.5, rel=0.02)
    assert wider["torque_bias_common"] == pytest.approx(0.0427, rel=0.01)
    back = with_other_forms(PLATES, circle(0.5, 0.1, there_and_back=True), OWN).misfit
    assert back["torque_bias_common"] < 0.005


def test_a_large_resistance_is_known_in_its_form_and_an_uncalibrated_base_in_all():
    large = replace(PLATES, known=(("rolling_resistance", {"c0_mps2": 0.3}),))
    wider = with_other_forms(large, circle(0.5, 0.1), OWN).misfit
    assert wider["viscous_drag"] == pytest.approx(OWN.most_in_form_mps2 / 0.5, rel=0.02)
    assert wider["rolling_resistance"] == NONE["rolling_resistance"]  # held in this form
    bare = replace(PLATES, misfit={})
    assert with_other_forms(bare, circle(0.5, 0.1), OWN) is bare
    nothing_held = with_other_forms(replace(PLATES, known=()), circle(0.5, 0.1), OWN)
    assert nothing_held.misfit == NONE | {"viscous_drag": pytest.approx(0.001 / 0.5, rel=0.02)}


def test_supports_that_drag_brake_the_way_ahead_less_in_turns_than_another_friction_would():
    """By hand: p₀ v/V of .1 m/s² at v = .3 m/s and w = .4 m/s is .06, so that a friction may be .04 more. The
    mean speeds over windows of such a tight circle are a little lower.
    """
    dragging = replace(PLATES, known=(("support_friction", {"p0_mps2": 0.1, "d0_mps2": 0.0}),))
    turning = with_other_forms(dragging, circle(0.3, 0.4 / 0.21), OWN).misfit
    assert turning["rolling_resistance"] == pytest.approx(0.04, rel=0.2)
    straight = with_other_forms(dragging, circle(0.5, 0.01), OWN).misfit
    assert straight["rolling_resistance"] == NONE["rolling_resistance"]
    assert straight["viscous_drag"] == pytest.approx(0.1 / 0.5, rel=0.05)


def test_what_a_calibration_leaves_open_of_one_resistance_may_be_another():
    """A friction of .05 m/s² that the log did not show is a drag of .1 1/s at half a metre a second."""
    unknown = replace(PLATES, known=(), misfit=NONE | {"rolling_resistance": 0.05})
    wider = with_other_forms(unknown, circle(0.5, 0.1), OWN).misfit
    assert wider["viscous_drag"] == pytest.approx(0.1, rel=0.02)
    assert wider["rolling_resistance"] == 0.05


def test_a_held_bias_may_be_a_friction_that_a_drive_without_reversals_took_for_one():
    """By hand: .03 N·m at both wheels are a friction of .03 N·m at each, and may be none on another log."""
    biased = replace(
        PLATES, known=(("torque_bias_common", {"bias_nm": -0.03}),), misfit=NONE | {"wheel_coulomb": 1e-3}
    )
    wider = with_other_forms(biased, circle(0.5, 0.1, there_and_back=True), OWN).misfit
    assert wider["wheel_coulomb"] == pytest.approx(0.03 + 0.001 / (2 * 0.266), rel=0.01)
    assert wider["torque_bias_common"] == pytest.approx(0.03, rel=0.05)


def test_a_held_yaw_damping_may_be_a_moved_centre_of_mass_and_the_other_way_round():
    """By hand, at one speed: d1 l q = (α_yaw/(α l)) d v q."""
    v, per_m = 0.5, 0.475 / (0.266 * 0.21)
    misfit = NONE | {"com_offset": 1e-3}
    damped = replace(PLATES, known=(("yaw_damping", {"d1_per_s": 0.8}),), misfit=misfit)
    assert with_other_forms(damped, circle(v, 0.3), OWN).misfit["com_offset"] == pytest.approx(
        0.8 * 0.21 / (per_m * v), rel=0.02
    )
    moved = replace(PLATES, known=(("com_offset", {"offset_m": 0.05}),), misfit=misfit)
    assert with_other_forms(moved, circle(v, 0.3), OWN).misfit["yaw_damping"] == pytest.approx(
        per_m * 0.05 * v / 0.21, rel=0.02
    )


@pytest.mark.parametrize(
    ("offset_m", "v", "there_and_back", "damps"),
    [
        (0.05, 0.5, False, True),
        (-0.05, 0.5, False, False),
        (-0.05, -0.5, False, True),
        (0.05, 0.5, True, False),
    ],
)
def test_a_centre_of_mass_that_helps_turns_is_like_no_damping(offset_m, v, there_and_back, damps):
    """Behind the axle it does so ahead; there and back it helps as much as it brakes."""
    moved = replace(PLATES, known=(("com_offset", {"offset_m": offset_m}),), misfit=NONE)
    wider = with_other_forms(moved, circle(v, 0.3, there_and_back), OWN).misfit["yaw_damping"]
    assert (wider > 0.5) is damps
    assert damps or wider < 0.05


@pytest.mark.parametrize(
    ("swing", "disturbance", "held_mps2", "loaded"),
    [
        (None, 0.016, 0.0, True),
        (0.012, 0.012, 0.0, True),
        (0.012, 0.005, 0.0, False),
        (None, None, 0.01, True),
    ],
)
def test_what_pushes_a_robot_about_leaves_alpha_yaw_open(swing, disturbance, held_mps2, loaded):
    noise = NoiseModel(swing_yaw_mps2_rthz=swing, disturbance_yaw_mps2_rthz=disturbance)
    model = Model(robot=ROBOT, noise=noise, effects=(Effect("swivel_friction", {"s0_mps2": held_mps2}),))
    assert on_loaded_casters(model, OWN) is loaded


@pytest.mark.parametrize(("ratio", "same"), [(0.1, True), (0.4, False), (-0.4, False), (4.3, True)])
def test_tyres_that_are_several_times_as_stiff_are_none(ratio, same):
    stiffer = PLATES.with_effect("cornering_stiffness", {"ratio": ratio})
    assert same_tyres("cornering_stiffness", stiffer, GateSettings().selection) is same
    assert not same_tyres(
        "payload", PLATES.with_effect("payload", {"mass_ratio": 4.3}), GateSettings().selection
    )


def test_a_gain_is_open_by_what_a_controller_hides():
    model = Model(robot=ROBOT, robot_sd={"alpha": 0.00266, "alpha_yaw": 0.00475})
    found = with_parameters({}, model, (10.0, 2.0), OWN)
    assert found["payload"] == found["drive_gain"] == pytest.approx(OWN.in_sd * 0.01 + 2 * 0.01)
    assert found["yaw_inertia"] == pytest.approx(OWN.in_sd * 0.01 + 0.25)


def test_torques_that_never_turn_the_robot_leave_the_yaw_inertia_open():
    model = Model(robot=ROBOT, robot_sd={"alpha": 0.00266})
    found = with_parameters({}, model, (10.0, 0.0), OWN)
    assert found["payload"] == pytest.approx(OWN.in_sd * 0.01 + 2 * 0.01)
    assert found["yaw_inertia"] == with_parameters({}, model, (10.0, 1e-9), OWN)["yaw_inertia"]
    assert found["yaw_inertia"] == OWN.most_open


def test_a_torque_that_turns_is_negligible_by_what_it_turns():
    for name, alpha in (("torque_bias_common", 0.266), ("torque_bias_differential", 0.475)):
        assert negligible(name, PLATES, OWN) == pytest.approx(OWN.negligible_mps2 / (2 * alpha))


def test_how_a_pose_is_mounted_is_no_part_of_what_brakes():
    """An angle of .012 rad is a finding beside a drag; a moved centre of mass of .012 m may be its doing."""
    known_to = replace(PLATES, misfit={"heading_misalignment": 0.001, "com_offset": 0.001})
    beside = known_to.with_effect("viscous_drag", {"c1_per_s": 1.0})
    seen = beside.with_effect("heading_misalignment", {"angle_rad": 0.012})
    assert not is_rest("heading_misalignment", seen, OWN)
    assert is_rest("com_offset", beside.with_effect("com_offset", {"offset_m": 0.012}), OWN)


@pytest.mark.parametrize(("gain", "matters"), [(0.2, True), (0.04, False)])
def test_what_is_a_rest_beside_a_found_effect_is_one_in_the_model_that_takes_it_in(gain, matters):
    extension = PLATES.with_effect("drive_gain", {"ratio": gain})
    misfit = {"payload": 0.01, "yaw_damping": 5.0}
    taken_in = misfit_beside(extension, misfit, OWN)
    if not matters:
        assert taken_in == misfit
        return
    assert taken_in["payload"] == OWN.beside * negligible("payload", PLATES, OWN) > 0.01
    assert taken_in["yaw_damping"] == 5.0
    small = {"mass_ratio": taken_in["payload"]}
    assert is_rest("payload", replace(extension, misfit=misfit).with_effect("payload", small), OWN)
    later = replace(PLATES, misfit=taken_in)
    assert is_rest("payload", later.with_effect("payload", small), OWN)
    assert misfit_beside(replace(extension, misfit={}), {}, OWN) == {}


def test_what_turning_takes_in_leaves_alpha_yaw_as_well_known_as_it_was():
    """A yaw inertia up to one and a half times what is negligible, .08, stays a rest."""
    extension = PLATES.with_effect("payload", {"mass_ratio": 0.4})
    taken_in = misfit_beside(extension, {**NONE, "yaw_inertia": 0.03}, OWN)
    later = replace(PLATES, misfit=taken_in)
    assert not turning_is_unknown(taken_in, OWN)
    for ratio, rest in ((0.119, True), (0.121, False)):
        assert is_rest("yaw_inertia", later.with_effect("yaw_inertia", {"ratio": ratio}), OWN) is rest
    assert misfit_beside(extension, {"yaw_inertia": 0.3}, OWN) == {"yaw_inertia": 0.3}


@pytest.mark.parametrize(("limit_nm", "rest"), [(2.0, True), (1.85, False), (1.0, False)])
def test_a_saturation_that_holds_back_less_than_the_gain_is_known_is_a_rest(limit_nm, rest):
    """Torques up to 2.2 N·m: a limit of 2 N·m holds back 1 % of them, one of 1.85 N·m 4 %, one of 1 N·m 40 %.
    A gain is known to 2 %; a limit does not stand beside itself.
    """
    peaks = 2.0 * np.sin(np.linspace(0.0, 40.0, 800)) + 0.2 * np.sin(np.linspace(0.0, 9.0, 800))
    asked = np.stack([peaks, peaks])
    problem = SimpleNamespace(binned=None)

    def holds_back(base):
        known = {"misfit": base.misfit, "base": base.base, "wheel_radius_m": base.wheel_radius_m}
        free = SimpleNamespace(mean_torques=lambda _: asked, effects={}, **known)
        return SimpleNamespace(
            without=lambda _: free,
            mean_torques=lambda _: np.clip(asked, -limit_nm, limit_nm),
            effects={"torque_saturation": {"limit_nm": limit_nm}},
            **known,
        )

    known_to = replace(PLATES, misfit={**NONE, "drive_gain": 0.001})
    assert withholds_a_rest("torque_saturation", problem, holds_back(known_to), OWN) is rest
    on_casters = replace(known_to, misfit={**known_to.misfit, "yaw_inertia": 0.5})
    assert withholds_a_rest("torque_saturation", problem, holds_back(on_casters), OWN) is rest
    assert not withholds_a_rest("slope", problem, holds_back(PLATES), OWN)
    uncalibrated = replace(PLATES, misfit={})
    assert not withholds_a_rest("torque_saturation", problem, holds_back(uncalibrated), OWN)


def chosen(noise, *names, misfit=None):
    """A selection of the effects ``names`` on a log on which the base model leaves ``noise``."""
    found = tuple(SimpleNamespace(name=name) for name in names)
    base = SimpleNamespace(noise=noise, extension=SimpleNamespace(misfit=misfit or {}))
    return Selection(base, SimpleNamespace(noise=noise), found, ())


OWN_LOG = NoiseModel(disturbance_longitudinal_mps2_rthz=0.05, disturbance_yaw_mps2_rthz=0.03)
CALM = Diffusion(0.04, 0.5, 0.03, 0.5, 0.001, 0.2)
"""Leaves .04 and .03 m/s²/√Hz."""


@pytest.mark.parametrize(
    ("noise", "own_log", "leaving"),
    [
        (CALM, OWN_LOG, set()),
        (CALM._replace(yaw_sd_mps2=0.060), OWN_LOG, set()),
        (CALM._replace(yaw_sd_mps2=0.061), OWN_LOG, {"yaw"}),
        (CALM._replace(long_sd_mps2=0.067), OWN_LOG, {"longitudinal"}),
        (CALM._replace(long_sd_mps2=0.067, yaw_sd_mps2=0.01), OWN_LOG, set()),
        (CALM._replace(long_sd_mps2=0.08, yaw_sd_mps2=0.05), OWN_LOG, {"longitudinal", "yaw"}),
        (CALM, NoiseModel(), {"longitudinal", "yaw"}),
    ],
)
def test_channels_on_which_a_base_leaves_more_than_on_its_own_log(noise, own_log, leaving):
    """A quarter more is the same, on one channel or on both; where the own log's disturbance is not known,
    every channel may leave more.
    """
    assert leaving_more(chosen(noise), own_log, OWN) == leaving


@pytest.mark.parametrize("own_log", [OWN_LOG, NoiseModel()])
def test_no_formula_where_the_calibration_does_not_show_alpha_yaw(
    own_log,
):
    louder = CALM._replace(long_sd_mps2=0.08, yaw_sd_mps2=0.08)
    for open_to, leaving in ((0.07, {"longitudinal", "yaw"}), (0.09, {"longitudinal"}), (0.26, set())):
        assert leaving_more(chosen(louder, misfit={"yaw_inertia": open_to}), own_log, OWN) == leaving


def test_what_casters_do_while_they_swing_counts_as_left():
    """.04 beside .12 is .126; .08 beside it makes .144, and .13 .177, 1.4 times as much."""
    swinging = NoiseModel(0.01, 0.01, 0.04, 0.0, 0.04, 0.12, 0.12)
    known = CALM._replace(swing_long_mps2_rthz=0.12, swing_yaw_mps2_rthz=0.12, long_sd_mps2=0.08)
    assert not leaving_more(chosen(known), swinging, OWN)
    assert leaving_more(chosen(known._replace(yaw_sd_mps2=0.13)), swinging, OWN) == {"yaw"}


def test_a_formula_on_channels_that_leave_no_more_is_no_finding():
    term = chosen(CALM, "unnamed:longitudinal:effort_sum")
    assert describes_rests(term, frozenset({"yaw"}))
    assert not describes_rests(term, frozenset({"longitudinal"}))
    both = chosen(CALM, "unnamed:longitudinal:effort_sum", "unnamed:yaw:effort_diff")
    assert describes_rests(both, frozenset({"yaw"}))
    assert not describes_rests(both, frozenset({"longitudinal", "yaw"}))
    assert not describes_rests(chosen(CALM, "viscous_drag"), frozenset())
    assert not describes_rests(chosen(CALM), frozenset())
    plain = without_formula(term)
    assert (plain.found, plain.fit) == ((), term.base)
    named = chosen(CALM, "viscous_drag")
    assert without_formula(named) is named


def test_rivals_about_as_good_are_all_fitted_in_full(monkeypatch):
    """Of three that cost the same, two in full and one roughly would not be a draw; a loss of traction in a
    time or place waits its turn.
    """
    monkeypatch.setattr(fit_candidates, "price_of", lambda *_: 0.0)
    problem = SimpleNamespace(settings=GateSettings())

    def fully(*deviances, local=()):
        names = ["slip_interval" if i in local else "slope" for i in range(len(deviances))]
        scored = [ScoredCandidate(name, {}, 0.0, 1) for name in names]
        fits = [SimpleNamespace(deviance=one) for one in deviances]
        return fit_candidates.fitted_in_full(problem, list(zip(scored, fits, strict=True)))

    assert fully(0.0) == [True]
    assert fully(0.0, 300.0, 400.0) == [True, True, False]
    assert fully(0.0, 300.0, 300.0, 310.0, 400.0) == [True, True, True, True, False]
    assert fully(0.0, 300.0, 300.0, 310.0, 400.0, local=(1, 2)) == [True, True, False, True, False]


@pytest.mark.parametrize(("open_to", "name"), [(2.0, "yaw_inertia"), (0.1, "drive_gain")])
def test_a_gain_beside_a_payload_is_a_yaw_inertia_where_that_is_open(open_to, name):
    """(1 + g)/(1 + p) ahead and 1 + g in yaw, either way."""
    effects = {"payload": {"mass_ratio": 1.5}, "drive_gain": {"ratio": 1.0}}
    extension = replace(PLATES, effects=effects, misfit={"yaw_inertia": open_to})
    scored = ScoredCandidate("drive_gain", {"ratio": 1.0}, 100.0, 1)
    fit = Fit(None, extension, None, 0.0, None, None)
    said = with_gain_as_inertia(fit_candidates.FittedCandidate(scored, fit, 100.0, 90.0, 0.0), OWN)
    assert said.name == name
    if name == "yaw_inertia":
        assert said.fit.extension.effects == {
            "payload": {"mass_ratio": pytest.approx(0.25)},
            "yaw_inertia": {"ratio": -0.5},
        }


@pytest.mark.parametrize(("ratio", "rest"), [(0.03, True), (-0.03, True), (0.09, False)])
def test_a_weight_put_on_meanwhile_is_a_rest_up_to_what_is_one_of_a_payload(ratio, rest):
    loaded = replace(PLATES, misfit=NONE | {"payload": 0.01})
    loaded = loaded.with_effect("load_step", {"mass_ratio": ratio, "t0_s": 20.0})
    assert is_rest("load_step", loaded, OWN) is rest
    assert not is_rest("load_step", replace(loaded, misfit={}), OWN)
