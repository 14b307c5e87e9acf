"""What is found, shaped by one quantity more: furrows that turn a robot only as it rolls."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm
from tests.replay.gap.plain_loop import FURROWS_FROM_MPS, SETTINGS, formula_of, made_log, problem_of, term

from wmr_replay.gap.formula import answers, modulated, modulations
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula, score
from wmr_replay.gap.formula.gates import size_of
from wmr_replay.gap.formula.groups import CURVE, PRODUCT, Group
from wmr_replay.gap.model.dictionary import columns_of
from wmr_schemas.shape_factors import SHAPED

FURROWS = Family("wave", "yaw", "yaw", ((),))
ALONG = Group(FURROWS, FURROWS.terms((2.0,)), (2.0,), 1000)


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


def test_furrows_in_proportion_to_the_speed_give_way_to_those_that_rise():
    problem = problem_of(made_log(1, furrows_mps2=0.4)).fold(0)
    family = Family("wave", "yaw", "yaw", (("abs(v)",),))
    along = Group(family, family.terms((2.0,)), (2.0,), 1000)
    (group,) = modulated.with_modulation(problem, formula_of(problem, along), [along]).groups
    assert [term.factors[0] for term in group.terms] == ["sin(2yaw)", "cos(2yaw)"]
    assert {term.factors[1].split("(")[0] for term in group.terms} == {"rise"}
    assert group.shape[0] == pytest.approx(FURROWS_FROM_MPS, rel=0.25)


def test_what_stands_beside_numbers_is_tried_alone_though_it_was_spared():
    edge = Family("edge", "yaw", "y", (("cos(2yaw)",), ("sin(2yaw)",)), plain=True)
    both = Group(edge, edge.terms((1.0, 0.5)), (1.0, 0.5), 1000)
    shaped, *plain = both.parts
    assert [len(some) for some in modulated.choices(both.parts, both.parts)] == [3, 1, 2]
    assert modulated.choices([shaped], both.parts) == [[shaped], plain]
    drag = Group(PRODUCT, (term("longitudinal:v"),))
    assert modulated.choices([shaped, drag], [shaped, drag]) == [[shaped, drag], [shaped]]


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
        ("longitudinal:disc(1,2,0.5)*v", True, {"v", "yaw_rate", "effort_diff", "a_lat"}),
        ("longitudinal:1", False, {"v", "yaw_rate", "effort_diff"}),
    ],
)
def test_shapes_are_of_what_is_not_read_and_never_of_the_efforts_that_answer(text, own, along):
    problem = problem_of(made_log(1))
    grids = [*modulations.modulations_of(problem, [term(text)], own=own)]
    grids = [grid for grid in grids if kinds_of(grid) != {"soft"}]
    assert {grid.first.along for grid in grids} == along
    assert all(kind in {"fall", "over", "bell", "rise"} for grid in grids for kind in kinds_of(grid))
    for grid in grids:
        family, shape = grid.at(0)
        (only,) = family.terms(shape)
        assert only.channel == text.split(":")[0]
        assert [*only.factors][:-1] == [one for one in text.split(":")[1].split("*") if one != "1"]


@pytest.mark.parametrize(
    ("text", "own", "along"),
    [
        ("yaw:sin(2yaw)", False, {"v", "yaw_rate"}),
        ("yaw:edge(y,1,0.5)*cos(yaw)*v", False, {"yaw_rate"}),
        ("longitudinal:cos(yaw)", True, set()),
    ],
)
def test_a_speed_of_both_signs_may_turn_about_what_does_not_read_it(monkeypatch, text, own, along):
    problem = problem_of(made_log(1))
    grids = [*modulations.modulations_of(problem, [term(text)], own=own)]
    assert {grid.first.along for grid in grids if kinds_of(grid) == {"soft"}} == along
    for grid in (grid for grid in grids if grid.first.along in SHAPED):
        (only,) = grid.first.terms(grid.at(0)[1])
        assert (only.parity[grid.first.along] == "odd") == (kinds_of(grid) == {"soft"})
    ahead = {name: np.abs(column) for name, column in columns_of(problem.binned).items()}
    monkeypatch.setattr(modulations, "columns_of", lambda _: ahead)
    grids = [*modulations.modulations_of(problem, [term(text)], own=own)]
    assert not any(kinds_of(grid) == {"soft"} for grid in grids)


@pytest.mark.parametrize(
    ("texts", "found"),
    [
        (["yaw:sin(2yaw)*abs(v)"], [("v", "sin(2yaw)", {"fall", "over", "bell", "rise"})]),
        (
            ["yaw:disc(1,2,0.5)*yaw_rate"],
            [
                ("yaw_rate", "disc(1,2,0.5)", {"soft"}),
                ("yaw_rate", "disc(1,2,0.5)*sgn(yaw_rate)", {"fall", "over", "bell"}),
            ],
        ),
        (
            ["yaw:cos(yaw)*effort_sum"],
            [
                ("effort_sum", "cos(yaw)", {"soft"}),
                ("effort_sum", "cos(yaw)*effort_sum", {"fall", "over", "bell"}),
            ],
        ),
        (
            ["longitudinal:cos(yaw)*abs(effort_sum)"],
            [("effort_sum", "cos(yaw)", {"fall", "over", "bell", "rise"})],
        ),
        (["longitudinal:v*abs(v)"], []),
        (["longitudinal:cos(yaw)*v", "longitudinal:sin(yaw)*abs(v)"], []),
        (["longitudinal:cos(yaw)*v", "longitudinal:sin(yaw)"], []),
    ],
)
def test_what_a_term_reads_may_act_in_another_way_of_the_same_parity(texts, found):
    problem, terms = problem_of(made_log(1)), [term(text) for text in texts]
    grids = [*modulations.shapes_instead(problem, terms)]
    assert [(g.first.along, "*".join(g.first.carriers[0]), kinds_of(g)) for g in grids] == found
    for grid in grids:
        (shaped,) = grid.first.terms(grid.at(0)[1])
        assert shaped.parity == terms[0].parity


def test_what_moves_drags_towards_its_own_speed():
    groups = [*modulations.towards_a_speed([term("yaw:disc(1,2,0.5)*yaw_rate")], 7.0)]
    texts = [[name.removeprefix("unnamed:yaw:") for name in group.names] for group in groups]
    assert ["disc(1,2,0.5)", "disc(1,2,0.5)*yaw_rate"] in texts
    assert not any("effort_diff" in text for some in texts for text in some)
    assert {(group.family, group.n_tried) for group in groups} == {(CURVE, 28.0)}
    along = {group.columns for group in modulations.towards_a_speed([term("longitudinal:v")], 1.0)}
    assert along == {frozenset(("v", z)) for z in ("yaw_rate", "effort_diff")}
    edge = [term("longitudinal:edge(x,1,0.5)"), term("longitudinal:1")]
    by_v, *_ = modulations.towards_a_speed(edge, 1.0)
    texts = [name.removeprefix("unnamed:longitudinal:") for name in by_v.names]
    assert texts == ["edge(x,1,0.5)", "edge(x,1,0.5)*v", "1", "v"]


def test_what_acts_in_few_rows_is_as_large_as_it_is_there():
    here = np.where(np.arange(1000) < 40, 0.3, 0.0)
    assert size_of({"yaw": here}) == pytest.approx(0.3)
    wave = np.sin(np.linspace(0, 20 * np.pi, 10_000))
    assert size_of({"yaw": wave, "longitudinal": 0.1 * wave}) == pytest.approx(np.sqrt(0.75), rel=1e-3)
    assert size_of({"yaw": 0 * wave}) == 0.0


def kinds_of(grid) -> set[str]:
    """The kinds of a grid's shapes."""
    return {family.kind for family, _ in grid.pieces}


def test_the_terms_of_an_effect_are_shaped_by_channel():
    problem = problem_of(made_log(1))
    tried = modulations.modulations_of_effects(problem, ["com_offset", "input_delay"])
    products = {(grid.first.channel, *grid.first.carriers) for grid in tried.grids}
    assert products == {
        ("longitudinal", ("yaw_rate", "yaw_rate")),
        ("yaw", ("v", "yaw_rate")),
    }
    assert modulations.modulations_of_effects(problem, ["input_delay"]).grids == ()


@pytest.mark.parametrize(("rows", "asked"), [(0, "significant"), (40, "share"), (400, "price")])
def test_few_manoeuvres_are_asked_for_their_share(monkeypatch, rows, asked):
    problem = problem_of(made_log(1))
    answer = Group(PRODUCT, (term("longitudinal:abs(effort_sum)*sgn(v)"),), n_tried=5000)
    before, fit = SimpleNamespace(deviance=300.0), SimpleNamespace(deviance=0.0)
    formula = Formula(None, fit, (answer,))
    chosen = np.arange(len(problem.binned)) < rows
    monkeypatch.setattr(answers, "manoeuvres", lambda *_: chosen)
    found = answers.asked_of_answers(problem, before, formula)
    price, significant = answers.log_n(problem), norm.isf(0.005) ** 2
    share = 0.5 * 300.0 * rows / problem.train.sum()
    expected = {"significant": significant, "share": share, "price": answer.price(price)}
    assert found == pytest.approx(expected[asked])
    assert significant < share < answer.price(price) or asked != "share"
    assert answers.asked_of_answers(problem, before, formula, {"longitudinal"}) == 0
