"""A loss of traction that acts once, in a time and in a place; and losses that are one."""

import numpy as np
import pytest
from tests.replay.gap.test_slipping import exact, relabelled

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate, fit_model
from wmr_replay.gap.model.extension import weight
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.labellings import same_place
from wmr_replay.gap.search.preliminary import either_loss
from wmr_replay.gap.search.same_loss import nearest_disc, other_form, with_both_forms
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.slip_doubts import Doubt
from wmr_schemas.modes import ContactMode
from wmr_synth import hidden_log

CLOSE = 10.0
SEED = 90_106
"""A patrol that is within .8 m of its place at 50 s once, and of that at 30 s at 47.8 s again."""


def place_at(problem: Problem, t_s: float, radius_m: float = 0.8) -> dict[str, float]:
    """A disc about the robot's place at a time."""
    x_m, y_m = problem.binned.pose[np.searchsorted(problem.binned.t_s, t_s), :2]
    return {"x_m": float(x_m), "y_m": float(y_m), "radius_m": radius_m}


def effect_of(fit: Fit, name: str, gain: float = 0.0) -> FittedCandidate:
    """An effect of a model as a selection holds it, with no alternative."""
    scored = ScoredCandidate(name, dict(fit.extension.effects[name]), gain, 480)
    return FittedCandidate(scored, fit, gain, gain, 0.0)


def patrol(hide: str = "") -> tuple[Problem, Fit]:
    """The log with its own labels, rolling where an effect is hidden, and its base model."""
    log, _ = hidden_log("patrol", seed=SEED, hide=[hide] if hide else [], noise="rtk")
    problem, extension = exact(log)
    return problem, fit_model(problem, extension)


def test_a_disc_is_found_from_the_rows_in_it():
    problem, _ = patrol()
    binned, place = problem.binned, place_at(problem, 50.0)
    acts = weight("low_friction_patch", place, binned)
    rows = np.flatnonzero(acts > 0.5)
    found = nearest_disc(binned, acts, np.ones(len(binned)), slice(rows[0], rows[-1] + 1))
    assert np.abs(weight("low_friction_patch", found, binned) - acts).max() < 0.2


@pytest.mark.parametrize("hidden", ["slip_interval", "low_friction_patch"])
def test_a_loss_that_acts_once_is_said_in_a_time_and_in_a_place(hidden):
    problem, _ = patrol()
    place = place_at(problem, 50.0)
    rows = np.flatnonzero(weight("low_friction_patch", place, problem.binned) > 0.5)
    t_s = problem.binned.t_s[[rows[0], rows[-1]]]
    lost = place if hidden == "low_friction_patch" else {"start_s": t_s[0], "end_s": t_s[1]}
    lost = {key: float(value) for key, value in lost.items()} | {"loss": 0.5}
    problem, base = patrol(f"{hidden}:" + ",".join(f"{key}={value}" for key, value in lost.items()))
    fit = fit_model(problem, base.extension.with_effect(hidden, lost), base.noise)
    _, (effect,) = with_both_forms(problem, fit, (effect_of(fit, hidden),))
    ((other, worse),) = effect.alternatives
    assert {effect.name, other} == {"slip_interval", "low_friction_patch"}
    assert 0 <= worse < CLOSE
    assert effect.fit.extension.effects[effect.name]["loss"] == pytest.approx(0.5, abs=0.15)


def test_a_patch_that_is_crossed_twice_is_no_interval():
    problem, base = patrol()
    place = place_at(problem, 30.0) | {"loss": 0.5}
    fit = evaluate(problem, base.extension.with_effect("low_friction_patch", place), base.noise)
    assert other_form(problem.binned, fit, "low_friction_patch") is None
    same = effect_of(fit, "low_friction_patch")
    assert with_both_forms(problem, fit, (same,)) == (fit, (same,))


def test_an_interval_is_no_patch_where_the_robot_comes_back():
    """It loses traction on one of two ways over the same place."""
    lost = {"start_s": 29.4, "end_s": 30.6, "loss": 0.5}
    problem, base = patrol("slip_interval:start_s=29.4,end_s=30.6,loss=0.5")
    place = place_at(problem, 30.0)
    there = weight("low_friction_patch", place, problem.binned) > 0.5
    assert np.any(there[problem.binned.t_s > 47])
    fit = fit_model(problem, base.extension.with_effect("slip_interval", lost), base.noise)
    _, (effect,) = with_both_forms(problem, fit, (effect_of(fit, "slip_interval"),))
    assert effect.name == "slip_interval"


def test_of_two_losses_that_meet_each_alone_is_a_model():
    problem, base = patrol()
    interval = {"start_s": 55.5, "end_s": 60.0, "loss": 0.4}
    place = place_at(problem, 55.0) | {"loss": 0.6}
    apart = place_at(problem, 80.0) | {"loss": 0.6}
    for patch, meet in ((place, True), (apart, False)):
        both = base.extension.with_effect("slip_interval", interval)
        both = both.with_effect("low_friction_patch", patch)
        selection = Selection(base, evaluate(problem, both, base.noise), (), ())
        models = either_loss(problem, base.extension, selection)
        names = [list(model.effects) for model in models]
        assert names == ([["slip_interval"], ["low_friction_patch"]] if meet else [])


def test_slipping_in_one_place_at_two_times_goes_together():
    log, _ = hidden_log("patrol", seed=SEED, noise="rtk")
    twice = relabelled(relabelled(log, 29.0, 31.0, ContactMode.SLIPPING), 55.0, 57.0, ContactMode.SLIPPING)
    elsewhere, _ = exact(twice)
    problem, _ = exact(relabelled(twice, 47.0, 49.0, ContactMode.SLIPPING))
    t_s = problem.binned.t_s
    first = Doubt(*np.searchsorted(t_s, (29.0, 31.0)).tolist(), 0.4, 99.0)
    (labelling,) = same_place(problem, [first])
    rolls = problem.binned.slips & ~labelling.problem.binned.slips
    assert rolls[(t_s > 29.2) & (t_s < 30.8)].all()
    assert rolls[(t_s > 47.6) & (t_s < 48.1)].all()
    ((name, _),) = labelling.hints
    assert name == "low_friction_patch"
    assert list(same_place(elsewhere, [first])) == []
