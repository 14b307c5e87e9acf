"""What is found in time, by the heading as well; and a floor that moves."""

import numpy as np
import pytest
from tests.replay.gap.plain_loop import SETTINGS, formula_of, made_log, problem_of, term

from wmr_replay.gap.formula.by_heading import times_heading, with_heading
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.groups import PRODUCT, Group
from wmr_replay.gap.formula.modulations import a_moving_floor

SWING = Family("wave", "yaw", "t", ((),))
PUSHED = Group(SWING, SWING.terms((1.3,)), (1.3,))
OWN = SETTINGS.formula


def test_what_pushes_from_the_side_is_found_by_the_heading_too():
    problem = problem_of(made_log(1, gusts_mps2=0.4)).fold(0)
    before = formula_of(problem, PUSHED)
    after = with_heading(problem, before)
    sizes = {name: one["coefficient"] for name, one in after.fit.extension.effects.items()}
    assert {*sizes} == {f"unnamed:yaw:{wave}" for wave in ("sin(1.3t)", "cos(1.3t)")} | {
        f"unnamed:yaw:{wave}*{turn}(2yaw)" for wave in ("sin(1.3t)", "cos(1.3t)") for turn in ("sin", "cos")
    }
    assert sizes["unnamed:yaw:sin(1.3t)"] == pytest.approx(0.2, rel=0.2)
    assert sizes["unnamed:yaw:sin(1.3t)*cos(2yaw)"] == pytest.approx(-0.2, rel=0.2)
    assert before.fit.deviance - after.fit.deviance > 100.0
    assert after.rest is before.rest


def test_what_pushes_whatever_the_heading_stays_as_it_is():
    problem = problem_of(made_log(1, drag_per_s=0.1)).fold(0)
    before = formula_of(problem, PUSHED)
    assert with_heading(problem, before) is before


def test_only_what_acts_in_time_alone_is_tried():
    problem = problem_of(made_log(1, seconds=20.0)).fold(0)
    before = formula_of(problem, Group(PRODUCT, (term("yaw:v"),)))
    assert with_heading(problem, before) is before
    assert list(times_heading([], OWN)) == []


@pytest.mark.parametrize("turns", OWN.turns)
def test_all_terms_are_taken_times_both_waves(turns):
    terms = [term("longitudinal:decay(9)"), term("longitudinal:cos(0.4t)")]
    groups = list(times_heading(terms, OWN))
    group = groups[OWN.turns.index(turns)]
    columns = {"t": np.linspace(0, 9, 7), "yaw": np.linspace(-3, 5, 7)}
    found = [one.evaluate(columns) for one in group.terms]
    assert np.array(found) == pytest.approx(
        np.array([t.evaluate(columns) * f(turns * columns["yaw"]) for t in terms for f in (np.sin, np.cos)])
    )
    assert len(groups) == group.n_tried == len(OWN.turns)


def test_a_floor_that_moves_somewhere_drags_towards_its_own_speed():
    (group,) = a_moving_floor([term("longitudinal:band(y,1,0.5)*v")], 50)
    assert [one.factors for one in group.terms] == [
        ("band(y,1,0.5)", speed) for speed in ("v", "cos(yaw)", "sin(yaw)")
    ]
    assert group.n_tried == 50


@pytest.mark.parametrize(
    "texts", [("longitudinal:v",), ("yaw:disc(1,2,3)*v",), ("longitudinal:band(y,1,0.5)",)]
)
def test_what_moves_no_floor_is_no_such_one(texts):
    assert list(a_moving_floor([term(text) for text in texts], 50)) == []
