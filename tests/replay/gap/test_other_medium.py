"""A medium that brakes by the speed squared, or by the speed: the likelier one is said."""

from dataclasses import replace

import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.other_medium import with_other_medium
from wmr_replay.gap.settings import GateSettings
from wmr_synth import hidden_log

SQUARED = {"aerodynamic_drag": {"c2_per_m": 0.2, "e2_per_m": 0.3}}
BY_SPEED = ["viscous_drag:c1_per_s=.2", "yaw_damping:d1_per_s=.3"]
BY_SQUARE = ["aerodynamic_drag:c2_per_m=.2,e2_per_m=.3"]


def medium(hide, seed):
    """A drive in a medium, and the one by the speed squared fitted to it."""
    log, _ = hidden_log("patrol", seed=seed, hide=hide, noise="mocap")
    problem = Problem.of(bin_log(log, GateSettings(), log.mode)).all_fitted()
    base = base_model(log, None, GapOptions(modes="given")).extension
    fit = fit_model(problem, replace(base, effects=SQUARED))
    scored = ScoredCandidate("aerodynamic_drag", dict(SQUARED["aerodynamic_drag"]), 0.0, 1)
    return problem, fit, FittedCandidate(scored, fit, 900.0, 890.0, 1e-9)


def test_what_brakes_by_the_speed_is_said_in_two():
    problem, fit, found = medium(BY_SPEED, 90_201)
    other, effects = with_other_medium(problem, fit, (found,))
    assert [one.name for one in effects] == ["viscous_drag", "yaw_damping"]
    assert other.deviance < fit.deviance - 6
    assert other.extension.effects["viscous_drag"]["c1_per_s"] == pytest.approx(0.2, rel=0.15)
    assert other.extension.effects["yaw_damping"]["d1_per_s"] == pytest.approx(0.3, rel=0.3)
    assert {one.fit for one in effects} == {other}


def test_what_brakes_by_the_square_keeps_its_name_with_the_other_as_an_alternative():
    problem, fit, found = medium(BY_SQUARE, 90_202)
    same, (effect,) = with_other_medium(problem, fit, (found,))
    assert same is fit
    assert effect.name == "aerodynamic_drag"
    assert dict(effect.alternatives)["viscous_drag"] > 6


def test_without_a_side_in_turning_or_beside_a_drag_it_is_left_alone():
    problem, fit, found = medium(BY_SQUARE, 90_202)
    plain = fit.extension.with_effect("aerodynamic_drag", {"c2_per_m": 0.2, "e2_per_m": 0.0})
    for extension in (plain, fit.extension.with_effect("yaw_damping", {"d1_per_s": 0.1})):
        one = replace(fit, extension=extension)
        assert with_other_medium(problem, one, (found,)) == (one, (found,))
