"""Accelerations that no effect of the library is: found as formulas, and nothing where nothing is hidden.

The hidden forms are those of the benchmark, plain functions that know nothing of the dictionary.
"""

import importlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, made_fit, made_log, problem_of

from wmr_replay.gap import GapOptions, analyse
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.evidence.excitation import manoeuvres
from wmr_replay.gap.formula.bells import visits_of
from wmr_replay.gap.formula.formula import Formula, is_sound
from wmr_replay.gap.formula.groups import (
    CURVE,
    PRODUCT,
    Group,
    Tried,
    groups_of,
    plain_groups,
    without_twins,
)
from wmr_replay.gap.formula.grow import grow, passes
from wmr_replay.gap.formula.proven import Proven, proven
from wmr_replay.gap.formula.search import explains_more, in_terms, is_the_same, stated_by
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.formulas import parity_of, short_text_of, text_of
from wmr_replay.gap.result.result import Estimate, FoundEffect
from wmr_replay.gap.result.sentence import sentence_of
from wmr_replay.gap.result.verdict import verdict_of
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.model_file import Effect, Model, model_to_toml, read_model
from wmr_schemas.terms import parse_term

BENCH = Path(__file__).parents[3] / "bench"
SECONDS = 60.0
TWICE_THERE_S = 90.0
"""Until then the robot passes the dome for a second time; once is no place."""
SETTINGS = GateSettings()
FOUND = (
    *("drift_linear", "bumps_x", "cubic_drag", "even_drag", "cross", "scrub_by_speed", "dome"),
    *("stribeck_hump", "scrub_saturating", "squall", "striped_floor", "battery_sag", "slipping_belt"),
)


@pytest.fixture(scope="module")
def bench():
    """``bench(name)``: a module of bench."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        yield importlib.import_module


def grown(bench, name, seed):
    """The hidden world, and the formula that is grown on its log."""
    seconds = TWICE_THERE_S if name == "dome" else SECONDS
    case = bench("worlds.case").Case(2, "patrol", "mocap", "", seed, seconds)
    world = bench("formulas.plants").hidden_world(name, case)
    log = world.world.log
    problem = Problem.of(bin_log(log, SETTINGS, log.mode))
    base = fit_model(problem, BaseModel(log.robot, (), "test").extension)
    return world, grow(problem, base, groups_of(problem.binned, SETTINGS.formula))


@pytest.mark.parametrize("name", FOUND)
def test_a_hidden_form_is_found_with_its_variables_and_parity(bench, name):
    world, formula = grown(bench, name, 4)
    values = formula.fit.extension.effects
    effects = [{"name": n, "parameters": {"coefficient": [values[n]["coefficient"]]}} for n in formula.names]
    score = bench("formulas.score").scored(world, effects)
    assert score["channel"]
    assert score["variables"]
    assert score["parity"]
    assert score["r2"] > 0.9


@pytest.mark.parametrize(("channel", "bias"), [("longitudinal", "common"), ("yaw", "differential")])
def test_a_bias_scores_as_the_constant_that_it_is(bench, channel, bias):
    """A torque of b on each wheel, ahead or against each other: 2αb."""
    case = bench("worlds.case").Case(2, "patrol", "mocap", "", 4, 20.0)
    world, score = bench("formulas.plants").hidden_world("", case), bench("formulas.score")
    robot, at = world.world.robot, world.at()
    alpha = robot.alpha if channel == "longitudinal" else robot.alpha_yaw_or_alpha
    found = score.part_of(f"torque_bias_{bias}", {"bias_nm": 0.3}, robot)
    term = score.part_of(f"unnamed:{channel}:1", {"coefficient": 0.6 * alpha}, robot)
    assert (found.channel, found.variables) == (term.channel, term.variables) == (channel, frozenset())
    np.testing.assert_allclose(found.of(at), term.of(at))


def test_no_two_forms_have_one_name(bench):
    order = bench("formulas.forms").ORDER
    assert len({*order}) == len(order) > 200


def test_terms_of_the_same_variables_count_together(bench):
    score, case = bench("formulas.score"), bench("worlds.case").Case(2, "patrol", "mocap", "", 4, 40.0)
    world = bench("formulas.plants").hidden_world("squall", case)
    at = world.at()
    parts = score.parts_of(
        [
            {"name": f"unnamed:longitudinal:{text}", "parameters": {"coefficient": [size]}}
            for text, size in (("sin(yaw)", 0.1), ("sin(0.5t)*cos(yaw)", 0.02), ("cos(0.5t)*sin(yaw)", -0.03))
        ],
        world.world.robot,
    )
    together = score.by_variables(parts, at)
    assert {*together} == {frozenset({"yaw"}), frozenset({"yaw", "t"})}
    np.testing.assert_allclose(together[frozenset({"yaw"})], 0.1 * np.sin(at.yaw))
    np.testing.assert_allclose(
        together[frozenset({"yaw", "t"})],
        0.02 * np.sin(0.5 * at.t) * np.cos(at.yaw) - 0.03 * np.cos(0.5 * at.t) * np.sin(at.yaw),
    )


@pytest.mark.parametrize("seed", [11, 12])
def test_nothing_grows_where_nothing_is_hidden(bench, seed):
    assert grown(bench, "", seed)[1].groups == ()


def test_a_formula_is_the_verdict_with_units_and_intervals(bench, tmp_path):
    case = bench("worlds.case").Case(2, "patrol", "mocap", "", 5, SECONDS)
    world = bench("formulas.plants").hidden_world("bumps_x", case)
    result = analyse(world.world.log, None, GapOptions(modes="given"))
    (formula,) = result.formulas
    assert result.verdict == "unnamed"
    assert {p.unit for effect in result.effects for p in effect.parameters.values()} == {"m/s²"}
    assert formula.terms == tuple(effect.name for effect in result.effects)
    assert formula.text in result.sentence
    assert formula.rms_mps2 == pytest.approx(np.std(world.hidden(world.at())), rel=0.2)
    path = tmp_path / "found.model.toml"
    path.write_text(model_to_toml(result.model), encoding="utf-8")
    assert read_model(path).effects == result.model.effects
    again = analyse(world.world.log, read_model(path), GapOptions(modes="given"))
    assert again.verdict == "nothing_missing"


def estimate(name, value):
    term = parse_term(name)
    low, high = value - 0.01, value + 0.01
    parameters = {"coefficient": Estimate(value, (low, high), term.unit)}
    return FoundEffect(name, term.channel, term.formula, parameters, (name,), (), 0.0, "")


def test_the_text_of_a_formula():
    terms = [estimate("unnamed:longitudinal:v*v*v", -0.1), estimate("unnamed:longitudinal:sgn(v)", -0.2)]
    assert text_of(terms) == (
        "dv_long/dt += -0.1 s/m² (-0.11 to -0.09)·v·v·v - 0.2 m/s² (0.19 to 0.21)·sgn(v) (odd in v)"
    )
    mixed = [parse_term("unnamed:yaw:v"), parse_term("unnamed:yaw:abs(v)*yaw_rate")]
    assert parity_of(mixed) == {"v": "mixed", "yaw_rate": "mixed"}


def test_a_long_formula_is_cut_short_in_the_sentence_and_whole_in_the_text():
    names = ("1", "sin(0.5t)", "cos(0.5t)", "v", "v*yaw_rate", "v*cos(yaw)")
    terms = [estimate(f"unnamed:longitudinal:{name}", 0.1 * (-1) ** k) for k, name in enumerate(names)]
    four = "dv_long/dt += 0.1 m/s² - 0.1 m/s²·sin(0.5t) + 0.1 m/s²·cos(0.5t) - 0.1 1/s·v"
    assert short_text_of(terms[:4], SETTINGS.report) == f"{four} (mixed in v)"
    more = "of t, v, yaw_rate; mixed in v, mixed in yaw_rate"
    assert short_text_of(terms[:5], SETTINGS.report) == f"{four} + 1 more term ({more})"
    assert short_text_of(terms, SETTINGS.report).startswith(f"{four} + 2 more terms (of t, v, yaw_rate, yaw;")
    assert short_text_of(terms[:2], SETTINGS.report) == text_of(terms[:2])
    assert text_of(terms).count(" to ") == len(names)


def test_an_effect_beside_a_formula_is_named():
    slope = FoundEffect("slope", "longitudinal", "", {}, ("slope",), (), 0.0, "")
    term = estimate("unnamed:longitudinal:v*v*v", -0.1)
    problem = SimpleNamespace(settings=SETTINGS)
    assert verdict_of(problem, (slope, term), None, ())[0] == "named"
    assert verdict_of(problem, (term,), SimpleNamespace(not_named=()), ())[0] == "unnamed"
    assert sentence_of("named", (slope, term), (), SETTINGS.report) == (
        "The model lacks slope and dv_long/dt += -0.1 s/m² (-0.11 to -0.09)·v·v·v (odd in v), "
        "for which the library has no name."
    )


def test_a_base_model_may_hold_a_formula(tmp_path):
    effects = (
        Effect("unnamed:longitudinal:sin(0.9667x)*cos(yaw)", {"coefficient": -0.23}, {"coefficient": 0.01}),
        Effect("unnamed:longitudinal:hill(1.3,-1.05,1.66)", {"coefficient": 0.7}),
        Effect("unnamed:yaw:effort_diff*t", {"coefficient": -0.001}),
    )
    path = tmp_path / "a.model.toml"
    path.write_text(model_to_toml(Model(effects=effects)), encoding="utf-8")
    assert read_model(path).effects == effects


def test_a_curve_costs_the_same_in_one_piece_and_in_terms():
    curve = next(group for group in plain_groups() if group.family == CURVE)
    parts = curve.parts
    assert [part.terms for part in parts] == [(term,) for term in curve.terms]
    assert sum(part.price(8.0) for part in parts) == pytest.approx(curve.price(8.0))


def test_a_curve_stands_beside_an_effect_without_its_twin():
    curves = [group for group in without_twins(plain_groups(), ["payload"]) if group.family == CURVE]
    assert ("unnamed:longitudinal:effort_sum*abs(v)", "unnamed:longitudinal:effort_sum*v*v") in [
        curve.names for curve in curves
    ]
    assert all(len(curve.terms) > 1 for curve in curves)


def test_terms_that_cancel_each_other_are_no_formula(bench):
    _world, formula = grown(bench, "cubic_drag", 4)
    terms = (parse_term("unnamed:longitudinal:v*abs(v)"), parse_term("unnamed:longitudinal:abs(v)*v"))
    groups = tuple(Group(PRODUCT, (term,)) for term in terms)
    for coefficients, sound in (((-0.1, 0.0), True), ((-10.0, 9.5), False)):
        extension = formula.rest.extension
        for term, value in zip(terms, coefficients, strict=True):
            extension = extension.with_effect(term.name, {"coefficient": value})
        fit = replace(formula.fit, extension=extension)
        assert is_sound(fit.problem, replace(formula, fit=fit, groups=groups)) == sound


@pytest.mark.parametrize("plant", [2, 3])
def test_a_plant_with_nothing_hidden_is_the_compiled_one(bench, plant):
    case = bench("worlds.case").Case(plant, "patrol", "mocap", "", 3, 5.0)
    here = bench("formulas.plants").hidden_world("", case).world
    there = bench("worlds.simulate").simulated(case)
    np.testing.assert_array_equal(here.log.pose.x_m, there.log.pose.x_m)


def test_a_form_that_the_data_cannot_tell_may_be_refused(bench):
    plants, case = bench("formulas.plants"), bench("worlds.case").Case(2, "patrol", "mocap", "", 3, 20.0)
    hidden = plants.Hidden("cubic_drag", {"c": 0.1})
    seen = plants.HiddenWorld(plants.PLANTS[2](case, hidden), hidden)
    small = plants.HiddenWorld(seen.world, plants.Hidden("cubic_drag", {"c": 1e-6}))
    judged = bench("formulas.oracle").judged
    assert not judged(seen).excuses([])
    assert judged(small).excuses([])


def test_a_place_counts_once_a_visit(bench):
    case = bench("worlds.case").Case(2, "patrol", "mocap", "", 6, 30.0)
    log = bench("formulas.plants").hidden_world("", case).world.log
    binned = bin_log(log, SETTINGS, log.mode)
    x, y = binned.pose[200, :2]
    assert visits_of(binned, (float(x), float(y), 1e-3), SETTINGS.formula) == 1
    assert visits_of(binned, (1e3, 1e3, 1.0), SETTINGS.formula) == 0


@pytest.mark.parametrize(
    ("named", "terms", "same"),
    [
        (["scrub_torque"], ["yaw:sgn(yaw_rate)"], True),
        (["scrub_torque"], ["yaw:sgn(yaw_rate)", "yaw:yaw_rate"], False),
        (["yaw_damping"], ["yaw:sgn(yaw_rate)"], False),
        ([], ["yaw:sgn(yaw_rate)"], False),
        (["slope"], ["longitudinal:sin(yaw)"], True),
        (["slope"], ["longitudinal:cos(yaw)", "longitudinal:sin(yaw)"], True),
    ],
)
def test_a_formula_of_a_named_effects_own_term_is_that_effect(named, terms, same):
    selection = SimpleNamespace(found=[SimpleNamespace(name=name) for name in named])
    names = tuple(UNNAMED_PREFIX + term for term in terms)
    assert is_the_same(SimpleNamespace(names=names), selection) is same


@pytest.mark.parametrize(("unseen", "takes_its_place"), [(5.0, True), (-100.0, True), (-300.0, False)])
def test_a_named_effect_stays_where_unseen_rows_speak_against_a_formula(unseen, takes_its_place):
    """On the fitted rows the formula explains 500 units of deviance more than the effect does."""
    problem = problem_of(made_log(1))
    base, named, better = (
        with_deviance(problem, fitted, held)
        for fitted, held in ((0.0, 0.0), (-400.0, 0.0), (-900.0, -unseen))
    )
    named = replace(named, extension=Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}))
    scored = ScoredCandidate("viscous_drag", {"c1_per_s": 0.1}, 400.0, 1)
    effect = FittedCandidate(scored, named, 400.0, 390.0, 0.0)
    formula = Formula(base, better, (Group(PRODUCT, (parse_term("unnamed:longitudinal:v*t"),)),))
    selection = Selection(base, named, (effect,), ((effect,),))
    assert explains_more(problem, selection, formula) is takes_its_place


@pytest.mark.parametrize(("unseen", "does"), [(40.0, True), (0.0, False), (-40.0, False)])
def test_what_the_first_group_foresees_counts(unseen, does):
    """It explains 15 units of deviance beyond its price of the fitted rows; 20 are asked."""
    problem = problem_of(made_log(1))
    group = Group(PRODUCT, (parse_term("unnamed:longitudinal:v*t"),))
    gain = group.price(float(np.log(3 * problem.train.sum()))) + 15.0
    base, better = (with_deviance(problem, *both) for both in ((0.0, 0.0), (-gain, -unseen)))
    longer = Formula(base, better, (group,))
    assert passes(problem, Formula(base, base), longer) is does


def test_an_effect_that_is_part_of_a_curve_becomes_a_term_of_it():
    problem = problem_of(made_log(1, drag_per_s=0.1))
    base = fit_model(problem, Extension(BASE))
    beside = fit_model(problem, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}))
    group = Group(PRODUCT, (parse_term("unnamed:longitudinal:v*v*v"),))
    fit = fit_model(problem, beside.extension.with_effect(group.names[0], {"coefficient": 0.0}))
    (formula,) = in_terms(problem, base, Formula(beside, fit, (group,)))
    assert "unnamed:longitudinal:v" in formula.names
    assert "viscous_drag" not in formula.fit.extension.effects
    assert formula.fit.extension.effects["unnamed:longitudinal:v"]["coefficient"] < -0.05
    none = replace(beside, extension=Extension(BASE, {"input_delay": {"delay_s": 0.1}}))
    assert in_terms(problem, base, Formula(none, fit, (group,))) == []


@pytest.mark.parametrize(("in_manoeuvres", "takes_its_place"), [(True, True), (False, False)])
def test_a_formula_of_efforts_takes_an_effects_place_where_manoeuvres_show_it(in_manoeuvres, takes_its_place):
    """The formula explains 500 units of deviance more than the effect, in manoeuvres or where the torques may
    only answer the disturbance.
    """
    problem = problem_of(made_log(1))
    base, named, better = (with_deviance(problem, fitted, 0.0) for fitted in (0.0, -400.0, -900.0))
    named = replace(named, extension=Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}))
    names = [f"unnamed:longitudinal:{product}" for product in ("effort_sum", "effort_sum*abs(effort_sum)")]
    large = manoeuvres(problem, named, "longitudinal")
    rows = large if in_manoeuvres else problem.train & ~large
    deviance = named.row_deviance - 500.0 * rows / rows.sum()
    extension = Extension(BASE, {name: {"coefficient": 0.1} for name in names})
    better = replace(better, extension=extension, row_deviance=deviance)
    scored = ScoredCandidate("viscous_drag", {"c1_per_s": 0.1}, 400.0, 1)
    effect = FittedCandidate(scored, named, 400.0, 390.0, 0.0)
    formula = Formula(base, better, tuple(Group(PRODUCT, (parse_term(name),)) for name in names))
    selection = Selection(base, named, (effect,), ((effect,),))
    assert explains_more(problem, selection, formula) is takes_its_place


def test_what_a_formula_explains_ahead_proves_nothing_of_turning():
    problem = problem_of(made_log(1, drag_per_s=0.1))
    base = fit_model(problem, Extension(BASE))
    groups = tuple(
        Group(PRODUCT, (parse_term(f"unnamed:{term}"),)) for term in ("longitudinal:v", "yaw:effort_diff")
    )
    extension = base.extension.with_effect(*groups[0].names, {"coefficient": -0.1})
    extension = extension.with_effect(*groups[1].names, {"coefficient": -0.01})
    formula = Formula(base, fit_model(problem, extension, base.noise), groups)
    found = proven(problem, base, formula, Tried(groups), GapOptions(modes="given"))
    assert found.formula.names == ("unnamed:longitudinal:v",)
    assert tuple(found.formula.fit.extension.effects) == found.formula.names


@pytest.mark.parametrize("terms", [("v",), ("v", "sgn(v)")])
def test_a_formula_of_the_effects_own_terms_says_which_of_them_stand(terms):
    problem = problem_of(made_log(1, drag_per_s=0.1))
    base = fit_model(problem, Extension(BASE))
    found = {"viscous_drag": {"c1_per_s": 0.05}, "rolling_resistance": {"c0_mps2": 0.05}}
    fit = made_fit(problem, Extension(BASE, found), np.zeros((len(problem.train), 3)))
    effects = tuple(
        FittedCandidate(ScoredCandidate(name, size, 40.0, 1), fit, 40.0, 30.0, 0.0)
        for name, size in found.items()
    )
    formula = Formula(
        base, base, tuple(Group(PRODUCT, (parse_term(f"unnamed:longitudinal:{t}"),)) for t in terms)
    )
    selection = Selection(base, fit, effects, (effects,))
    stated = stated_by(Proven(problem, base, formula, None), problem, selection)[1]
    if len(terms) == 2:
        assert stated is selection
        return
    assert [effect.name for effect in stated.found] == ["viscous_drag"]
    assert stated.fit.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(0.1, rel=0.2)


def with_deviance(problem, fitted, held_out):
    """A fit whose fitted and held-out rows add up to these −2 log likelihoods."""
    train = problem.train
    rows = np.where(train, fitted / train.sum(), held_out / (~train).sum())
    fit = made_fit(problem, Extension(BASE), np.zeros((len(train), 3)))
    return replace(fit, deviance=fitted, row_deviance=rows)


@pytest.mark.parametrize(
    ("term", "at_600_s"), [("effort_sum", 1.0), ("v*t", 600.0), ("effort_sum*t*t", 600.0**2)]
)
def test_a_step_of_a_coefficient_stays_small_on_long_logs(term, at_600_s):
    """A step that adds an acceleration of m/s² makes the model run away, and tells no slope."""
    assert candidate_of(f"unnamed:longitudinal:{term}").steps["coefficient"] * at_600_s < 0.01
