"""What declared forms leave open, found beside the size: the speed over which friction changes its sign, the
share of a threshold over which a dead zone or a limit of the torques sets in. The oracles are plain loops.
"""

import sys
from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, KEPT, ROBOT, SETTINGS

from wmr_replay.effects.motion import sign
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap.estimation.modes import lasting_effects
from wmr_replay.gap.estimation.own_form import Forms, forms_at, has_own_form, spread_of_forms, with_own_form
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model, gauss_newton
from wmr_replay.gap.estimation.sticking import SCRUB
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import N_ROW, N_STATE, Row, V, step
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.fit_candidates import fit_candidates
from wmr_replay.gap.search.select import base_fit
from wmr_schemas.model_file import Effect
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

C0_MPS2, D0_MPS2, CREEP_MPS, STEP_S, DISTURBANCE_MPS2 = 0.2, 0.06, 0.008, 0.002, 0.003
NAME = "rolling_resistance"


def creeping_log(over_mps: float, seconds: float = 40.0) -> Log:
    """A drive straight ahead that goes and creeps in turns, under the friction c₀ tanh(v/over), at 100 Hz."""
    rng, n = np.random.default_rng(3), round(seconds / STEP_S)
    wanted = np.where((np.arange(n) * STEP_S // 4) % 2 == 0, 0.4, CREEP_MPS)
    state, d, integral, torque, rows = np.zeros(2), 0.0, 0.0, 0.0, []
    for k in range(n):
        if k % 5 == 0:
            error = wanted[k] - state[1]
            integral += 4.0 * error * 5 * STEP_S
            torque = (4.0 * error + integral) / (2 * BASE.alpha)
            d = KEPT * d + DISTURBANCE_MPS2 * np.sqrt(1 - KEPT**2) * rng.normal()
            rows.append((*state, torque))
        acceleration = 2 * BASE.alpha * torque - C0_MPS2 * np.tanh(state[1] / over_mps) + d
        state += STEP_S * np.array([state[1] + acceleration * STEP_S / 2, acceleration])
    x, _, sent = np.array(rows).T
    t_ns = np.arange(len(x), dtype=np.int64) * 10_000_000
    pose = np.stack([x, 0 * x, 0 * x]) + rng.normal(size=(3, len(x))) * 0.001
    torques = TorqueTrack(t_ns, sent, sent, *np.full((2, len(x)), np.nan))
    return Log(PoseTrack(t_ns, *pose), torques, None, ROBOT)


@pytest.mark.parametrize(("over_mps", "own"), [(0.005, True), (0.02, False)])
def test_the_size_of_a_friction_comes_with_its_speed(over_mps, own):
    problem = Problem.of(bin_log(creeping_log(over_mps), SETTINGS)).all_fitted()
    usual = fit_model(problem, Extension(BASE, {NAME: {"c0_mps2": 0.1}}))
    fit = with_own_form(usual, NAME)
    assert has_own_form(fit, NAME) is own
    assert fit.extension.friction_speed_mps == (over_mps if own else 0.0)
    assert fit.values[0] == pytest.approx(C0_MPS2, rel=0.05)
    if own:
        assert abs(usual.values[0] - C0_MPS2) > 2 * abs(fit.values[0] - C0_MPS2)


def turning_log(over_mps: float, seconds: float = 60.0) -> Log:
    """Turns on the spot at .1, .5 and 1.5 rad/s, either way about, under the scrub d₀ tanh(l·w/over)."""
    rng, n, length = np.random.default_rng(5), round(seconds / STEP_S), BASE.half_track_m
    wanted = np.array([0.1, 1.5, -0.5, -0.1, 0.5, -1.5])[(np.arange(n) * STEP_S // 3).astype(int) % 6]
    state, d, rows = np.zeros(2), 0.0, []
    for k in range(n):
        if k % 5 == 0:
            moment = 4.0 * (wanted[k] - state[1]) * length / (2 * BASE.alpha_yaw)
            d = KEPT * d + DISTURBANCE_MPS2 * np.sqrt(1 - KEPT**2) * rng.normal()
            rows.append((*state, moment))
        braked = D0_MPS2 * np.tanh(length * state[1] / over_mps)
        turned = (2 * BASE.alpha_yaw * moment - braked + d) / length
        state += STEP_S * np.array([state[1] + turned * STEP_S / 2, turned])
    yaw, _, sent = np.array(rows).T
    t_ns = np.arange(len(yaw), dtype=np.int64) * 10_000_000
    pose = np.stack([0 * yaw, 0 * yaw, yaw]) + rng.normal(size=(3, len(yaw))) * 0.001
    torques = TorqueTrack(t_ns, -sent, sent, *np.full((2, len(yaw)), np.nan))
    return Log(PoseTrack(t_ns, *pose), torques, None, ROBOT)


@pytest.mark.parametrize("over_mps", [0.02, 0.08])
def test_a_scrub_that_winds_up_before_it_slides_is_no_yaw_damping(over_mps):
    problem = Problem.of(bin_log(turning_log(over_mps), SETTINGS)).all_fitted()
    fitted = fit_candidates(problem, base_fit(problem, Extension(BASE)), terms=False)
    scrub, damping = (next(one for one in fitted if one.name == name) for name in (SCRUB, "yaw_damping"))
    assert scrub.score - damping.score > 30
    over = scrub.fit.extension.friction_speed_mps or 0.02
    assert over == pytest.approx(over_mps, rel=0.2)
    assert scrub.fit.values[0] == pytest.approx(D0_MPS2, rel=0.05)


def test_other_frictions_take_no_such_speed():
    """Over 8 cm/s a rolling resistance is nearly a drag."""
    problem = Problem.of(bin_log(creeping_log(0.08), SETTINGS)).all_fitted()
    fit = with_own_form(fit_model(problem, Extension(BASE, {NAME: {"c0_mps2": 0.1}})), NAME)
    assert fit.extension.friction_speed_mps == 0.04


def test_the_speed_goes_into_the_model_and_comes_back_with_it():
    found = replace(Extension(BASE, {NAME: {"c0_mps2": 0.2}}), friction_speed_mps=0.005)
    effects = found.with_forms((Effect(NAME, {"c0_mps2": 0.2}), Effect("yaw_damping", {"d1_per_s": 0.1})))
    assert [effect.sign_change_mps for effect in effects] == [0.005, None]
    base = BaseModel(ROBOT, effects, "model file")
    assert base.extension.friction_speed_mps == base.extension.theta()[Theta.FRICTION_SPEED] == 0.005
    assert lasting_effects(base.extension)[0].sign_change_mps == 0.005


def stretched(x):
    """Zone of 0.06 N·m whose slope rises from 0 to 1 as a sine, from none to twice of it: another form than
    the one that is fitted.
    """
    ends = np.clip(np.abs(x) / 0.12, 0.0, 1.0)
    inside = 0.12 * (0.5 * ends - np.sin(np.pi * ends) / (2 * np.pi))
    return np.sign(x) * np.where(np.abs(x) > 0.12, np.abs(x) - 0.06, inside)


def sharp(x):
    return np.sign(x) * np.maximum(np.abs(x) - 0.06, 0.0)


def zoned_log(passed, seconds: float = 60.0) -> Log:
    """Straight ahead by torques that swell and turn, at .5 mm, behind a dead zone."""
    rng, n = np.random.default_rng(4), round(seconds / STEP_S)
    t_s = STEP_S * np.arange(n)
    sent_nm = 0.16 * np.sin(2 * np.pi * t_s / 3.1) * (0.2 + np.sin(np.pi * t_s / 17.0) ** 2)
    each_nm = np.repeat(sent_nm[::5], 5)[:n]  # held from one command to the next
    kept, d = np.exp(-STEP_S / 0.4), np.zeros(n)
    steps = rng.normal(size=n) * np.sqrt(1 - kept**2) * DISTURBANCE_MPS2 / 2
    for k in range(1, n):
        d[k] = kept * d[k - 1] + steps[k]
    x_m = np.cumsum(np.cumsum(2 * BASE.alpha * passed(each_nm) + d)) * STEP_S**2
    rows = slice(None, None, 5)
    t_ns = np.arange(len(x_m[rows]), dtype=np.int64) * 10_000_000
    pose = np.stack([x_m[rows], 0 * x_m[rows], 0 * x_m[rows]]) + 0.0005 * rng.normal(size=(3, len(t_ns)))
    torques = TorqueTrack(t_ns, each_nm[rows], each_nm[rows], *np.full((2, len(t_ns)), np.nan))
    return Log(PoseTrack(t_ns, *pose), torques, None, ROBOT)


@pytest.mark.parametrize(("passed", "own"), [(stretched, True), (sharp, False)])
def test_a_round_dead_zone_leaves_no_gain(passed, own):
    problem = Problem.of(bin_log(zoned_log(passed), SETTINGS)).all_fitted()
    usual = fit_model(problem, Extension(BASE, {"torque_deadzone": {"threshold_nm": 0.04}}))
    fit = with_own_form(usual, "torque_deadzone")
    assert has_own_form(fit, "torque_deadzone") is own
    assert fit.values[0] == pytest.approx(0.06, rel=0.06)

    def gained_by_a_gain(extension):
        without, beside = extension, extension.with_effect("drive_gain", {"ratio": 0.0})
        fits = [gauss_newton(problem, one, fit.noise, 6) for one in (without, beside)]
        return fits[0].deviance - fits[1].deviance

    assert (gained_by_a_gain(usual.extension) > 30) is own
    assert gained_by_a_gain(fit.extension) < 10


def rounded(x, share=0.075):
    """Zone of 0.06 N·m that sets in over ``share`` of it."""
    over = 0.06 * share
    return np.sign(x) * over * (np.logaddexp(0.0, (np.abs(x) - 0.06) / over) - np.logaddexp(0.0, -1 / share))


def test_a_corner_between_those_that_are_tried_is_found_and_told():
    problem = Problem.of(bin_log(zoned_log(rounded), SETTINGS)).all_fitted()
    usual = fit_model(problem, Extension(BASE, {"torque_deadzone": {"threshold_nm": 0.04}}))
    fit = with_own_form(usual, "torque_deadzone")
    assert fit.extension.corner_share == pytest.approx(0.075, abs=0.02)
    (stated,) = fit.extension.with_forms((Effect("torque_deadzone", {"threshold_nm": 0.06}),))
    assert type(stated.corner_share) is float  # as a file holds it
    nearest = gauss_newton(problem, fit.extension.in_form("corner_share", 0.1), fit.noise, 6)
    off = nearest.values[0] - fit.values[0]
    told, left = (float(np.sqrt(spread_of_forms(one)[0, 0])) for one in (nearest, fit))
    assert told > 0.7 * abs(off)
    assert left < 0.7 * told


def test_a_form_with_which_the_model_runs_away_is_none(monkeypatch):
    problem = Problem.of(bin_log(zoned_log(sharp), SETTINGS)).all_fitted()
    fit = fit_model(problem, Extension(BASE, {"torque_deadzone": {"threshold_nm": 0.06}}))
    lost = replace(fit, deviance=np.inf)
    monkeypatch.setattr(sys.modules[Forms.__module__], "gauss_newton", lambda *_, **__: lost)
    assert forms_at(fit, "corner_share", (0.1, 0.25), 1, fit.keys) == Forms(np.array([0.0]), (fit,))
    assert with_own_form(fit, "torque_deadzone") is fit
    np.testing.assert_array_equal(spread_of_forms(fit), 0.0)


def test_a_share_goes_into_the_model_and_comes_back_with_it():
    found = replace(Extension(BASE, {"torque_deadzone": {"threshold_nm": 0.1}}), corner_share=0.25)
    effects = found.with_forms(
        (Effect("torque_deadzone", {"threshold_nm": 0.1}), Effect("yaw_damping", {"d1_per_s": 0.1}))
    )
    assert [effect.corner_share for effect in effects] == [0.25, None]
    base = BaseModel(ROBOT, effects, "model file").extension
    assert base.corner_share == base.input_effects().corner_share == 0.25
    assert base.freedoms != replace(base, corner_share=0.0).freedoms
    assert lasting_effects(base)[0].corner_share == 0.25


def test_another_effect_keeps_its_fit():
    problem = Problem.of(bin_log(creeping_log(0.005), SETTINGS)).all_fitted()
    fit = fit_model(problem, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}))
    assert with_own_form(fit, "viscous_drag") is fit


@pytest.mark.parametrize("over_mps", [0.005, 0.02, 0.04])
def test_at_its_speed_friction_has_three_quarters_of_its_size(over_mps):
    assert sign(over_mps, over_mps) == pytest.approx(np.tanh(1.0))
    assert sign(-10 * over_mps, over_mps) == pytest.approx(-1.0)


@pytest.mark.parametrize(("place", "share"), [(Theta.ROLLING, 1.0), (Theta.WHEEL_COULOMB, 2 * BASE.alpha)])
@pytest.mark.parametrize("over_mps", [0.005, 0.02])
@pytest.mark.parametrize("pushed", [0.6, 1.4])
def test_a_step_of_a_bin_follows_friction_about_standstill(place, share, over_mps, pushed):
    """Torques that friction holds, and such as set the robot going; the oracle takes steps of .1 ms."""
    size, row, theta = 0.3, np.zeros(N_ROW), np.zeros(N_THETA)
    theta[place], theta[Theta.FRICTION_SPEED] = size / share, over_mps
    row[[Row.LEFT, Row.RIGHT]] = pushed * size / (2 * BASE.alpha)
    row[Row.DT] = 0.05
    z, moved, v = np.zeros(N_STATE), np.zeros(N_STATE), 0.0
    for _ in range(20):
        step(z, row, theta, BASE, moved)
        z[:] = moved
        for _ in range(500):
            v += 1e-4 * size * (pushed - np.tanh(v / over_mps))
        assert z[V] == pytest.approx(v, abs=0.2 * over_mps)
