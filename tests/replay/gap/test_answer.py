"""Lags and weak gains that a controller makes by its answer to the disturbance. The oracle is a plain loop in
which nothing lags, or something does.
"""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model, gauss_newton
from wmr_replay.gap.evidence.answer import (
    RESPONSES,
    answer_p,
    answered_score,
    beyond_answer,
    whitened_change,
)
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.detectable import minimum_detectable
from wmr_replay.gap.result.verdict import answered_note
from wmr_replay.gap.scan.scan import LibraryScan
from wmr_replay.gap.search.fit_candidates import ANSWERED
from wmr_replay.gap.search.select import select
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

ROBOT = RobotParameters(alpha=0.28, alpha_yaw=0.34, half_track_m=0.25)
BASE = Base(0.28, 0.34, 0.25, 8.0, 0.0, 0.5, 0.5, 0.0, 5.0)
PRECISE, RATE_PER_S, STEP_S = (0.001, 0.001, 0.002), 3.0, 0.01
DISTURBANCE_MPS2, KEPT = 0.025, float(np.exp(-STEP_S / 0.2))


def calm_log(
    seed: int, *, lag_s: float = 0.0, steps: bool = False, seconds: float = 60.0, gains=(1.0, 1.0)
) -> Log:
    """A loop of K = 3/s that knows its speeds: they swell slowly, or change in steps. Torques lag, and act
    by ``gains`` ahead and in turning.
    """
    rng, n, l = np.random.default_rng(seed), round(seconds / STEP_S), BASE.half_track_m
    t_s = np.arange(n) * STEP_S
    wanted = np.column_stack([0.8 + 0.2 * np.sin(0.8 * t_s), 0.1 * np.sin(0.15 * t_s)])
    if steps:
        wanted = wanted + np.sign(np.sin(1.5 * t_s))[:, None] * [0.4, 0.1]
    d, acting, z = np.zeros(2), np.zeros(2), np.array([0.0, 0.0, 0.0, *wanted[0]])
    path, sent, share = np.zeros((n, 3)), np.zeros((n, 2)), STEP_S / max(lag_s, STEP_S)
    for k in range(n):
        path[k], asked = z[:3], RATE_PER_S * (wanted[k] - z[3:])
        sent[k] = asked / [BASE.alpha, BASE.alpha_yaw]
        acting += share * (asked * gains - acting)
        d = KEPT * d + DISTURBANCE_MPS2 * np.sqrt(1 - KEPT**2) * rng.normal(size=2)
        v, w = z[3:] + (acting + d) * STEP_S / 2
        yaw = z[2] + z[4] / l * STEP_S / 2
        z += STEP_S * np.array([v * np.cos(yaw), v * np.sin(yaw), w / l, *(acting + d)])
    t_ns = np.round(t_s * 1e9).astype(np.int64)
    pose = path + rng.normal(size=(n, 3)) * PRECISE
    torques = (sent @ np.array([[1.0, 1.0], [-1.0, 1.0]]) / 2).T.copy()
    return Log(
        PoseTrack(t_ns, *pose.T.copy()), TorqueTrack(t_ns, *torques, *np.full((2, n), np.nan)), None, ROBOT
    )


def problem_of(log: Log) -> Problem:
    return Problem.of(bin_log(log, GateSettings())).all_fitted()


def fitted_in(problem: Problem, name: str = "actuator_lag") -> tuple[Fit, Fit]:
    """The base model, and the same with a response to the torques, at the base model's disturbances."""
    without = fit_model(problem, Extension(BASE))
    extension = Extension(BASE, {name: {RESPONSES[name]: 0.05}})
    return without, gauss_newton(problem, extension, without.noise, 4)


def scores(problem: Problem, name: str) -> tuple[float, float]:
    """The score in standard deviations, and what an answer at the loop's own rate would make of it."""
    without, fit = fitted_in(problem, name)
    along = whitened_change(problem, without.extension, fit, name)
    own = replace(problem.settings, answer=replace(problem.settings.answer, rates_per_s=(RATE_PER_S,)))
    known = replace(problem, binned=replace(problem.binned, settings=own))
    expected = answered_score(known, fit, name, fit.values[0])
    size = float(np.sqrt(along @ along))
    return float(along @ without.innovations.ravel()) / size, expected / size


@pytest.mark.parametrize("name", RESPONSES)
def test_what_an_answer_makes_of_a_response_is_what_loops_without_one_show(name):
    problems = (problem_of(calm_log(seed)) for seed in range(3))
    seen, expected = np.array([scores(problem, name) for problem in problems]).T
    assert np.all(seen > 1.0)
    assert abs(np.mean(seen - expected)) < 3 / np.sqrt(3)


@pytest.mark.parametrize(("lag_s", "steps"), [(0.0, False), (0.0, True), (0.12, True)])
def test_a_lag_must_be_more_than_an_answer_makes(lag_s, steps):
    problem = problem_of(calm_log(9, lag_s=lag_s, steps=steps))
    without, lag = fitted_in(problem)
    p = answer_p(problem, without.extension, lag, "actuator_lag")
    assert p < 1e-6 if lag_s else p > 1e-3


def test_a_lag_counts_as_detectable_where_it_is_more_than_an_answer_makes():
    seen = LibraryScan([], {"actuator_lag": (0.03, 100.0), "viscous_drag": (1.0, 1e4)})
    plain, answered = (
        minimum_detectable(seen, GateSettings().detectable, answers)
        for answers in ({}, {"actuator_lag": 20.0})
    )
    more_s = answered["actuator_lag"].value - plain["actuator_lag"].value
    assert more_s == pytest.approx(0.03 * 20.0 / 100.0)
    assert answered["viscous_drag"] == plain["viscous_drag"]


def test_effects_that_make_nothing_late_are_no_answer():
    problem = problem_of(calm_log(9, seconds=20.0))
    without, _ = fitted_in(problem)
    assert answer_p(problem, without.extension, without, "viscous_drag") == 0.0


def test_a_calm_drive_without_a_lag_is_refused_and_not_named():
    selection = select(problem_of(calm_log(3)), Extension(BASE), GapOptions(modes="ideal"))
    assert not selection.found
    assert ANSWERED in [one.failed for stage in selection.stages for one in stage]
    assert "answers the disturbance" in answered_note(selection)


def gain_and_payload(log: Log) -> tuple[Problem, Fit, float]:
    """The problem, the fit of a drive gain, and by how much it is likelier than that of a payload."""
    problem = problem_of(log)
    gain, load = (
        fit_model(problem, Extension(BASE, {name: {RESPONSES[name]: start}}))
        for name, start in (("drive_gain", -0.1), ("payload", 0.1))
    )
    return problem, gain, load.deviance - gain.deviance


def test_what_an_answer_in_turning_makes_of_a_payload_is_no_gain():
    """A heavier robot, whose turning answers the disturbance alone, seems to turn more weakly, too."""
    ahead_by = []
    for seed in range(4):
        problem, gain, by = gain_and_payload(calm_log(seed, steps=False, gains=(0.7, 1.0)))
        ahead_by.append(by)
        assert beyond_answer(problem, gain, "drive_gain", "payload", by) < 10
    assert max(ahead_by) > 10


def test_a_gain_that_turns_show_is_no_payload():
    problem, gain, by = gain_and_payload(calm_log(1, steps=True, gains=(0.7, 0.7)))
    assert 10 < beyond_answer(problem, gain, "drive_gain", "payload", by) < by


@pytest.mark.parametrize("rival", ["load_step", "yaw_damping", "slip_interval"])
def test_an_answer_takes_nothing_from_other_rivals(rival):
    problem, gain, _ = gain_and_payload(calm_log(1, seconds=20.0))
    assert beyond_answer(problem, gain, "drive_gain", rival, 12.0) == 12.0
