"""Lags that are seen ahead or in turning alone. The oracle is a plain loop in which both channels lag, or
one.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.evidence.channels import (
    gains_by_channel,
    seen_in_one_channel,
    squares_beside,
    with_torques,
)
from wmr_replay.gap.evidence.excitation import excitation_ratios
from wmr_replay.gap.evidence.spread import interval_covariance, least_size
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import N_ROW, Base, Row
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.verdict import one_channel_note
from wmr_replay.gap.scan.misfit import is_rest
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.eliminate import left_of, may_be_a_rest, stronger
from wmr_replay.gap.search.fit_candidates import ONE_CHANNEL, assessed
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

ROBOT = RobotParameters(alpha=0.28, alpha_yaw=0.34, half_track_m=0.25)
BASE = Base(0.28, 0.34, 0.25, 8.0, 0.0, 0.5, 0.5, 0.0, 5.0)
PRECISE, RATE_PER_S, STEP_S, LAG_S = (0.001, 0.001, 0.002), 3.0, 0.01, 0.15
LEAST = GateSettings().channels.least_gain


def log_of(lags_s: tuple[float, float], steps: tuple[float, float] = (0.4, 0.1)) -> Log:
    """60 s of a loop of K = 3/s that follows speeds in ``steps``; ahead and in turning, torques lag."""
    rng, n, l = np.random.default_rng(4), round(60 / STEP_S), BASE.half_track_m
    t_s = np.arange(n) * STEP_S
    wanted = np.array([0.8, 0.05]) + np.sign(np.sin(1.5 * t_s))[:, None] * steps
    acting, z, shares = (
        np.zeros(2),
        np.array([0.0, 0.0, 0.0, *wanted[0]]),
        STEP_S / np.maximum(lags_s, STEP_S),
    )
    path, sent = np.zeros((n, 3)), np.zeros((n, 2))
    for k in range(n):
        path[k], asked = z[:3], RATE_PER_S * (wanted[k] - z[3:])
        sent[k] = asked / [BASE.alpha, BASE.alpha_yaw]
        acting += shares * (asked - acting)
        v, w = z[3:] + acting * STEP_S / 2
        yaw = z[2] + z[4] / l * STEP_S / 2
        z += STEP_S * np.array([v * np.cos(yaw), v * np.sin(yaw), w / l, *acting])
    t_ns = np.round(t_s * 1e9).astype(np.int64)
    pose = path + rng.normal(size=(n, 3)) * PRECISE
    torques = (sent @ np.array([[1.0, 1.0], [-1.0, 1.0]]) / 2).T.copy()
    return Log(
        PoseTrack(t_ns, *pose.T.copy()), TorqueTrack(t_ns, *torques, *np.full((2, n), np.nan)), None, ROBOT
    )


def with_lag(log: Log, misfit: dict[str, float] | None = None) -> tuple[Problem, Fit]:
    problem = Problem.of(bin_log(log, GateSettings())).all_fitted()
    lagging = Extension(BASE, {"actuator_lag": {"time_constant_s": 0.1}}, misfit=misfit or {})
    return problem, fit_model(problem, lagging)


def test_a_lag_of_the_torques_is_seen_ahead_and_in_turning():
    problem, fit = with_lag(log_of((LAG_S, LAG_S)))
    assert min(gains_by_channel(problem, fit, "actuator_lag")) > LEAST
    assert not seen_in_one_channel(problem, fit, "actuator_lag")


@pytest.mark.parametrize("lags_s", [(0.0, LAG_S), (LAG_S, 0.0)])
def test_a_lag_that_one_channel_excludes_is_none(lags_s):
    problem, fit = with_lag(log_of(lags_s))
    gains = gains_by_channel(problem, fit, "actuator_lag")
    assert gains[int(np.argmin(lags_s))] < -LEAST
    assert seen_in_one_channel(problem, fit, "actuator_lag")
    assert not seen_in_one_channel(problem, fit, "viscous_drag")


@pytest.mark.parametrize(("share", "refused"), [(0.03, False), (1.0, True)])
def test_where_turning_is_in_doubt_a_lag_must_be_shown_ahead(share, refused):
    problem, fit = with_lag(log_of((LAG_S, LAG_S), steps=(0.0, 0.1)), {"yaw_inertia": share})
    assert abs(gains_by_channel(problem, fit, "actuator_lag")[0]) < LEAST
    assert seen_in_one_channel(problem, fit, "actuator_lag") is refused


@pytest.mark.parametrize(("lags_s", "failed"), [((0.0, LAG_S), ONE_CHANNEL), ((LAG_S, LAG_S), "")])
def test_a_lag_of_one_channel_is_no_candidate_and_is_said(lags_s, failed):
    problem, fit = with_lag(log_of(lags_s, steps=(0.04, 0.2)))
    current = fit_model(problem, Extension(BASE))
    scored = ScoredCandidate("actuator_lag", {"time_constant_s": 0.1}, 100.0, 1)
    found = assessed(problem, current, scored, fit, 10)
    assert found.failed == failed
    assert (found.p_value == 1.0) is bool(failed)
    assert ("turn" in one_channel_note(Selection(current, current, (), ((found,),)))) is bool(failed)


def test_torques_are_mixed_by_their_sum_and_their_difference():
    ahead, turning = np.zeros((2, 1, N_ROW))
    ahead[0, [Row.LEFT, Row.RIGHT]], turning[0, [Row.LEFT, Row.RIGHT]] = (1.0, 2.0), (5.0, 9.0)
    mixed = with_torques(ahead, ahead, turning)
    assert tuple(mixed[0, [Row.LEFT, Row.RIGHT]]) == (-0.5, 3.5)


def test_what_other_effects_explain_is_no_gain():
    e, other = np.array([[3.0, 4.0, 0.0]]), np.array([[[1.0], [0.0], [0.0]]])
    assert squares_beside(other, e) == pytest.approx(16.0)
    assert squares_beside(other[:, :, :0], e) == pytest.approx(25.0)


def test_a_size_is_a_finding_from_where_its_interval_leaves_what_the_base_leaves():
    """What a calibration leaves of a yaw inertia, and twice what the log's own torques hide."""
    problem, fit = with_lag(log_of((LAG_S, LAG_S)))
    fit = fit_model(problem, fit.extension.with_effect("yaw_inertia", {"ratio": 0.05}), fit.noise)
    loud, share = replace(fit, noise=fit.noise._replace(yaw_sd_mps2=0.3)), 0.05
    hidden = 1 / excitation_ratios(problem, loud.extension, loud.noise)[1] ** 2
    least = share + 2 * hidden
    assert least > 3 * share
    at_least = replace(fit, extension=fit.extension.with_effect("yaw_inertia", {"ratio": least}))
    sd = (least - least_size(problem, at_least, "yaw_inertia", 2.0)) / 2
    assert sd > 0
    for in_sd, rest in ((1.7, True), (2.3, False)):
        seen = fit.extension.with_effect("yaw_inertia", {"ratio": least + in_sd * sd})
        known = replace(fit, extension=replace(seen, misfit={"yaw_inertia": share}))
        assert not is_rest("yaw_inertia", known.extension, problem.settings.misfit)
        assert may_be_a_rest(problem, known, loud, "yaw_inertia", beside=set()) is rest


def test_a_weight_put_on_meanwhile_is_as_open_as_a_payload():
    problem, fit = with_lag(log_of((LAG_S, LAG_S)))
    known = replace(fit.extension, misfit={"payload": 0.3})
    loaded = known.with_effect("load_step", {"mass_ratio": 0.5, "t0_s": 20.0})
    left = left_of("load_step", problem, loaded, fit)
    assert left == left_of("payload", problem, known.with_effect("payload", {"mass_ratio": 0.5}), fit)
    assert left >= 0.3
    assert left_of("load_step", problem, replace(loaded, misfit={}), fit) == 0


def test_how_a_pose_is_mounted_is_as_open_as_its_interval_says():
    problem, fit = with_lag(log_of((LAG_S, LAG_S)))
    fit = fit_model(problem, fit.extension.with_effect("pose_lever_arm", {"x_m": 0.1, "y_m": 0.0}), fit.noise)
    own = [j for j, (name, _) in enumerate(fit.keys) if name == "pose_lever_arm"]
    size = np.hypot(*fit.values[own])
    along = fit.values[own] / size
    V, _ = interval_covariance(problem, fit)
    open_to = 2 * np.sqrt(along @ V[np.ix_(own, own)] @ along)
    assert size - least_size(problem, fit, "pose_lever_arm", 2.0) == pytest.approx(open_to)
    assert open_to > 0


@pytest.mark.parametrize(("beside", "rest"), [({"viscous_drag"}, True), (set(), False)])
def test_an_effect_does_not_stand_beside_what_explains_less(beside, rest):
    """A yaw inertia of .1 is a rest up to .12 beside a drag that matters, and alone up to .064."""
    problem, fit = with_lag(log_of((LAG_S, LAG_S)))
    both = fit.extension.with_effect("viscous_drag", {"c1_per_s": 1.0})
    fit = fit_model(problem, both.with_effect("yaw_inertia", {"ratio": 0.05}), fit.noise)
    effects = {**fit.extension.effects, "viscous_drag": {"c1_per_s": 1.0}, "yaw_inertia": {"ratio": 0.1}}
    known = replace(fit.extension, effects=effects, misfit={"yaw_inertia": 0.001})
    assert is_rest("yaw_inertia", known.only({"yaw_inertia", *beside}), problem.settings.misfit) is rest
    gains = {"yaw_inertia": 50.0, "viscous_drag": 60.0 if beside else 40.0}
    found = [SimpleNamespace(name=name, gain=gain) for name, gain in gains.items()]
    assert stronger(found[0], found) == beside
    assert may_be_a_rest(problem, replace(fit, extension=known), fit, "yaw_inertia", beside=beside) is rest
