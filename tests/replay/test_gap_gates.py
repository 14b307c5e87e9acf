"""The gap analysis between scan and verdict: starts, repeated mode identification, placebo, remainders."""

from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import analyse, base_model
from wmr_replay.gap.estimation.binned_log import drive_of
from wmr_replay.gap.estimation.modes import as_it_acts, identified_modes, lasting_effects
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import gauss_newton
from wmr_replay.gap.evidence.placebo import placebo_p
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.assemble import joined
from wmr_replay.gap.search.attempts import fitted
from wmr_replay.gap.search.hints import suggestions
from wmr_replay.gap.search.relabel import leaves_more, like_slipping, unlike_slipping, without_skid
from wmr_replay.gap.search.scan import scan
from wmr_replay.gap.search.with_modes import Answer
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack
from wmr_synth import hidden_log

GIVEN = GapOptions(modes="given")
SWITCH_S = 0.3
SLIPPING = 2


def problem_of(log: Log, *, margin_s: float = 0.04):
    """The log with its own labels, and its base model."""
    return Problem.of(drive_of(log, log.mode, margin_s=margin_s)), base_model(log, None, GIVEN).extension


def relabelled(log: Log, start_s: float, end_s: float, mode: int) -> Log:
    """The log with another mode between two times."""
    seconds = (log.mode.t_ns - log.pose.t_ns[0]) / 1e9
    inside = (seconds >= start_s) & (seconds < end_s)
    track = ModeTrack(log.mode.t_ns, np.where(inside, mode, log.mode.mode).astype(np.int8))
    return Log(log.pose, log.torque, track, log.robot)


@pytest.mark.parametrize(
    ("hide", "key", "share"),
    [
        ("wheel_viscous:nm_per_radps=.03", "nm_per_radps", 0.35),
        ("viscous_drag:c1_per_s=.2", "c1_per_s", 0.35),
        ("torque_imbalance:ratio=.1", "ratio", 0.2),
        ("undeclared_skid:stiffness_ratio=.8", "stiffness_ratio", 0.6),
    ],
)
def test_a_scan_promises_an_effect_at_about_its_size(hide, key, share):
    log, truth = hidden_log("patrol", seed=90_101, hide=[hide], noise="rtk")
    problem, extension = problem_of(log)
    fit = fitted(problem, extension)
    (effect,) = truth["effects"]
    (lead,) = (lead for lead in scan(problem, extension, fit.noise).leads if lead.name == effect["name"])
    assert lead.gain > 20
    assert lead.parameters[key] == pytest.approx(effect["parameters"][key], rel=share)


def test_a_placebo_explains_less_than_an_effect_and_more_than_none():
    log, _ = hidden_log("patrol", seed=90_102, hide=["viscous_drag:c1_per_s=.1"], noise="rtk")
    problem, extension = problem_of(log)
    rest = fitted(problem, extension)
    name, parameters = "viscous_drag", {"c1_per_s": 0.1}
    with_it = fitted(problem, extension.with_effect(name, parameters), rest.noise)
    assert placebo_p(problem, rest, with_it, name) == pytest.approx(0.01)
    beside = fitted(problem, with_it.extension.with_effect("payload", {"mass_ratio": 0.0}), with_it.noise)
    assert placebo_p(problem, with_it, beside, "payload") > 0.2


def test_a_placebo_is_drawn_by_the_seed():
    log, _ = hidden_log("patrol", seed=90_103, noise="poor")
    problem, extension = problem_of(log)
    rest = fitted(problem, extension)
    with_it = fitted(problem, extension.with_effect("payload", {"mass_ratio": 0.0}), rest.noise)
    shares = [placebo_p(problem, rest, with_it, "payload", seed) for seed in (1, 1, 2)]
    assert shares[0] == shares[1]
    assert all(0.01 <= share <= 1 for share in shares)


def test_slipping_that_leaves_other_traction_than_the_models_is_told_from_it():
    hide = ["slip_interval:start_s=30,end_s=39,loss=.4"]
    log, _ = hidden_log("patrol", seed=90_104, hide=hide, noise="rtk")
    called_so = relabelled(log, 30.0, 39.0, SLIPPING)
    problem, extension = problem_of(called_so, margin_s=SWITCH_S)
    rows = unlike_slipping(problem, fitted(problem, extension))
    t_s = problem.drive.t_s
    true_slip = (problem.drive.mode == SLIPPING) & ((t_s < 29.5) | (t_s > 39.5))
    assert rows[(t_s > 31) & (t_s < 38) & (problem.drive.mode == SLIPPING)].all()
    assert true_slip.any()
    assert not rows[true_slip].any()


def test_where_nothing_slips_nothing_is_unlike_slipping():
    log, _ = hidden_log("cruise", seed=90_105, noise="rtk")
    problem, extension = problem_of(log)
    assert not unlike_slipping(problem, fitted(problem, extension)).any()


def test_modes_without_skid_keep_slipping():
    track = ModeTrack(np.arange(4, dtype=np.int64), np.array([0, 1, 2, 3], np.int8))
    assert without_skid(track).mode.tolist() == [0, 0, 2, 2]


def test_a_loss_of_traction_is_held_against_slipping_in_both_channels():
    base = base_of(RobotParameters(alpha=0.5, half_track_m=0.3))._replace(slip_share=0.2, slip_share_yaw=0.4)
    loss = np.array([[0.8, 0.6], [0.5, 0.55], [0.8, 0.1], [0.95, 0.95], [0.5, 0.6]])
    covariance = np.tile(np.eye(2) * 0.02**2, (5, 1, 1))
    assert leaves_more(base, loss, covariance).tolist() == [False, True, True, False, True]
    assert not leaves_more(base, loss, covariance * 400).any()


@pytest.mark.parametrize(("loss", "like"), [(0.4, False), (0.85, True)])
def test_a_loss_that_is_found_may_be_slipping(loss, like):
    log, truth = hidden_log(
        "patrol", seed=90_106, hide=[f"slip_interval:start_s=30,end_s=40,loss={loss}"], noise="rtk"
    )
    problem, extension = problem_of(log, margin_s=SWITCH_S)
    (effect,) = truth["effects"]
    fit = fitted(problem, extension.with_effect("slip_interval", effect["parameters"]))
    assert like_slipping(problem, fit, "slip_interval") is like
    given, _ = problem_of(log)
    assert not like_slipping(given, fit, "slip_interval")


def test_a_loss_beside_the_path_may_be_anything():
    log, _ = hidden_log("patrol", seed=90_112, noise="rtk")
    problem, extension = problem_of(log, margin_s=SWITCH_S)
    place = {"x_m": 1e3, "y_m": 1e3, "radius_m": 0.5, "loss": 0.4}
    fit = fitted(problem, extension)
    beside = gauss_newton(problem, extension.with_effect("low_friction_patch", place), fit.noise, 0)
    assert like_slipping(problem, beside, "low_friction_patch")


def test_torques_act_less_where_traction_is_lost():
    log, _ = hidden_log("patrol", seed=90_107, noise="mocap")
    seconds = (log.torque.t_ns - log.pose.t_ns[0]) / 1e9
    inside, outside = (seconds > 31) & (seconds < 39), (seconds < 29) | (seconds > 41)
    extension = base_model(log, None, GIVEN).extension
    assert as_it_acts(log, extension) is log
    lost = extension.with_effect("slip_interval", {"start_s": 30.0, "end_s": 40.0, "loss": 0.4})
    acting = as_it_acts(log, lost).torque
    np.testing.assert_allclose(acting.left_nm[inside], 0.6 * log.torque.left_nm[inside], rtol=1e-6)
    np.testing.assert_allclose(acting.right_nm[outside], log.torque.right_nm[outside], rtol=1e-6, atol=1e-9)
    loaded = extension.with_effect("load_step", {"mass_ratio": 0.25, "t0_s": 20.0})
    acting = as_it_acts(log, loaded).torque
    late = seconds > 23
    total, difference = log.torque.left_nm + log.torque.right_nm, log.torque.right_nm - log.torque.left_nm
    np.testing.assert_allclose(
        (acting.left_nm + acting.right_nm)[late], total[late] / 1.25, rtol=1e-3, atol=1e-9
    )
    np.testing.assert_allclose(acting.right_nm - acting.left_nm, difference, atol=1e-9)


def test_torques_act_less_in_a_place():
    log, _ = hidden_log("patrol", seed=90_108, noise="mocap")
    drive = drive_of(log)
    x, y = drive.pose[len(drive) // 2, :2]
    extension = base_model(log, None, GIVEN).extension
    place = {"x_m": float(x), "y_m": float(y), "radius_m": 1.0, "loss": 0.5}
    acting = as_it_acts(log, extension.with_effect("low_friction_patch", place)).torque
    at = [np.interp(log.torque.t_ns, log.pose.t_ns, p) for p in (log.pose.x_m, log.pose.y_m)]
    distance = np.hypot(at[0] - x, at[1] - y)
    inside, outside = distance < 0.7, distance > 1.5
    assert inside.sum() > 20
    np.testing.assert_allclose(acting.left_nm[inside], 0.5 * log.torque.left_nm[inside], rtol=0.06)
    np.testing.assert_allclose(acting.left_nm[outside], log.torque.left_nm[outside], rtol=1e-3)


def test_a_slip_interval_that_the_identifier_calls_slipping_is_found():
    log, _ = hidden_log(
        "patrol", seed=90_109, hide=["slip_interval:start_s=28,end_s=37,loss=.45"], noise="rtk"
    )
    result = analyse(Log(log.pose, log.torque, None, log.robot))
    assert [effect.name for effect in result.effects] == ["slip_interval"]
    assert result.effects[0].parameters["loss"].value == pytest.approx(0.45, abs=0.12)


def told(stages, effects, robot):
    """A selection in which every attempt of the ``stages``, (name, score, p), was fitted to a size of .1."""
    extension = Extension(base_of(robot))
    made = tuple(
        tuple(
            SimpleNamespace(
                lead=SimpleNamespace(name=name),
                score=score,
                p_value=p_value,
                fit=SimpleNamespace(extension=extension.with_effect(name, {"size": 0.1})),
            )
            for name, score, p_value in stage
        )
        for stage in stages
    )
    for name in effects:
        extension = extension.with_effect(name, {"size": 0.1})
    return SimpleNamespace(stages=made, fit=SimpleNamespace(extension=extension)), Extension(base_of(robot))


@pytest.mark.parametrize(
    ("stages", "effects", "expected"),
    [
        ([[("payload", 20.0, 0.5)]], [], []),
        ([[("payload", 90.0, 1e-9), ("drive_gain", 80.0, 1e-9)]], ["payload"], [["payload"]]),
        (
            [[("payload", 90.0, 1e-9)], [("undeclared_skid", 60.0, 1e-9)]],
            ["payload", "undeclared_skid"],
            [["payload"]],
        ),
        (
            [[("input_delay", 90.0, 1e-9)], [("actuator_lag", 30.0, 1e-4)]],
            ["input_delay"],
            [["input_delay"]],
        ),
        (
            [[("viscous_drag", 90.0, 1e-9)], [("scrub_torque", 30.0, 1e-4)]],
            ["viscous_drag"],
            [["viscous_drag", "scrub_torque"]],
        ),
        (
            [[("undeclared_skid", 90.0, 1e-9), ("pose_lever_arm", 60.0, 1e-9), ("slope", 50.0, 1e-9)]],
            ["undeclared_skid"],
            [["undeclared_skid"], ["pose_lever_arm"], ["slope"]],
        ),
    ],
)
def test_hints_are_what_is_significant_and_its_near_rivals(stages, effects, expected):
    selection, extension = told(stages, effects, RobotParameters(alpha=0.5, half_track_m=0.3))
    problem = SimpleNamespace(drive=SimpleNamespace(identified=True))
    assert [list(hint.effects) for hint in suggestions(problem, extension, selection)] == expected


def test_skidding_taken_for_ideal_must_be_found_as_an_undeclared_skid():
    def answer(hint, *found):
        selection = SimpleNamespace(
            found=[SimpleNamespace(lead=SimpleNamespace(name=name)) for name in found]
        )
        return Answer(None, selection, SimpleNamespace(effects={hint: {}}))

    assert answer("payload", "payload").holds
    assert answer("payload", "drive_gain").holds
    assert not answer("payload").holds
    assert answer("undeclared_skid", "payload", "undeclared_skid").holds
    assert not answer("undeclared_skid", "payload").holds


def test_a_model_out_of_all_bounds_is_infinitely_unlikely():
    log, _ = hidden_log("patrol", seed=90_110, noise="rtk")
    problem, extension = problem_of(log)
    wild = extension.with_effect("viscous_drag", {"c1_per_s": -1e6})
    noise = fitted(problem, extension).noise
    with np.errstate(all="ignore"):
        fit = gauss_newton(problem, wild, noise, 3)
    assert fit.deviance == np.inf


def test_the_identifier_knows_the_base_models_effects_and_the_new_ones():
    base = base_of(RobotParameters(alpha=0.5, half_track_m=0.3))
    known = {
        "viscous_drag": {"c1_per_s": 0.2},
        "torque_saturation": {"limit_nm": 3.0},
        "slip_interval": {"start_s": 1.0, "end_s": 2.0, "loss": 0.5},
    }
    extension = Extension(base, {"viscous_drag": {"c1_per_s": 0.1}}, 1.0, known)
    extension = extension.with_effect("torque_saturation", {"limit_nm": 4.0})
    extension = extension.with_effect("payload", {"mass_ratio": 0.3})
    told = {effect.name: dict(effect.parameters) for effect in lasting_effects(extension)}
    assert told == {
        "viscous_drag": {"c1_per_s": pytest.approx(0.3)},
        "torque_saturation": {"limit_nm": 3.0},
        "payload": {"mass_ratio": 0.3},
    }


def test_modes_are_the_same_whether_an_effect_is_known_or_new():
    log, truth = hidden_log("patrol", seed=90_111, hide=["viscous_drag:c1_per_s=.3"], noise="rtk")
    base = base_model(log, None, GIVEN).extension
    (effect,) = truth["effects"]
    known = Extension(base.base, {}, base.wheel_radius_m, {effect["name"]: effect["parameters"]})
    new = base.with_effect(effect["name"], effect["parameters"])
    modes = [identified_modes(log, extension).mode for extension in (base, known, new)]
    np.testing.assert_array_equal(modes[1], modes[2])
    assert np.mean(modes[0] != modes[1]) > 0.1


def test_an_effect_that_the_base_has_already_adds_up():
    base = (
        Effect("yaw_drift", {"rate_radps": -0.006}),
        Effect("torque_saturation", {"limit_nm": 2.0}),
        Effect("slip_interval", {"start_s": 1.0, "end_s": 2.0, "loss": 0.5}),
    )
    new = (
        Effect("yaw_drift", {"rate_radps": -0.0003}, {"rate_radps": 1e-5}),
        Effect("torque_saturation", {"limit_nm": 3.0}),
        Effect("slip_interval", {"start_s": 5.0, "end_s": 6.0, "loss": 0.4}),
        Effect("payload", {"mass_ratio": 0.2}),
    )
    drift, limit, first, payload, second = joined(base, new)
    assert drift == Effect("yaw_drift", {"rate_radps": pytest.approx(-0.0063)}, {"rate_radps": 1e-5})
    assert limit == base[1]
    assert (first, payload, second) == (base[2], new[3], new[2])
