"""Formulas of drives that never reverse: what holds a robot back is odd in the speed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula.one_way import held_back, odd, swinging_drag, undirected
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.formulas import formula_of, unseen_parity
from wmr_replay.gap.result.result import Estimate, FoundEffect
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import Selection
from wmr_schemas.terms import parse_term

EVEN_PER_S = 0.15
CONSTANT = "unnamed:longitudinal:1"
LINEAR, SQUARE = "unnamed:longitudinal:v", "unnamed:longitudinal:abs(v)"


def term(text: str):
    """The term of a text without its prefix."""
    return parse_term(f"unnamed:{text}")


def said_of(problem, *names: str) -> Selection:
    """A selection that says these terms, fitted."""
    base = fit_model(problem, Extension(BASE))
    extension = base.extension
    for name in names:
        extension = extension.with_effect(name, {"coefficient": 0.0})
    fit = fit_model(problem, extension, base.noise)
    found = (
        FittedCandidate(ScoredCandidate(n, fit.extension.effects[n], 0.0, 1), fit, 0.0, 0.0, 0.0)
        for n in names
    )
    return Selection(base, fit, tuple(found), ())


@pytest.fixture(scope="module", params=[True, False], ids=["forwards", "both ways"])
def pushed(request):
    """A log with what acts backwards whichever way the robot rolls, and whether it never reverses."""
    return problem_of(made_log(1, even_per_s=EVEN_PER_S, forwards=request.param)), request.param


def test_a_drive_that_never_reverses_is_told_what_holds_back_and_another_one_what_is_seen(pushed):
    problem, forwards = pushed
    said = said_of(problem, SQUARE)
    found = held_back(problem, said)
    (effect,) = found.found
    assert effect.name == (LINEAR if forwards else SQUARE)
    assert {*found.fit.extension.effects} == {effect.name}
    assert found.fit.extension.effects[effect.name]["coefficient"] == pytest.approx(-EVEN_PER_S, rel=0.1)
    assert found.fit.deviance == pytest.approx(said.fit.deviance, abs=0.5)
    assert found.fit.noise == said.fit.noise
    assert all(one.fit is found.fit for one in found.found)
    assert (found is said) is not forwards


def test_the_parity_that_a_drive_does_not_show_is_noted(pushed):
    problem, forwards = pushed
    size = Estimate(-EVEN_PER_S, (-0.2, -0.1), "1/s")
    effect = FoundEffect(LINEAR, "longitudinal", "", {"coefficient": size}, (LINEAR,), (), 0.0, "")
    notes = unseen_parity([formula_of([effect], problem.binned)], problem.binned, SETTINGS.report)
    assert len(notes) == forwards
    assert all("only rolls forwards" in note and "odd or even in v" in note for note in notes)


def test_what_is_no_term_any_more_is_no_longer_said_not_to_be_named(pushed):
    problem, forwards = pushed
    names = "unnamed:longitudinal:1", "unnamed:longitudinal:abs(effort_sum)"
    said = replace(said_of(problem, *names), not_named=(("torque_bias_common", "others explain more"),))
    found = held_back(problem, said)
    turned = {one.name for one in found.found} != {*names}
    assert bool(found.not_named) is not turned
    assert turned or not forwards


@pytest.mark.parametrize(
    ("products", "about"),
    [
        (("longitudinal:abs(effort_sum)", "longitudinal:effort_sum"), {"longitudinal:abs(effort_sum)"}),
        (("longitudinal:decay(20)", "longitudinal:1"), {"longitudinal:decay(20)", "longitudinal:1"}),
        (("longitudinal:1",), set()),
        (("longitudinal:disc(1,2,0.5)",), {"longitudinal:disc(1,2,0.5)"}),
        (("longitudinal:sin(0.4x)",), {"longitudinal:sin(0.4x)"}),
        (("longitudinal:sin(0.4t)", "longitudinal:cos(0.4t)"), set()),
        (("longitudinal:sin(0.4s)",), set()),
        (("longitudinal:edge(x,1,0.2)*cos(yaw)", "longitudinal:hill(1,2,0.5)"), set()),
        (("longitudinal:effort_sum*t", "longitudinal:v*yaw_rate", "longitudinal:sgn(v)*x"), set()),
        (("longitudinal:yaw_rate*yaw_rate",), {"longitudinal:yaw_rate*yaw_rate"}),
        (("yaw:1", "yaw:fall(t,30)"), {"yaw:1", "yaw:fall(t,30)"}),
        (("yaw:1", "yaw:abs(v)"), set()),
        (("yaw:bump(1,2,0.5)", "yaw:cos(yaw)", "yaw:abs(effort_diff)"), set()),
    ],
)
def test_what_pushes_though_nothing_directs_it(products, about):
    terms = {term(text) for text in products}
    assert undirected(terms) == {term(text) for text in about}


@pytest.mark.parametrize(
    ("size", "forwards", "others", "is_drag"),
    [
        (-0.2, True, (), True),
        (-0.1, True, (), False),
        (0.2, True, (), False),
        (-0.2, False, (), False),
        (-0.2, True, ("sin(0.5x)", "cos(yaw)", "abs(v)"), True),
    ],
)
def test_a_swing_that_hardly_ever_pushes_is_a_drag(size, forwards, others, is_drag):
    """A constant and a swing of .2 about it, on top of drives ahead and both ways."""
    problem = problem_of(made_log(1, forwards=forwards))
    sizes = {"1": size, "sin(0.5t)": 0.16, "cos(0.5t)": 0.12, **dict.fromkeys(others, 0.3)}
    terms = {text: term(f"longitudinal:{text}") for text in sizes}
    effects = {terms[text].name: {"coefficient": value} for text, value in sizes.items()}
    fit = SimpleNamespace(extension=Extension(BASE, effects))
    found = swinging_drag(problem, fit, {*terms.values(), term("yaw:sin(0.5t)")})
    assert found == ({terms[text] for text in ("1", "sin(0.5t)", "cos(0.5t)")} if is_drag else set())


def test_a_constant_alone_is_no_swing():
    problem = problem_of(made_log(1, forwards=True))
    fit = SimpleNamespace(extension=Extension(BASE, {CONSTANT: {"coefficient": -0.2}}))
    assert swinging_drag(problem, fit, {parse_term(CONSTANT)}) == set()


@pytest.mark.parametrize(
    "text",
    ["1", "abs(v)", "v*v", "abs(effort_sum)", "abs(v)*v*v", "v*soft(v,0.3)", "disc(1,2,0.5)", "abs(v)*t"],
)
def test_a_term_turned_about_is_the_same_forwards_and_the_opposite_backwards(text):
    before, after = term(f"longitudinal:{text}"), odd(term(f"longitudinal:{text}"))
    rng = np.random.default_rng(3)
    columns = {name: rng.normal(size=40) for name in ("x", "y", "t", "effort_sum")}
    speed = rng.uniform(0.2, 1.5, 40)
    assert after.parity["v"] == "odd"
    assert after.evaluate(columns | {"v": speed}) == pytest.approx(before.evaluate(columns | {"v": speed}))
    assert after.evaluate(columns | {"v": -speed}) == pytest.approx(-before.evaluate(columns | {"v": -speed}))
