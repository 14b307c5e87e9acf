"""How soft a formula's frictions are, planes over x and y, and ruts."""

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, SETTINGS, made_log, problem_of

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula import softness
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.groups import PRODUCT, Group, groups_of
from wmr_replay.gap.formula.grow import Formula
from wmr_replay.gap.formula.shapes import allowed
from wmr_replay.gap.model.dictionary import CURVE_TERMS
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.terms import parse_term


def product(text: str, n_tried: float = 10) -> Group:
    """A group of one term."""
    return Group(PRODUCT, (parse_term(f"unnamed:{text}"),), n_tried=n_tried)


def scored_by(best: float):
    """A stand-in of fits: the nearer the softness of the first term to ``best``, the better the formula."""

    def refitted(_problem, formula, quantity, width):
        groups = tuple(softness.changed(group, quantity, width, 8) for group in formula.groups)
        return Formula(formula.rest, formula.fit, groups)

    def score(_problem, formula):
        (text,) = {f for f in softness.softs_of(formula) if "yaw_rate" in f}
        return -abs(np.log(softness.softness_of(text) / best))

    return refitted, score


@pytest.mark.parametrize(
    ("best", "found"),
    [(0.08, 0.08), (0.12, 0.12), (0.17, 0.18), (0.05, 0.05333), (9.0, 0.405), (0.001, 0.0158)],
)
def test_the_softness_is_found_by_steps(monkeypatch, best, found):
    refitted, score = scored_by(best)
    monkeypatch.setattr(softness, "refitted", refitted)
    monkeypatch.setattr(softness, "score", score)
    groups = product("yaw:soft(yaw_rate,0.08)"), product("yaw:abs(v)*soft(yaw_rate,0.08)"), product("yaw:v")
    one = softness.with_own_softness(problem_of(made_log(1)), Formula(None, None, groups))
    (text,) = softness.softs_of(one)
    assert softness.softness_of(text) == pytest.approx(found, rel=1e-3)
    assert one.groups[2] is groups[2]
    prices = [group.n_tried for group in one.groups[:2]]
    assert prices == ([10, 10] if found == 0.08 else [80, 80])


def test_other_frictions_keep_theirs():
    group = product("yaw:soft(yaw_rate,0.08)*soft(v,0.08)")
    (term,) = softness.changed(group, "v", 0.2, 8).terms
    assert term.factors == ("soft(yaw_rate,0.08)", "soft(v,0.2)")
    plain = product("yaw:sgn(v)")
    assert softness.changed(plain, "v", 0.2, 8) is plain


def test_a_softer_friction_is_fitted_from_the_sizes_before():
    problem = problem_of(made_log(1, drag_per_s=0.1))
    base, group = fit_model(problem, Extension(BASE)), product("longitudinal:soft(v,0.08)")
    fit = fit_model(problem, base.extension.with_effect(group.names[0], {"coefficient": -0.02}), base.noise)
    found = softness.refitted(problem, Formula(base, fit, (group,)), "v", 1.5)
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
