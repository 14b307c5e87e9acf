"""Lines in any direction, functions of time alone, and formulas that may only answer a disturbance."""

import importlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_log, problem_of

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate, fit_model
from wmr_replay.gap.formula import formula as formula_module
from wmr_replay.gap.formula import grow as growing
from wmr_replay.gap.formula.families import Family, values
from wmr_replay.gap.formula.formula import Formula, fitted_with, simplest
from wmr_replay.gap.formula.groups import PRODUCT, Group, Tried, groups_of
from wmr_replay.gap.formula.grow import grown_both_ways
from wmr_replay.gap.formula.scores import ScoredGroup, scored_groups
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import rivals_of
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dictionary import WINDOWS_BINS, columns_of, window_of
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.terms import parse_term

BENCH = Path(__file__).parents[3] / "bench"
LINES = ("side", "strip")


@pytest.fixture(scope="module")
def hidden_world():
    """``hidden_world(form)``: a minute of a drive on the second plant with a form."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        case = importlib.import_module("worlds.case").Case(2, "hairpins", "mocap", "", 4, 60.0)
        plants = importlib.import_module("formulas.plants")
        yield lambda form: plants.hidden_world(form, case)


def with_modes(log) -> tuple[Problem, Fit]:
    """The problem of a log with its modes, two thirds of it fitted, and its base model."""
    problem = Problem.of(bin_log(log, SETTINGS, log.mode)).fold(0)
    return problem, fit_model(problem, BaseModel(log.robot, (), "test").extension)


def group(*terms: str) -> Group:
    """A group of products ahead."""
    return Group(PRODUCT, tuple(parse_term(f"unnamed:longitudinal:{term}") for term in terms))


@pytest.mark.parametrize("kind", LINES)
@pytest.mark.parametrize("far_m", [0.0, 400_000.0])
def test_a_line_s_text_says_what_is_screened(kind, far_m):
    """Far from the world's origin, too, where poses are those of a map."""
    rng = np.random.default_rng(2)
    columns = {"x": far_m + rng.uniform(-9, 9, 50), "y": -far_m + rng.uniform(-9, 9, 50), "v": np.ones(50)}
    middle = float(np.mean(columns["x"])), float(np.mean(columns["y"]))
    family = Family(kind, "longitudinal", "xy", (("v",),), around=middle)
    shape = (1.5, 0.5236, 2.0)
    (term,) = family.terms(shape)
    screened = values(family, np.array([shape]), columns)[:, 0, 0]
    np.testing.assert_allclose(term.evaluate(columns), screened, atol=1e-3)
    across = (columns["x"] - middle[0]) * np.cos(0.5236) + (columns["y"] - middle[1]) * np.sin(0.5236) - 1.5
    by_hand = np.tanh(across / 2) if kind == "side" else np.exp(-((across / 2) ** 2) / 2)
    np.testing.assert_allclose(screened, by_hand, atol=1e-3)


@pytest.mark.parametrize(("kind", "along"), [("side", "xy"), ("strip", "xy"), ("band", "x"), ("edge", "y")])
def test_lines_are_tried_on_both_channels(kind, along):
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    firsts = [g.first for g in tried.grids if g.first.kind == kind and g.first.along == along]
    assert {family.channel for family in firsts} == {"longitudinal", "yaw"}
    assert {(), ("v",)} <= {carrier for family in firsts for carrier in family.carriers}


def test_a_line_is_refined_to_where_it_is(hidden_world):
    """The edge of a lawn, from a direction 15° beside and a place beside the true ones."""
    world = hidden_world("lawn_edge")
    sizes, problem, base = world.hidden.sizes, *with_modes(world.world.log)
    at = evaluate(problem, base.extension, calmed(base.noise, SETTINGS.diffusion))
    middle, turned = (sizes["x"], sizes["y"]), sizes["angle"] - 0.26
    family = Family("side", "longitudinal", "xy", (("v",),), plain=True, around=middle)
    near = (0.5, turned, sizes["radius"])
    (first,) = scored_groups(problem, at, [Group(family, family.terms(near), near)])
    found = refined(problem, at, first)
    assert found.gain > first.gain + 20
    assert found.group.shape[1] == pytest.approx(sizes["angle"], abs=0.06)


def test_a_line_stays_within_the_area_and_narrow():
    problem = problem_of(made_log(2))
    columns = columns_of(problem.binned)
    across = columns["x"] * np.cos(0.5) + columns["y"] * np.sin(0.5)
    shapes = importlib.import_module("wmr_replay.gap.formula.shapes")
    there = Group(Family("strip", along="xy"), (), (0.0, 0.5, 1.0))
    apart, angle, width = shapes.allowed(there, np.array([1e6, 0.5, 1e6]), problem)
    assert (apart, angle) == (pytest.approx(across.max()), 0.5)
    assert width == pytest.approx(SETTINGS.formula.widest_line * np.ptp(across))


def test_a_function_of_time_is_found_and_no_disturbance(hidden_world):
    """A rotor that runs down: slow enough to be a disturbance, which costs more.

    The robot hardly stands, so that a term that is 0 at standstill says as much as one that is not.
    """
    world = hidden_world("rotor_running_down")
    problem, base = with_modes(world.world.log)
    formula = growing.grow(problem, base, groups_of(problem.binned, SETTINGS.formula))
    (first, *_) = formula.groups
    columns, values = columns_of(problem.binned), formula.fit.extension.effects
    terms = [term for group in formula.groups for term in group.terms]
    said = sum(values[term.name]["coefficient"] * term.evaluate(columns) for term in terms)
    true = np.interp(columns["t"], world.world.truth.t_s, world.hidden(world.at()))
    assert {"t"} <= first.columns <= {"t", "v"}
    assert np.std(said - true) < 0.1 * np.std(true)


def test_of_formulas_that_are_as_good_the_one_that_reads_least_is_taken(monkeypatch):
    problem = problem_of(made_log(1))
    scores = {"sgn(v)*t": 50.5, "t": 50.0, "v*t*t": 47.0}
    formulas = [SimpleNamespace(groups=(group(text),), of=text) for text in scores]
    monkeypatch.setattr(formula_module, "score", lambda _problem, formula: scores[formula.of])
    monkeypatch.setattr(formula_module, "peak_mps2", lambda _problem, _formula: 1.0)
    assert simplest(problem, formulas).of == "t"
    assert simplest(problem, formulas[::2]).of == "sgn(v)*t"


def test_of_formulas_that_are_as_good_and_read_the_same_the_one_that_says_least_is_taken(monkeypatch):
    """A saturating gain, and a cubic that runs away beyond the torques that were fitted."""
    problem = problem_of(made_log(3))
    base = fit_model(problem, Extension(BASE))
    sizes = {"v*v*v": 0.9, "v*fall(v,0.2)": 0.2}
    formulas = []
    for text, size in sizes.items():
        one = group(text)
        extension = Extension(BASE).with_effect(one.names[0], {"coefficient": size})
        formulas.append(Formula(base, evaluate(problem, extension, base.noise), (one,)))
    v = columns_of(problem.binned)["v"]
    peaks = [formula_module.peak_mps2(problem, one) for one in formulas]
    np.testing.assert_allclose(
        peaks, [0.9 * np.max(np.abs(v)) ** 3, 0.2 * np.max(np.abs(v / (1 + np.abs(v) / 0.2)))]
    )
    monkeypatch.setattr(formula_module, "score", lambda _problem, formula: 50.0 + (formula is formulas[0]))
    assert simplest(problem, formulas) is formulas[int(np.argmin(peaks))]


def test_groups_without_answers_read_no_efforts_of_their_channel():
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    left = tried.without_answers
    own = {"longitudinal": "effort_sum", "yaw": "effort_diff"}
    terms = [t for g in left.groups for t in g.terms] + [
        t for g in left.grids for t in left.group(g, 0).terms
    ]
    assert terms
    assert not any(own[term.channel] in "*".join(term.factors) for term in terms)
    names = {term.name for term in terms}
    assert {"unnamed:longitudinal:effort_diff", "unnamed:yaw:effort_sum"} <= names


@pytest.mark.parametrize(
    ("answer", "other", "order"), [(40.0, 60.0, [1, 0]), (60.0, 40.0, [0, 1]), (60.0, None, [0])]
)
def test_a_formula_without_answers_grows_beside_one_that_may_answer(monkeypatch, answer, other, order):
    problem = problem_of(made_log(1))
    base = fit_model(problem, Extension(BASE))
    made = [Formula(base, base, (group("effort_sum"),)), Formula(base, base, (group("v"),) if other else ())]
    scores = {id(made[0]): answer, id(made[1]): other}
    grown = iter(made)
    monkeypatch.setattr(growing, "grow", lambda *_: next(grown))
    monkeypatch.setattr(growing, "score", lambda _problem, formula: scores[id(formula)])
    assert grown_both_ways(problem, base, Tried(())) == [made[k] for k in order]


@pytest.mark.parametrize(
    "of",
    [
        lambda carrier: Group(PRODUCT, (parse_term(f"unnamed:yaw:{carrier}"),)),
        lambda carrier: shaped(Family("wave", "yaw", "t", ((carrier,),)), 0.5),
        lambda carrier: shaped(Family("fall", "yaw", "v", ((carrier,),)), 0.5),
        lambda carrier: shaped(Family("disc", "yaw", "", ((carrier,),)), 1.0, 2.0, 0.5),
    ],
    ids=["product", "swing", "shape", "place"],
)
def test_efforts_that_answer_are_no_rivals_of_what_they_answer(of):
    assert rivals_of(of("effort_diff")) != rivals_of(of("yaw_rate")) == rivals_of(of("effort_sum"))


def shaped(family: Family, *numbers: float) -> Group:
    """A group of a family with these numbers."""
    return Group(family, family.terms(numbers), numbers)


@pytest.mark.parametrize(
    ("carrier", "plain", "kind"),
    [
        ("cos(yaw)", True, "wave and constant"),
        ("cos(yaw)", False, "wave"),
        ("yaw_rate", True, "wave"),
        ("v", True, "wave"),
    ],
)
def test_a_tilting_wave_with_its_constant_is_no_rival_of_the_same_wave(carrier, plain, kind):
    family = Family("wave", "yaw", "x", ((carrier,),), plain=plain)
    assert rivals_of(Group(family, family.terms((0.5,)), (0.5,))) == (kind, False)


def test_a_group_that_is_chosen_twice_counts_by_its_better_score():
    """Scored at both disturbances, it is the best of all, and not in the place of its worse score."""
    problem = problem_of(made_log(1))
    both, other = group("v"), group("t")
    scored = [
        ScoredGroup(both, (0.1,), 30.0),
        ScoredGroup(other, (0.1,), 90.0),
        ScoredGroup(both, (0.3,), 200.0),
    ]
    assert [one.gain for one in growing.ranked(problem, scored)] == [90.0, 200.0]


def test_sizes_are_found_where_disturbances_are_calm():
    """From a large disturbance, which holds every size where it was, to the drag that is there."""
    problem = problem_of(made_log(6, drag_per_s=0.8))
    base = fit_model(problem, Extension(BASE))
    large = base.noise._replace(long_sd_mps2=1.0, long_tau_s=5.0)
    start = evaluate(problem, Extension(BASE), large)
    term = group("v")
    formula = fitted_with(problem, Formula(start, start), ScoredGroup(term, (0.0,), 0.0))
    assert formula.fit.extension.effects[term.names[0]]["coefficient"] == pytest.approx(-0.8, rel=0.1)
    assert formula.fit.noise.long_sd_mps2 < 0.1


def test_poor_poses_are_smoothed_for_longer():
    windows = []
    for sd_m in (0.001, 0.02, 0.05, 1.0):
        binned = problem_of(made_log(1)).binned
        noisy = replace(binned, noise_sd=np.array([sd_m * 1.6, sd_m * 1.6, 0.003]))
        windows.append(window_of(noisy))
    assert windows == sorted(windows)
    assert windows[0] == WINDOWS_BINS[0]
    assert windows[-1] == WINDOWS_BINS[-1]
    assert len(set(windows)) > 2
