"""What builds up and is let go, round paths, and shapes of the product of two quantities."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from tests.replay.gap.plain_loop import SETTINGS, made_log, problem_of, term

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.evidence.excitation import BOTH, torques_of
from wmr_replay.gap.formula.bells import circles_of
from wmr_replay.gap.formula.families import Family, values
from wmr_replay.gap.formula.grids import saws_of
from wmr_replay.gap.formula.groups import Group, groups_of
from wmr_replay.gap.formula.scores import scored_groups
from wmr_replay.gap.formula.shapes import allowed, refined
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dictionary import columns_of

BENCH = Path(__file__).parents[3] / "bench"
OWN = SETTINGS.formula
SAW = Family("saw", "longitudinal", "t", (("soft(v,0.05)",),))
CIRCLE = Family("circle", "yaw", "", (("soft(yaw_rate,0.04)",),))


def group(family: Family, *shape: float) -> Group:
    """The group of a family with these numbers."""
    return Group(family, family.terms(shape), shape)


@pytest.fixture(scope="module")
def hidden():
    """``hidden(form, family)``: sizes, problem and calm base model of a drive of 90 s on the second plant."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        Case = importlib.import_module("worlds.case").Case
        plants = importlib.import_module("formulas.plants")

        def made(form, family):
            world = plants.hidden_world(form, Case(2, family, "mocap", "", 4, 90.0))
            log = world.world.log
            problem = Problem.of(bin_log(log, SETTINGS, log.mode)).fold(0)
            base = fit_model(problem, BaseModel(log.robot, (), "test").extension)
            calm = calmed(base.noise, SETTINGS.diffusion) or base.noise
            return world.hidden.sizes, problem, evaluate(problem, base.extension, calm)

        yield made


def test_a_saw_is_refined_to_its_period_and_its_drops(hidden):
    """From the nearest of the grid: a rake that fills and is lifted."""
    sizes, problem, at = hidden("filling_rake", "hairpins")
    saws = saws_of(problem.binned.t_s, OWN)
    near = [group(SAW, *shape) for shape in saws if abs(shape[1] / sizes["period"] - 1) < 0.15]
    first = scored_groups(problem, at, near)[0]
    found = refined(problem, at, first)
    begins, period = found.group.shape
    assert period == pytest.approx(sizes["period"], rel=0.02)
    drops_at = (begins / period + sizes["phase"] + 0.5) % 1.0 - 0.5
    assert abs(drops_at) < 0.05
    assert found.coefficients[0] == pytest.approx(-sizes["size"], rel=0.15)


def test_a_circle_is_refined_to_where_it_is(hidden):
    sizes, problem, at = hidden("gravel_ring", "polisher")
    circles = [group(CIRCLE, *shape) for shape in circles_of(problem.binned, OWN)]
    found = refined(problem, at, scored_groups(problem, at, circles)[0])
    x, y, radius, width = found.group.shape
    assert np.hypot(x, y) < 0.3
    assert radius == pytest.approx(sizes["radius"], abs=0.25)
    assert width == pytest.approx(sizes["width"] / np.sqrt(2), rel=0.35)


def test_saws_are_seen_twice_and_begin_within_their_first_period():
    t_s = np.linspace(3.0, 93.0, 900)
    begins, period = saws_of(t_s, OWN).T
    assert period.min() >= OWN.least_saw_s - 1e-9
    assert period.max() == pytest.approx(OWN.longest_saw * 90.0)
    assert np.all((begins >= 3.0) & (begins < 3.0 + period))
    assert len(saws_of(t_s[:100], OWN)) == 0


@pytest.mark.parametrize(
    ("family", "shape", "text"),
    [
        (SAW, (3.25, 12.5), "saw(3.25,12.5)"),
        (CIRCLE, (1.0, -0.5, 2.0, 0.4), "circle(1,-0.5,2,0.4)"),
        (Family("over", "yaw", "a_lat", (("v",),)), (0.1,), "over(a_lat,0.1)"),
        (Family("beyond", "yaw", "power", (("v",),)), (0.5, 0.2), "beyond(power,0.5,0.2)"),
    ],
)
def test_a_text_says_what_is_screened(family, shape, text):
    columns = columns_of(problem_of(made_log(2)).binned)
    (only,) = family.terms(shape)
    assert text in only.factors
    screened = values(family, np.array([shape]), columns)[:, 0, 0]
    carried = term(f"yaw:{'*'.join(family.carriers[0])}").evaluate(columns)
    np.testing.assert_allclose(only.evaluate(columns), screened * carried, atol=1e-9)


def test_what_is_shaped_by_power_may_answer_ahead():
    assert torques_of("unnamed:longitudinal:sgn(v)*over(power,0.5)") == "longitudinal"
    assert torques_of("unnamed:yaw:yaw_rate*over(power,0.5)") == BOTH
    assert torques_of("unnamed:longitudinal:v*over(a_lat,0.5)") == BOTH


def test_saws_and_circles_stay_within_what_is_looked_for():
    problem = problem_of(made_log(2))
    span_s = float(np.ptp(problem.binned.t_s))
    at_s, period_s = allowed(group(SAW, 3.0, 10.0), np.array([-40.0, 1e3]), problem)
    assert (at_s, period_s) == (-40.0, pytest.approx(OWN.longest_saw * span_s))
    assert allowed(group(SAW, 3.0, 10.0), np.array([3.0, 1e-3]), problem)[1] == OWN.least_saw_s
    place = problem.binned.pose[:, :2]
    span_m = float(np.mean(np.ptp(place, axis=0)))
    x, y, radius, width = allowed(group(CIRCLE, 0.0, 0.0, 1.0, 0.5), np.full(4, 1e3), problem)
    assert (x, y) == pytest.approx(tuple(place.max(axis=0)))
    assert (radius, width) == pytest.approx((OWN.circle_shares[-1] * span_m, OWN.widest_line * span_m))


def test_both_channels_are_tried_with_them():
    tried = groups_of(problem_of(made_log(2)).binned, OWN)
    for kind, along in (("saw", "t"), ("circle", ""), ("over", "a_lat"), ("over", "power")):
        firsts = [
            family
            for g in tried.grids
            for family, _ in g.pieces
            if (family.kind, family.along) == (kind, along)
        ]
        assert {family.channel for family in firsts} == {"longitudinal", "yaw"}
