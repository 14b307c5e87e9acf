"""Switches in time, frictions in proportion to a load, parts of effects, and rows that say too much."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula import answers, search
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula, unseen_between
from wmr_replay.gap.formula.groups import PRODUCT, Group, groups_of
from wmr_replay.gap.formula.proven import Proven
from wmr_replay.gap.formula.winners import rivals_of
from wmr_replay.gap.model.dictionary import FORMULA_TERMS
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_schemas.terms import parse_term


def product(text: str) -> Group:
    """A group of one term."""
    return Group(PRODUCT, (parse_term(f"unnamed:{text}"),))


@pytest.fixture(scope="module")
def switches():
    """The switches in time that are tried on a log: (channel, carriers)."""
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    firsts = [grid.first for grid in tried.grids if (grid.first.kind, grid.first.along) == ("edge", "t")]
    return {(family.channel, family.carriers) for family in firsts}


@pytest.mark.parametrize("tried", [("yaw", "effort_diff"), ("longitudinal", "v"), ("yaw", "yaw_rate")])
def test_gains_of_turning_and_drags_may_switch_over_at_a_time(switches, tried):
    channel, carrier = tried
    assert (channel, ((carrier,),)) in switches


def test_what_the_library_or_a_place_explains_does_not(switches):
    assert ("longitudinal", (("effort_sum",),)) not in switches
    heading = (("cos(yaw)",), ("sin(yaw)",))
    assert not {(channel, carriers) for channel, carriers in switches if carriers in (((),), heading)}


def test_a_switch_is_no_rival_of_a_wave_in_time_or_an_edge_of_a_place():
    kinds = {
        rivals_of(Group(family, family.terms(shape), shape))
        for family, shape in (
            (Family("edge", "yaw", "t", (("effort_diff",),)), (30.0, 2.0)),
            (Family("edge", "yaw", "x", (("effort_diff",),)), (3.0, 0.2)),
            (Family("wave", "yaw", "t", (("effort_diff",),)), (0.5,)),
        )
    }
    assert len(kinds) == 3


@pytest.mark.parametrize(
    "term",
    [
        *("longitudinal:abs(effort_sum)*sgn(v)", "longitudinal:abs(effort_sum)*soft(v,0.08)"),
        *("longitudinal:soft(v,0.08)*abs(yaw_rate)", "yaw:abs(v)*soft(yaw_rate,0.08)"),
        "yaw:abs(effort_diff)*sgn(yaw_rate)",
    ],
)
def test_frictions_in_proportion_to_a_load_are_tried(term):
    assert parse_term(f"unnamed:{term}") in FORMULA_TERMS


@pytest.mark.parametrize("lost", [0.0, 40.0, 4000.0])
def test_no_held_out_row_says_much_alone(lost):
    problem = problem_of(made_log(1))
    unfitted = np.flatnonzero(~problem.train)
    before = np.zeros(len(problem.binned))
    after = before.copy()
    after[unfitted] = -0.1
    after[unfitted[7]] = lost
    after[np.flatnonzero(problem.train)] = 1e6
    fits = [SimpleNamespace(row_deviance=row) for row in (before, after)]
    alone = min(lost, SETTINGS.formula.most_of_a_row)
    assert unseen_between(problem, *fits) == pytest.approx(0.1 * (len(unfitted) - 1) - alone)


@pytest.mark.parametrize(
    ("named", "terms", "same"),
    [
        ("com_offset", ["yaw:v*yaw_rate"], False),
        ("com_offset", ["yaw:v*yaw_rate", "longitudinal:yaw_rate*yaw_rate"], True),
        ("slope", ["longitudinal:cos(yaw)"], True),
    ],
)
def test_what_an_effect_does_to_one_channel_is_not_the_effect(named, terms, same):
    selection = SimpleNamespace(found=[SimpleNamespace(name=named)])
    names = tuple(f"unnamed:{term}" for term in terms)
    assert search.is_the_same(SimpleNamespace(names=names), selection) is same


@pytest.mark.parametrize(
    ("ahead", "turning", "left"), [(500.0, 5.0, (0, 1)), (5.0, 500.0, (0, 2)), (5.0, 5.0, (0,))]
)
def test_an_answer_that_no_manoeuvre_of_its_channel_shows_takes_no_other_group_down(
    monkeypatch, ahead, turning, left
):
    problem = problem_of(made_log(1))
    texts = "longitudinal:v*abs(yaw_rate)", "longitudinal:effort_sum*abs(v)", "yaw:effort_diff*abs(v)"
    groups = tuple(map(product, texts))
    before, after = SimpleNamespace(deviance=900.0), SimpleNamespace(deviance=0.0)
    formula = SimpleNamespace(groups=groups, fit=after)
    selection = SimpleNamespace(found=(), fit=before)
    gains = {"longitudinal": ahead, "yaw": turning}
    monkeypatch.setattr(answers, "gains_in_manoeuvres", lambda *_: gains)
    monkeypatch.setattr(answers, "manoeuvres", lambda problem, *_: problem.train)
    monkeypatch.setattr(
        answers,
        "without",
        lambda _, one, group: SimpleNamespace(
            groups=tuple(g for g in one.groups if g is not group), fit=after
        ),
    )
    shown = answers.shown_part(problem, selection, formula)
    assert shown.groups == tuple(groups[i] for i in left)
    alone = SimpleNamespace(groups=groups[2:], fit=after)
    assert answers.shown_part(problem, selection, alone) is alone


@pytest.mark.parametrize(
    ("named", "terms", "own"),
    [
        (["yaw_damping"], ["yaw:yaw_rate*abs(yaw_rate)"], True),
        (["yaw_damping"], ["yaw:abs(v)*yaw_rate"], False),
        (["torque_saturation"], ["longitudinal:effort_sum*abs(v)"], True),
        (["viscous_drag", "slope"], ["longitudinal:v*cos(yaw)"], True),
    ],
)
def test_the_wrong_form_of_an_effect_reads_what_the_effect_reads(named, terms, own):
    selection = SimpleNamespace(found=[SimpleNamespace(name=name) for name in named])
    formula = SimpleNamespace(groups=tuple(map(product, terms)))
    assert search.is_of_their_quantities(formula, selection) is own


@pytest.mark.parametrize(("drag_per_s", "kept"), [(0.1, ["viscous_drag"]), (0.0, [])])
def test_an_effect_that_explains_nothing_beside_a_formula_is_not_said(drag_per_s, kept):
    problem = problem_of(made_log(1, drag_per_s=drag_per_s))
    group, sizes = product("yaw:abs(v)*yaw_rate"), {"c1_per_s": 0.1}
    rest = fit_model(problem, Extension(BASE, {"viscous_drag": sizes}))
    fit = fit_model(problem, rest.extension.with_effect(group.names[0], {"coefficient": 0.0}), rest.noise)
    found = Proven(problem, rest, Formula(rest, fit, (group,)), None)
    effect = FittedCandidate(ScoredCandidate("viscous_drag", sizes, 400.0, 1), rest, 400.0, 390.0, 0.0)
    left = search.without_spare(found, (effect,)).formula
    assert [*left.rest.extension.effects] == kept
    assert {*left.fit.extension.effects} == {*kept, *group.names}
