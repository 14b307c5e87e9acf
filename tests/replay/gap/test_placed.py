"""What is found, and holds in some places alone: a drag on a lawn."""

import re

import pytest
from tests.replay.gap.plain_loop import (
    LAWN_M,
    SETTINGS,
    formula_of,
    made_fit,
    made_log,
    problem_of,
    term,
)

from wmr_replay.gap.formula import placed
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula, score
from wmr_replay.gap.formula.groups import PRODUCT, Group
from wmr_replay.gap.formula.placements import placements_of

DRAG = Group(PRODUCT, (term("longitudinal:v*abs(v)"),), n_tried=100)


def in_terms(names):
    """Names without numbers."""
    return [re.sub(r"\([xyt],[^)]*\)", lambda m: m[0][:2] + ")", name.split(":")[2]) for name in names]


def test_a_drag_on_a_lawn_is_told_with_its_edge():
    problem = problem_of(made_log(3, lawn_per_m=0.5, seconds=80.0)).fold(0)
    everywhere = formula_of(problem, DRAG)
    found = placed.with_placement(problem, Formula(everywhere.rest, everywhere.rest), everywhere)
    assert in_terms(found.names) == ["edge(x)*v*abs(v)", "v*abs(v)"]
    edge, plain = found.groups
    assert edge.shape[0] == pytest.approx(LAWN_M, abs=0.3)
    sizes = [found.fit.extension.effects[name]["coefficient"] for name in found.names]
    assert sizes == pytest.approx([-0.25, -0.25], rel=0.2)
    assert score(problem, found) > score(problem, everywhere) + SETTINGS.formula.placed_margin
    assert edge.n_tried > 100 * DRAG.n_tried
    assert plain.shape == ()


def test_a_drag_everywhere_stays_as_it_is():
    problem = problem_of(made_log(3, lawn_per_m=0.0, drag_per_s=0.4)).fold(0)
    one = formula_of(problem, Group(PRODUCT, (term("longitudinal:v"),)))
    assert placed.with_placement(problem, Formula(one.rest, one.rest), one) is one


def test_where_no_disturbance_is_left_nothing_is_tried(monkeypatch):
    problem = problem_of(made_log(3, lawn_per_m=0.8)).fold(0)
    everywhere = formula_of(problem, DRAG)
    monkeypatch.setattr(placed, "calmed", lambda *_: None)
    monkeypatch.setattr(placed, "evaluate", None)
    assert placed.with_placement(problem, Formula(everywhere.rest, everywhere.rest), everywhere) is everywhere


def test_the_new_groups_and_all_of_their_channel_are_tried_without_their_places():
    strip = Family("strip", "longitudinal", "xy", (("soft(v,0.1)",),))
    mat = Group(strip, strip.terms((1.0, 0.5, 0.3)), (1.0, 0.5, 0.3))
    turning = Group(PRODUCT, (term("yaw:yaw_rate"),))
    before = Formula(None, None, (DRAG, turning))
    longer = Formula(None, None, (DRAG, turning, mat))
    found = [(groups, [one.factors for one in terms]) for groups, terms in placed.choices(before, longer)]
    assert found == [
        ([mat], [("soft(v,0.1)",)]),
        ([DRAG, mat], [("soft(v,0.1)",), ("v", "abs(v)")]),
    ]
    assert not list(placed.choices(longer, longer))


def test_what_is_of_place_and_time_alone_has_no_other_place():
    gust = Family("gust", "longitudinal", "t", ((),))
    blow = Group(gust, gust.terms((5.0, 4.0)), (5.0, 4.0))
    assert not list(placed.choices(Formula(None, None), Formula(None, None, (blow,))))


@pytest.mark.parametrize(
    ("text", "absent"), [("yaw:v", set()), ("yaw:cos(yaw)*v", {"yaw"}), ("yaw:sin(0.5t)*v", {"t"})]
)
def test_a_term_is_held_against_what_it_does_not_read(text, absent):
    problem = problem_of(made_log(3))
    tried = {grid.first.along for grid in placements_of(problem, [term(text)]) if len(grid)}
    assert {"x", "y", "xy"} <= tried
    assert {"yaw", "t"} - tried == absent


def test_a_term_of_a_place_is_held_against_no_other_one():
    problem = problem_of(made_log(3))
    grids = placements_of(problem, [term("longitudinal:edge(x,0.5,0.2)*v")])
    assert {grid.first.along for grid in grids} <= {"yaw", "t"}


def test_beside_an_effect_of_the_library_nothing_is_tried(monkeypatch):
    problem = problem_of(made_log(3, lawn_per_m=0.8)).fold(0)
    everywhere = formula_of(problem, DRAG)
    named = everywhere.rest.extension.with_effect("viscous_drag", {"c1_per_s": 0.0})
    beside = Formula(made_fit(problem, named, everywhere.rest.innovations), everywhere.fit, everywhere.groups)
    monkeypatch.setattr(placed, "evaluate", None)
    assert placed.with_placement(problem, Formula(beside.rest, beside.rest), beside) is beside
