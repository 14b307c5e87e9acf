"""Terms of a formula that say no more than an effect of the library get its name."""

import pytest
from tests.replay.gap.plain_loop import BASE, made_log, problem_of

from wmr_replay.gap import GapOptions
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.groups import PRODUCT, Group
from wmr_replay.gap.formula.named_within import is_in, with_names
from wmr_replay.gap.formula.proven import Proven
from wmr_replay.gap.formula.search import selection_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.select import Selection
from wmr_schemas.signals import Log
from wmr_schemas.terms import parse_term

OPTIONS = GapOptions(modes="given")
DRAG_PER_S = 0.1


def product(text: str) -> Group:
    """A group of one term."""
    return Group(PRODUCT, (parse_term(f"unnamed:{text}"),))


def said_of(*texts: str, log: Log | None = None) -> Selection:
    """The selection of a formula of these terms, on a log with a hidden drag, with effects' names in it."""
    problem = problem_of(log or made_log(1, drag_per_s=DRAG_PER_S))
    base, groups = fit_model(problem, Extension(BASE)), tuple(map(product, texts))
    extension = base.extension
    for name in (name for group in groups for name in group.names):
        extension = extension.with_effect(name, {"coefficient": -0.01})
    formula = Formula(base, fit_model(problem, extension, base.noise), groups)
    found = Proven(problem, base, formula, None)
    before = selection_of(found, (), Selection(base, base, (), ()))
    return with_names(found, before, OPTIONS)


def test_a_drag_beside_a_term_of_turning_gets_its_name():
    said = said_of("longitudinal:v", "yaw:abs(v)*yaw_rate")
    drag, term = said.found
    assert drag.name == "viscous_drag"
    assert said.fit.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(DRAG_PER_S, rel=0.1)
    assert term.name == "unnamed:yaw:abs(v)*yaw_rate"
    assert {*said.fit.extension.effects} == {drag.name, term.name}
    assert drag.fit is term.fit is said.fit
    assert drag.name in [one.name for stage in said.stages for one in stage]


def test_a_curve_that_the_effect_says_as_well_gets_one_name():
    said = said_of("longitudinal:v", "longitudinal:v*v*v", "yaw:abs(v)*yaw_rate")
    assert [one.name for one in said.found] == ["viscous_drag", "unnamed:yaw:abs(v)*yaw_rate"]


@pytest.mark.parametrize("other", ["longitudinal:v*t", "longitudinal:v*abs(yaw_rate)"])
def test_what_stands_in_a_product_too_is_part_of_it(other):
    said = said_of("longitudinal:v", other)
    assert {one.name for one in said.found} == {"unnamed:longitudinal:v", f"unnamed:{other}"}


def test_a_formula_of_the_effect_alone_is_left_to_the_library():
    assert [one.name for one in said_of("longitudinal:v").found] == ["unnamed:longitudinal:v"]


def test_a_wave_over_the_ground_leaves_a_slope_beside_it_and_one_in_time_does_not():
    carriers = (("cos(yaw)",), ("sin(yaw)",))
    ground, time = (Family("wave", along=along, carriers=carriers) for along in ("x", "t"))
    assert not is_in((Group(ground, ground.terms((0.5,)), (0.5,)),), "slope")
    assert is_in((Group(time, time.terms((0.5,)), (0.5,)),), "slope")


def test_an_effect_that_explains_less_than_the_curve_does_not_stand_for_it():
    curve, turning = ("longitudinal:v", "longitudinal:v*v*v"), "yaw:abs(v)*yaw_rate"
    said = said_of(*curve, turning, log=made_log(1, drag_per_s=DRAG_PER_S, cubic_s_per_m2=0.2))
    assert {one.name for one in said.found} == {f"unnamed:{one}" for one in (*curve, turning)}
