"""How soft a formula's frictions are, planes over x and y, and ruts."""

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula import softness
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.groups import PRODUCT, Group, groups_of
from wmr_replay.gap.formula.shapes import allowed
from wmr_replay.gap.model.dictionary import CURVE_TERMS
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.terms import parse_term


def product(text: str, n_tried: float = 10) -> Group:
    """A group of one term."""
    return Group(PRODUCT, (parse_term(f"unnamed:{text}"),), n_tried=n_tried)


def softness_of(text: str) -> float:
    """The number of a soft factor."""
    return float(text.removesuffix(")").split(",")[1])


def scored_by(best: float):
    """A stand-in of fits: the nearer the softness over the yaw rate to ``best``, the better the formula."""

    def refitted(_problem, formula, before, after):
        groups = tuple(softness.changed(group, before, after, 8) for group in formula.groups)
        return Formula(formula.rest, formula.fit, groups)

    def score(_problem, formula):
        (text,) = {f for f in softness.softs_of(formula) if "yaw_rate" in f}
        return -abs(np.log(softness_of(text) / best))

    return refitted, score


@pytest.mark.parametrize("start", [0.08, 0.3])
@pytest.mark.parametrize("steps", [0, 1, 3, -1, -3, 9, -9])
def test_the_softness_is_found_by_steps(monkeypatch, start, steps):
    own = SETTINGS.formula
    refitted, score = scored_by(start * own.softer**steps * 1.1)
    monkeypatch.setattr(softness, "refitted", refitted)
    monkeypatch.setattr(softness, "score", score)
    text = f"soft(yaw_rate,{start})"
    groups = product(f"yaw:{text}"), product(f"yaw:abs(v)*{text}"), product("yaw:v")
    one = softness.with_own_softness(problem_of(made_log(1)), Formula(None, None, groups))
    (found,) = softness.softs_of(one)
    gone = np.clip(steps, -own.most_softer, own.most_softer)
    assert softness_of(found) == pytest.approx(start * own.softer**gone, rel=1e-3)
    assert one.groups[2] is groups[2]
    prices = [group.n_tried for group in one.groups[:2]]
    assert prices == ([80, 80] if steps else [10, 10])


def test_other_frictions_keep_theirs():
    group = product("yaw:soft(yaw_rate,0.08)*soft(v,0.08)")
    (term,) = softness.changed(group, "soft(v,0.08)", "soft(v,0.2)", 8).terms
    assert term.factors == ("soft(yaw_rate,0.08)", "soft(v,0.2)")
    plain = product("yaw:sgn(v)")
    assert softness.changed(plain, "soft(v,0.08)", "soft(v,0.2)", 8) is plain


def test_a_softer_friction_is_fitted_from_the_sizes_before():
    problem = problem_of(made_log(1, drag_per_s=0.1))
    base, group = fit_model(problem, Extension(BASE)), product("longitudinal:soft(v,0.08)")
    fit = fit_model(problem, base.extension.with_effect(group.names[0], {"coefficient": -0.02}), base.noise)
    found = softness.refitted(problem, Formula(base, fit, (group,)), "soft(v,0.08)", "soft(v,1.5)")
    assert found.names == ("unnamed:longitudinal:soft(v,1.5)",)
    assert {*found.fit.extension.effects} == {*found.names}
    assert found.fit.deviance < fit_model(problem, fit.extension, fit.noise).deviance - 10.0
    assert found.rest is base


@pytest.mark.parametrize("own", ["longitudinal:sgn(v)", "longitudinal:effort_sum", "yaw:yaw_rate"])
def test_frictions_and_gains_may_grow_over_the_area(own):
    curve = tuple(parse_term(f"unnamed:{own}{over}") for over in ("", "*x", "*y"))
    assert curve in CURVE_TERMS


def test_a_rut_turns_a_robot_whichever_way_round():
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    either = (("cos(2yaw)",), ("sin(2yaw)",))
    kinds = {(g.first.channel, g.first.kind) for g in tried.grids if g.first.carriers == either}
    assert {("yaw", "strip"), ("yaw", "band")} <= kinds
    assert not any(channel == "longitudinal" for channel, _ in kinds)


def test_so_it_does_in_a_round_place():
    tried = groups_of(problem_of(made_log(2)).binned, SETTINGS.formula)
    either = (("cos(2yaw)",), ("sin(2yaw)",))
    assert {g.first.kind for g in tried.grids if g.first.carriers == either} >= {"bump", "disc"}


@pytest.mark.parametrize(("kind", "channel"), [("rope", "longitudinal"), ("rope_left", "yaw")])
def test_ropes_are_held_over_the_area_and_about_it(kind, channel):
    problem = problem_of(made_log(2))
    place, own = problem.binned.pose[:, :2], SETTINGS.formula
    span_m = float(np.mean(np.ptp(place, axis=0)))
    (grid,) = (g for g in groups_of(problem.binned, own).grids if g.first.kind == kind)
    ((family, shapes),) = grid.pieces
    assert (family.channel, family.carriers) == (channel, ((),))
    low, high = place.min(axis=0) - own.rope_reach * span_m, place.max(axis=0) + own.rope_reach * span_m
    assert shapes[:, :2].min(axis=0) == pytest.approx(low)
    assert np.all(shapes[:, :2].max(axis=0) >= high)
    assert np.all(np.diff(np.unique(shapes[:, 0])) == pytest.approx(own.rope_step * span_m))
    group = Group(family, family.terms(tuple(shapes[0])), tuple(shapes[0]))
    assert allowed(group, np.array([1e3, -1e3, 1e3]), problem) == pytest.approx([high[0], low[1], span_m])


def test_frictions_may_change_smoothly_over_the_whole_area():
    problem = problem_of(made_log(2))
    place = problem.binned.pose[:, :2]
    span_m = float(np.mean(np.ptp(place, axis=0)))
    wide = [g.pieces[0] for g in groups_of(problem.binned, SETTINGS.formula).grids if g.first.kind == "bump"]
    wide = [(family, shapes) for family, shapes in wide if family.plain]
    assert {family.carriers for family, _ in wide if family.channel == "yaw"} >= {(("yaw_rate",),)}
    for family, shapes in wide:
        assert {*np.round(shapes[:, 2] / span_m, 6)} == {*SETTINGS.formula.wide_shares}
        assert np.all(np.abs(shapes[:, :2] - place.mean(axis=0)) <= np.ptp(place, axis=0) + shapes[:, 2:])
        group = Group(family, family.terms(tuple(shapes[0])), tuple(shapes[0]))
        far = allowed(group, np.array([1e3, 1e3, 1e3]), problem)
        assert far == pytest.approx([*place.max(axis=0), span_m])
    narrow = Family("bump", "yaw", "", (("yaw_rate",),))
    group = Group(narrow, narrow.terms((1.0, 1.0, 1.0)), (1.0, 1.0, 1.0))
    assert allowed(group, np.full(3, 1e3), problem)[2] == pytest.approx(SETTINGS.formula.widest_bell * span_m)


def test_what_acts_far_from_a_place_levels_off_as_wide_as_the_area():
    problem = problem_of(made_log(2))
    span_m = float(np.mean(np.ptp(problem.binned.pose[:, :2], axis=0)))
    found = [g.pieces[0] for g in groups_of(problem.binned, SETTINGS.formula).grids if g.first.kind == "away"]
    carried = {(family.channel, *family.carriers) for family, _ in found}
    assert {("longitudinal", ("effort_sum",)), ("yaw", ("effort_diff",))} <= carried
    for family, shapes in found:
        assert {*np.round(shapes[:, 2] / span_m, 6)} == {*SETTINGS.formula.away_shares}
        group = Group(family, family.terms(tuple(shapes[0])), tuple(shapes[0]))
        assert allowed(group, np.full(3, 1e3), problem)[2] == pytest.approx(span_m)
        assert len(group.terms) == 1
