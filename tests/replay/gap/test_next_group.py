"""How the next group of a formula is chosen: its rivals, its worth, and what it must explain."""

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.evidence.excitation import manoeuvres
from wmr_replay.gap.formula.carriers import IN_PLACE, OVER_HEADING, told_apart
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.groups import PRODUCT, Group
from wmr_replay.gap.formula.grow import is_seen_elsewhere, margin
from wmr_replay.gap.formula.next_group import alike, fitted_with
from wmr_replay.gap.formula.scores import ScoredGroup
from wmr_replay.gap.formula.stated import Formula, score, worth
from wmr_replay.gap.formula.winners import few_alike
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.terms import parse_term

BENCH = Path(__file__).parents[3] / "bench"
SEARCH = importlib.import_module("wmr_replay.gap.formula.search")
SETTINGS = GateSettings()
AHEAD = np.full(100, 0.8)
BACK_TOO = np.where(np.arange(100) < 10, -0.5, 0.8)


def group(*names):
    return Group(PRODUCT, tuple(parse_term(f"unnamed:{name}") for name in names))


@pytest.fixture(scope="module")
def problem():
    """A log on which strips of the floor take a share of the torques, and its base model's fit."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        case = importlib.import_module("worlds.case").Case(2, "patrol", "mocap", "", 4, 60.0)
        world = importlib.import_module("formulas.plants").hidden_world("polished_strips", case).world
    problem = Problem.of(bin_log(world.log, SETTINGS, world.log.mode)).fold(0)
    return problem, fit_model(problem, BaseModel(world.log.robot, (), "test").extension)


@pytest.mark.parametrize(("v", "apart"), [(AHEAD, False), (-AHEAD, False), (BACK_TOO, True)])
def test_a_pull_and_a_resistance_are_told_apart_by_driving_both_ways(v, apart):
    columns = {"v": v, "yaw_rate": BACK_TOO}
    tried = [*told_apart(IN_PLACE, "longitudinal", columns, SETTINGS.formula)]
    assert {"sgn(v)", "v"} <= {*tried}
    assert ("1" in tried) == apart
    assert ("abs(v)" in tried) == apart
    assert "1" in [*told_apart(IN_PLACE, "yaw", columns, SETTINGS.formula)]
    assert "1" in [*told_apart(OVER_HEADING, "longitudinal", columns, SETTINGS.formula)]


def test_rivals_of_the_same_quantities_leave_room_for_others():
    by_speed = [group("longitudinal:v"), group("longitudinal:v*abs(v)"), group("longitudinal:v*v*v")]
    others = [group("yaw:v"), group("longitudinal:v*t"), group("longitudinal:effort_sum")]
    assert few_alike([*by_speed, *others], 2, 4, lambda one: one) == [*by_speed[:2], *others[:2]]


def test_every_kind_has_its_best_rival():
    waves = [Group(Family("wave", along=z), group(f"longitudinal:sin(0.4{z})*v").terms) for z in "xyxy"]
    bump = Group(Family("bump"), group("longitudinal:bump(1,2,0.5)*v").terms)
    assert few_alike([*waves, bump], 2, 3, lambda one: one) == [waves[0], bump, waves[1]]


def test_disturbances_of_the_same_density_are_alike():
    noise = Diffusion(0.05, 1.0, 0.02, 0.5, 0.01, 0.2, 0.0, 0.0)
    same = noise._replace(long_sd_mps2=0.05 / np.sqrt(3), long_tau_s=3.0)
    assert alike(noise, same, SETTINGS.formula)
    assert not alike(noise, noise._replace(yaw_tau_s=1.1), SETTINGS.formula)


def test_a_term_that_a_group_does_not_need_costs_nothing(problem):
    problem, fit = problem
    family = Family("wave", "longitudinal", "t", (("effort_diff",),), plain=True)
    families = (family, replace(family, plain=False))
    whole, bare = (Group(one, one.terms((0.3,)), (0.3,)) for one in families)
    both, alone = (
        fitted_with(problem, Formula(fit, fit), ScoredGroup(one, (0.01,) * len(one.terms), 1.0))
        for one in (whole, bare)
    )
    assert score(problem, both) < score(problem, alone)
    assert worth(problem, alone) == score(problem, alone)
    assert worth(problem, both) == pytest.approx(max(score(problem, alone), score(problem, both)), abs=2.0)


def test_another_quantity_explains_more_than_a_wrong_form_leaves(problem):
    problem, fit = problem
    gain = group("longitudinal:effort_sum")
    weaker = fit_model(problem, fit.extension.with_effect(gain.names[0], {"coefficient": -0.01}))
    before, own = Formula(fit, weaker, (gain,)), SETTINGS.formula
    assert before.gain > own.margin / own.beyond_library

    def needed(name):
        return margin(problem, before, Formula(fit, weaker, (gain, group(name))))

    assert margin(problem, Formula(fit, fit), before) == own.first_margin
    assert needed("longitudinal:effort_sum*abs(effort_sum)") == own.margin
    assert needed("yaw:effort_diff") == own.margin
    assert needed("longitudinal:effort_sum*t") == pytest.approx(own.beyond_library * before.gain)


@pytest.mark.parametrize(
    ("in_manoeuvres", "unseen", "stands"), [(90, 5, True), (-1, 5, False), (90, -5, False)]
)
def test_a_later_group_of_efforts_is_seen_in_manoeuvres(problem, in_manoeuvres, unseen, stands):
    problem, fit = problem
    push, gain = group("longitudinal:v"), group("longitudinal:effort_sum")
    one = fit.extension.with_effect(push.names[0], {"coefficient": 0.0})
    before = Formula(fit, replace(fit, extension=one), (push,))
    large = manoeuvres(problem, before.fit, "longitudinal")
    change = np.where(large, in_manoeuvres / large.sum(), 0.0) + np.where(problem.train, 0.0, unseen / 9)
    both = one.with_effect(gain.names[0], {"coefficient": 0.0})
    after = replace(fit, extension=both, row_deviance=fit.row_deviance - change)
    assert is_seen_elsewhere(problem, before, Formula(fit, after, (push, gain))) == stands


def test_a_formula_that_one_channel_makes_worse_is_left_with_the_other(monkeypatch, problem):
    problem, fit = problem
    ahead, turning = group("longitudinal:effort_sum"), group("yaw:effort_diff")
    extension = fit.extension
    for one in (ahead, turning):
        extension = extension.with_effect(one.names[0], {"coefficient": -0.01})
    formula = Formula(fit, fit_model(problem, extension), (ahead, turning))
    monkeypatch.setattr(SEARCH, "explains_more", lambda _problem, _selection, one: one.groups == (ahead,))
    part = SEARCH.better_part(problem, Selection(fit, fit, (), ()), formula)
    assert part.groups == (ahead,)
    assert part.fit.extension.effects.keys() == {*ahead.names}
