"""An actuator lag and an input delay, and what lies between them; the robots are those of the simulator."""

import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.between_forms import gain_of_both, with_forms_between
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.settings import GateSettings
from wmr_synth import hidden_log

DELAY = {"delay_s": 0.1}


def delayed(hide: str):
    """The problem of a log, the model with a delay, and the delay with a lag 20 behind it."""
    log, _ = hidden_log("patrol", seed=90_104, hide=[hide], noise="mocap")
    options = GapOptions(modes="given")
    problem = Problem.of(bin_log(log, GateSettings(), log.mode))
    extension = base_model(log, None, options).extension
    fit = fit_model(problem, extension.with_effect("input_delay", DELAY))
    scored = ScoredCandidate("input_delay", DELAY, 0.0, 1)
    others = (("actuator_lag", 20.0), ("payload", 70.0))
    return problem, fit, FittedCandidate(scored, fit, 0.0, 0.0, 0.0, alternatives=others)


def test_a_lag_of_two_poles_leaves_the_delay_nearer_to_the_lag():
    """The simulator's lag has two equal poles: half of it as a delay and half as a lag explain more."""
    problem, fit, effect = delayed("actuator_lag:time_constant_s=0.1")
    both = gain_of_both(problem, fit, "input_delay", "actuator_lag")
    assert both > 10
    nearer = dict(with_forms_between(problem, fit, effect).alternatives)
    assert nearer == {"actuator_lag": pytest.approx(max(20.0 - both, 0.0)), "payload": 70.0}


def test_a_delay_is_as_far_from_the_lag_as_before():
    problem, fit, effect = delayed("input_delay:delay_s=0.1")
    left = dict(with_forms_between(problem, fit, effect).alternatives)
    assert left["actuator_lag"] > 15
    assert left["payload"] == 70.0


def test_other_effects_and_models_with_both_are_left_alone():
    problem, fit, effect = delayed("input_delay:delay_s=0.1")
    payload = FittedCandidate(
        ScoredCandidate("payload", {"mass_ratio": 0.1}, 0.0, 1),
        fit,
        0.0,
        0.0,
        0.0,
        alternatives=(("drive_gain", 4.0),),
    )
    assert with_forms_between(problem, fit, payload) is payload
    lag = fit.extension.with_effect("actuator_lag", {"time_constant_s": 0.02})
    assert with_forms_between(problem, fit_model(problem, lag), effect) is effect
