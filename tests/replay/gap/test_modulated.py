"""What is found, shaped by one quantity more: furrows that turn a robot only as it rolls."""

import re

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, FURROWS_FROM_MPS, SETTINGS, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula import answers, modulated
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula, score
from wmr_replay.gap.formula.groups import PRODUCT, Group
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.terms import parse_term

FURROWS = Family("wave", "yaw", "yaw", ((),))
ALONG = Group(FURROWS, FURROWS.terms((2.0,)), (2.0,), 1000)


def term(text: str):
    """The term of a text without its prefix."""
    return parse_term(f"unnamed:{text}")


def formula_of(problem, *groups: Group) -> Formula:
    """The groups, fitted."""
    base = fit_model(problem, Extension(BASE))
    extension = base.extension
    for name in (name for group in groups for name in group.names):
        extension = extension.with_effect(name, {"coefficient": 0.0})
    return Formula(base, fit_model(problem, extension, base.noise), groups)


def test_furrows_that_turn_a_rolling_robot_rise_with_the_speed():
    problem = problem_of(made_log(1, furrows_mps2=0.4)).fold(0)
    before = formula_of(problem, ALONG)
    found = modulated.with_modulation(problem, before, [ALONG])
    (group,) = found.groups
    kinds = {re.sub(r"[\d.]+\)$", "K)", name.removeprefix("unnamed:yaw:")) for name in group.names}
    assert kinds == {"sin(2yaw)*rise(v,K)", "cos(2yaw)*rise(v,K)"}
    assert group.shape[0] == pytest.approx(FURROWS_FROM_MPS, rel=0.25)
    size = found.fit.extension.effects["unnamed:yaw:" + f"sin(2yaw)*{group.names[0].split('*')[1]}"]
    assert size["coefficient"] == pytest.approx(-0.4, rel=0.1)
    assert score(problem, found) > score(problem, before) + SETTINGS.formula.margin
    assert group.n_tried > 10 * ALONG.n_tried
    assert found.rest is before.rest


def test_what_fades_with_nothing_stays_as_it_is():
    problem = problem_of(made_log(1, even_per_s=0.15)).fold(0)
    pull = Group(FURROWS, FURROWS.terms((2.0,)), (2.0,))
    before = formula_of(problem, pull)
    assert modulated.with_modulation(problem, before, [pull]) is before


def test_what_reads_no_place_heading_or_time_is_not_looked_at(monkeypatch):
    problem = problem_of(made_log(1))
    drag = Group(PRODUCT, (term("longitudinal:v*abs(v)"),))
    monkeypatch.setattr(modulated, "evaluate", None)
    one = Formula(None, None, (drag,))
    assert modulated.with_modulation(problem, one, [drag]) is one
    assert modulated.with_modulation(problem, one, [ALONG]) is one


@pytest.mark.parametrize(
    ("text", "own", "along"),
    [
        ("yaw:sin(2yaw)", False, {"v", "yaw_rate", "effort_sum"}),
        ("longitudinal:disc(1,2,0.5)*v", False, {"yaw_rate", "effort_diff"}),
        ("longitudinal:disc(1,2,0.5)*v", True, {"v", "yaw_rate", "effort_diff"}),
        ("longitudinal:1", False, {"v", "yaw_rate", "effort_diff"}),
    ],
)
def test_shapes_are_of_what_is_not_read_and_never_of_the_efforts_that_answer(text, own, along):
    problem = problem_of(made_log(1))
    grids = [*modulated.modulations_of(problem, [term(text)], own=own)]
    assert {grid.first.along for grid in grids} == along
    assert all(kind in {"fall", "over", "bell", "rise"} for grid in grids for kind in kinds_of(grid))
    for grid in grids:
        family, shape = grid.at(0)
        (only,) = family.terms(shape)
        assert only.channel == text.split(":")[0]
        assert [*only.factors][:-1] == [one for one in text.split(":")[1].split("*") if one != "1"]


def kinds_of(grid) -> set[str]:
    """The kinds of a grid's shapes."""
    return {family.kind for family, _ in grid.pieces}


def test_the_terms_of_an_effect_are_shaped_by_channel():
    problem = problem_of(made_log(1))
    tried = modulated.modulations_of_effects(problem, ["com_offset", "input_delay"])
    products = {(grid.first.channel, *grid.first.carriers) for grid in tried.grids}
    assert products == {
        ("longitudinal", ("yaw_rate", "yaw_rate")),
        ("yaw", ("v", "yaw_rate")),
    }
    assert modulated.modulations_of_effects(problem, ["input_delay"]).grids == ()


@pytest.mark.parametrize(("rows", "asked"), [(0, "coefficients"), (20, "share"), (400, "price")])
def test_few_manoeuvres_are_asked_for_their_share(monkeypatch, rows, asked):
    problem = problem_of(made_log(1))
    answer = Group(PRODUCT, (term("longitudinal:abs(effort_sum)*sgn(v)"),), n_tried=5000)
    formula = Formula(None, None, (answer,))
    monkeypatch.setattr(Formula, "gain", property(lambda _: 300.0))
    chosen = np.arange(len(problem.binned)) < rows
    monkeypatch.setattr(answers, "manoeuvres", lambda *_: chosen)
    found = answers.asked_of_answers(problem, None, formula)
    price = answers.log_n(problem)
    share = 300.0 * rows / problem.train.sum()
    expected = {"coefficients": price, "share": share, "price": answer.price(price)}
    assert found == pytest.approx(expected[asked])
    assert price < share < answer.price(price) or asked != "share"
    assert answers.asked_of_answers(problem, None, formula, {"longitudinal"}) == 0
