"""Between a scan and a verdict, on simulated logs: scores, placebo logs, bounds, the merged model."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE

from wmr_replay.effects.theta import PLACES
from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model, gauss_newton, keys_of, with_values
from wmr_replay.gap.evidence.placebo import placebo_p
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.extension import WEIGHTS, Extension
from wmr_replay.gap.result.detectable import minimum_detectable, unseen
from wmr_replay.gap.result.effects import merged_effects
from wmr_replay.gap.scan.library import linear_score
from wmr_replay.gap.scan.local_effects import sizes_of
from wmr_replay.gap.scan.scan import LibraryScan, scan
from wmr_replay.gap.scan.score import NormalEquations
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.model_file import Effect
from wmr_schemas.signals import Log
from wmr_synth import hidden_log

GIVEN = GapOptions(modes="given")
SETTINGS = GateSettings()


def problem_of(log: Log):
    """The log with its own labels, and its base model."""
    return Problem.of(bin_log(log, SETTINGS, log.mode)), base_model(log, None, GIVEN).extension


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
    fit = fit_model(problem, extension)
    (effect,) = truth["effects"]
    (scored,) = (one for one in scan(problem, extension, fit.noise).scored if one.name == effect["name"])
    assert scored.gain > 20
    assert scored.parameters[key] == pytest.approx(effect["parameters"][key], rel=share)


@pytest.mark.parametrize("e2_per_m", [0.0, 0.4])
def test_a_medium_is_promised_with_what_it_brakes_of_turns_or_without(e2_per_m):
    hide = f"aerodynamic_drag:c2_per_m=.2,e2_per_m={e2_per_m}"
    log, _ = hidden_log("patrol", seed=90_107, hide=[hide], noise="rtk")
    problem, extension = problem_of(log)
    scored = {one.name: one for one in scan(problem, extension, fit_model(problem, extension).noise).scored}
    medium = scored["aerodynamic_drag"]
    assert medium.gain > 20
    assert medium.parameters["c2_per_m"] == pytest.approx(0.2, rel=0.35)
    assert medium.parameters["e2_per_m"] == pytest.approx(e2_per_m, abs=0.25)
    assert medium.parameters["e2_per_m"] >= 0


def test_a_medium_brakes_turns_by_no_more_than_wheels_at_the_track_or_a_hull_do():
    """Eight times what it brakes ahead: as a scan finds it, and as a fit keeps it."""
    columns = {"c2_per_m": 0.5, "e2_per_m": 4.5}
    normal = NormalEquations(np.array(list(columns.values())), np.eye(2))
    scored = linear_score(normal, candidate_of("aerodynamic_drag"), [0, 1], 1.0)
    assert scored.parameters == pytest.approx({"c2_per_m": 0.5, "e2_per_m": 0.0})
    drag = Extension(BASE, {"aerodynamic_drag": {"c2_per_m": 0.1, "e2_per_m": 0.2}})
    keys = keys_of(drag)
    for values, kept in (((0.1, 0.7), 0.7), ((0.1, 3.0), 0.8), ((0.0, 3.0), 0.0), ((-1.0, 3.0), 0.0)):
        fitted = with_values(drag, keys, np.array(values)).effects["aerodynamic_drag"]
        assert fitted == pytest.approx({"c2_per_m": max(values[0], 0.0), "e2_per_m": kept})


def test_a_parameter_that_may_be_absent_is_left_out_where_its_sign_is_none():
    columns = {"c2_per_m": 2.0, "e2_per_m": -1.5}
    equations = NormalEquations(np.array(list(columns.values())), np.diag([10.0, 5.0]))
    scored = linear_score(equations, candidate_of("aerodynamic_drag"), [0, 1], 0.1)
    assert scored.parameters == pytest.approx({"c2_per_m": 0.2, "e2_per_m": 0.0})
    assert scored.gain == pytest.approx(2.0 * 0.2)
    backward = NormalEquations(np.array([-2.0, 1.5]), np.diag([10.0, 5.0]))
    assert linear_score(backward, candidate_of("aerodynamic_drag"), [0, 1], 0.1).gain == 0


def test_a_placebo_explains_less_than_an_effect_and_more_than_none():
    log, _ = hidden_log("patrol", seed=90_102, hide=["viscous_drag:c1_per_s=.1"], noise="rtk")
    problem, extension = problem_of(log)
    rest = fit_model(problem, extension)
    name, parameters = "viscous_drag", {"c1_per_s": 0.1}
    with_it = fit_model(problem, extension.with_effect(name, parameters), rest.noise)
    assert placebo_p(problem, rest, with_it, name) == pytest.approx(0.01)
    beside = fit_model(problem, with_it.extension.with_effect("payload", {"mass_ratio": 0.0}), with_it.noise)
    assert placebo_p(problem, with_it, beside, "payload") > 0.2


def test_a_placebo_is_drawn_by_the_seed():
    log, _ = hidden_log("patrol", seed=90_103, noise="poor")
    problem, extension = problem_of(log)
    rest = fit_model(problem, extension)
    with_it = fit_model(problem, extension.with_effect("payload", {"mass_ratio": 0.0}), rest.noise)
    shares = [placebo_p(problem, rest, with_it, "payload", seed) for seed in (1, 1, 2)]
    assert shares[0] == shares[1]
    assert all(0.01 <= share <= 1 for share in shares)


def test_a_model_out_of_all_bounds_is_infinitely_unlikely():
    log, _ = hidden_log("patrol", seed=90_110, noise="rtk")
    problem, extension = problem_of(log)
    wild = extension.with_effect("viscous_drag", {"c1_per_s": -1e6})
    noise = fit_model(problem, extension).noise
    with np.errstate(all="ignore"):
        fit = gauss_newton(problem, wild, noise, 3)
    assert fit.deviance == np.inf


def test_an_effect_that_the_base_has_already_adds_up():
    base = (
        Effect("yaw_drift", {"rate_radps": -0.006}),
        Effect("torque_saturation", {"limit_nm": 2.0}),
        Effect("slip_interval", {"start_s": 1.0, "end_s": 2.0, "loss": 0.5}),
        Effect("slip_interval", {"start_s": 3.0, "end_s": 4.0, "loss": 0.3}),
    )
    new = (
        Effect("yaw_drift", {"rate_radps": -0.0003}, {"rate_radps": 1e-5}),
        Effect("torque_saturation", {"limit_nm": 3.0}),
        Effect("slip_interval", {"start_s": 5.0, "end_s": 6.0, "loss": 0.4}),
        Effect("payload", {"mass_ratio": 0.2}),
    )
    drift, limit, payload, *intervals = merged_effects(base, new)
    assert drift == Effect("yaw_drift", {"rate_radps": pytest.approx(-0.0063)}, {"rate_radps": 1e-5})
    assert limit == base[1]
    assert (payload, intervals) == (new[3], [base[2], base[3], new[2]])


@pytest.mark.parametrize(
    ("name", "places", "at", "expected"),
    [
        (
            "load_step",
            ({"mass_ratio": 0.2, "t0_s": 5.0}, {"mass_ratio": -0.1, "t0_s": 20.0}),
            (2.0, 10.0, 30.0),
            (0.0, 0.2, 0.1),
        ),
        (
            "slip_interval",
            ({"start_s": 5.0, "end_s": 15.0, "loss": 0.4}, {"start_s": 12.0, "end_s": 20.0, "loss": 0.5}),
            (2.0, 8.0, 13.5, 18.0),
            (0.0, 0.4, 0.7, 0.5),
        ),
    ],
)
def test_local_effects_of_one_name_keep_their_places(name, places, at, expected):
    """Loads add up; of what a first loss of traction leaves, a second one takes its share."""
    log, _ = hidden_log("patrol", seed=90_112, noise="mocap")
    problem, extension = problem_of(log)
    both = replace(extension, known=((name, places[0]),)).with_effect(name, places[1])
    acts = both.rows(problem.binned)[:, WEIGHTS[name]]
    assert np.interp(at, problem.binned.t_s, acts) == pytest.approx(expected, abs=1e-3)
    assert both.theta()[PLACES[name, "mass_ratio" if name == "load_step" else "loss"]] == 1.0


@pytest.mark.parametrize("places", [1, 16, 17, 40])
def test_sizes_of_patches_are_their_quadratic_forms(places):
    rng = np.random.default_rng(places)
    root, share = rng.normal(size=(9, 7)), rng.random((7, places))
    sizes = sizes_of(share, root.T @ root)
    assert sizes == pytest.approx([float(np.sum((root @ a) ** 2)) for a in share.T], rel=1e-12)


def test_a_size_beyond_the_effects_bounds_is_no_size():
    """Information 1e-24 at 1 s asks for a delay of some 1e12 s."""
    seen = {"viscous_drag": (1.0, 1e4), "input_delay": (1.0, 1e-24)}
    least = minimum_detectable(LibraryScan([], seen), SETTINGS.detectable)
    assert 0 < least["viscous_drag"].value < 1
    assert least["input_delay"].value == float("inf")
    assert "input_delay" in unseen(least)
