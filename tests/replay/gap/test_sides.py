"""What acts on one side of a quantity, and efforts at a place that was passed once."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import (
    BASE,
    FAST_MPS,
    FAST_WITHIN_MPS,
    SETTINGS,
    formula_of,
    made_log,
    problem_of,
)

from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula import grow, passes, sides, softness
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.groups import PRODUCT, Group, groups_of
from wmr_replay.gap.formula.shapes import allowed
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.terms import parse_term

SIZE_MPS2 = 0.25
OWN = SETTINGS.formula


def of_kind(kind: str, *shape: float) -> Group:
    """A pull that sets in at a speed."""
    family = Family(kind, "longitudinal", "v")
    return Group(family, family.terms(shape), shape, 100)


@pytest.fixture(scope="module", params=[True, False], ids=["forwards", "both ways"])
def dragged(request):
    """A log with a drag above a speed ahead, and whether it never reverses."""
    return problem_of(made_log(1, fast_mps2=SIZE_MPS2, forwards=request.param)).fold(0), request.param


def test_a_drag_above_a_speed_is_found_on_its_side(dragged):
    problem, forwards = dragged
    base = fit_model(problem, Extension(BASE))
    formula = grow.grow(problem, base, groups_of(problem.binned, OWN))
    first = formula.groups[0]
    assert (first.family.channel, first.family.along) == ("longitudinal", "v")
    if not forwards:
        assert first.family.kind == "above"
        assert first.shape == pytest.approx((FAST_MPS, FAST_WITHIN_MPS), rel=0.35)


def test_one_side_is_said_where_both_were_seen(dragged):
    problem, forwards = dragged
    steady = Group(PRODUCT, (parse_term("unnamed:longitudinal:v"),))
    formula = formula_of(problem, of_kind("above", FAST_MPS, FAST_WITHIN_MPS), steady)
    found = sides.two_sided(problem, formula)
    side = "beyond" if forwards else "above"
    assert found.groups[0].names == (f"unnamed:longitudinal:{side}(v,{FAST_MPS},{FAST_WITHIN_MPS})",)
    assert found.groups[1] is steady
    assert {*found.fit.extension.effects} == {*found.names}
    if forwards:
        assert found.fit.deviance == pytest.approx(formula.fit.deviance, abs=1.0)
        assert found.fit.extension.effects[found.names[0]]["coefficient"] == pytest.approx(
            -SIZE_MPS2, rel=0.2
        )
    else:
        assert found is formula


def test_the_softness_that_was_found_stays(dragged):
    problem, forwards = dragged
    family = Family("above", "longitudinal", "v", (("soft(v,0.08)",),))
    group = Group(family, family.terms((FAST_MPS, FAST_WITHIN_MPS)), (FAST_MPS, FAST_WITHIN_MPS))
    softer = softness.refitted(problem, formula_of(problem, group), "soft(v,0.08)", "soft(v,0.12)")
    (name,) = sides.two_sided(problem, softer).names
    assert "soft(v,0.12)" in name
    assert ("beyond" in name) is forwards


@pytest.mark.parametrize(("kind", "at"), [("above", -0.3), ("ring", 0.7), ("beyond", 0.7)])
def test_what_has_no_such_other_side_is_left_as_it_is(dragged, kind, at):
    problem, _ = dragged
    formula = formula_of(problem, of_kind(kind, at, 0.2))
    assert sides.two_sided(problem, formula) is formula


@pytest.mark.parametrize(
    ("kind", "asked", "given"),
    [
        ("above", (-0.4, 0.2), (-0.4, 0.2)),
        ("above", (-99.0, 0.2), (-5.0, 0.2)),
        ("above", (99.0, 99.0), (5.0, 5.0)),
        ("above", (0.3, -1.0), (0.3, 0.02)),
        ("beyond", (-0.4, 0.2), (0.02, 0.2)),
    ],
)
def test_a_side_may_begin_on_either_side_of_0(dragged, kind, asked, given):
    """Numbers in units of the speed's root mean square."""
    problem, _ = dragged
    scale = float(np.sqrt(np.mean(columns_of(problem.binned)["v"] ** 2)))
    found = allowed(of_kind(kind, 0.3, 0.2), scale * np.array(asked), problem)
    assert found / scale == pytest.approx(np.array(given))


@pytest.mark.parametrize(
    ("second", "share"),
    [(0.0, 1.0), (0.5, 0.8), (1.0, 0.5)],
)
def test_the_largest_pass_of_a_place(second, share):
    """Two passes of 2 s a minute apart, the second of another size; in each the efforts cross 0 for 1 s."""
    t_s = np.arange(0.0, 100.0, 0.04)
    in_one = (t_s % 60 > 10) & (t_s % 60 < 13) & ~((t_s % 60 > 11) & (t_s % 60 < 12))
    values = np.where(in_one, np.where(t_s < 60, 1.0, second), 0.0)
    assert passes.largest_pass(t_s, values**2, OWN) == pytest.approx(share)


def test_what_acts_most_of_the_time_is_at_no_place():
    t_s = np.arange(0.0, 100.0, 0.04)
    assert passes.largest_pass(t_s, np.ones_like(t_s), OWN) == 0
    assert passes.largest_pass(t_s, np.zeros_like(t_s), OWN) == 0


@pytest.mark.parametrize("identified", [True, False])
@pytest.mark.parametrize(
    ("text", "is_slip"),
    [
        ("longitudinal:disc(0,0,1)*effort_sum", True),
        ("longitudinal:disc(9,0,1)*effort_sum", False),
        ("longitudinal:disc(0,0,1)*v", False),
        ("longitudinal:sin(0.4x)*effort_sum", False),
        ("yaw:band(x,0,1)*soft(effort_diff,0.1)", True),
    ],
)
def test_efforts_at_a_place_passed_once_are_a_slip_where_an_identifier_says_the_modes(
    monkeypatch, identified, text, is_slip
):
    """The robot passes x = 0 once and x = 9 every 20 s."""
    t_s = np.arange(0.0, 100.0, 0.04)
    x = np.where((t_s > 30) & (t_s < 33), 0.0, 7 + 3 * np.sin(0.1 * np.pi * t_s))
    ones = np.ones_like(t_s)
    columns = {"x": x, "y": 0 * ones, "v": ones, "effort_sum": ones, "effort_diff": ones}
    monkeypatch.setattr(passes, "columns_of", lambda _: columns)
    binned = SimpleNamespace(identified=identified, t_s=t_s)
    group = Group(PRODUCT, (parse_term(f"unnamed:{text}"),))
    assert passes.is_of_one_pass(SimpleNamespace(binned=binned, settings=SETTINGS), group) is (
        is_slip and identified
    )
