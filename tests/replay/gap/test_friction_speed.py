"""The speed over which friction changes its sign, found beside its size. The oracle is a plain loop that
drives and creeps.
"""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.gap.plain_loop import BASE, KEPT, ROBOT, SETTINGS

from wmr_replay.effects.motion import sign
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap.estimation.friction_speed import has_own_speed, with_friction_speed
from wmr_replay.gap.estimation.modes import lasting_effects
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dynamics import N_ROW, N_STATE, Row, V, step
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.model_file import Effect
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

C0_MPS2, CREEP_MPS, STEP_S, DISTURBANCE_MPS2 = 0.2, 0.008, 0.002, 0.003
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
    fit = with_friction_speed(usual, NAME)
    assert has_own_speed(fit, NAME) is own
    assert fit.extension.friction_speed_mps == (over_mps if own else 0.0)
    assert fit.values[0] == pytest.approx(C0_MPS2, rel=0.05)
    if own:
        assert abs(usual.values[0] - C0_MPS2) > 2 * abs(fit.values[0] - C0_MPS2)


def test_the_speed_goes_into_the_model_and_comes_back_with_it():
    found = replace(Extension(BASE, {NAME: {"c0_mps2": 0.2}}), friction_speed_mps=0.005)
    effects = found.with_friction_speed(
        (Effect(NAME, {"c0_mps2": 0.2}), Effect("yaw_damping", {"d1_per_s": 0.1}))
    )
    assert [effect.sign_change_mps for effect in effects] == [0.005, None]
    base = BaseModel(ROBOT, effects, "model file")
    assert base.extension.friction_speed_mps == base.extension.theta()[Theta.FRICTION_SPEED] == 0.005
    assert lasting_effects(base.extension)[0].sign_change_mps == 0.005


def test_another_effect_keeps_its_fit():
    problem = Problem.of(bin_log(creeping_log(0.005), SETTINGS)).all_fitted()
    fit = fit_model(problem, Extension(BASE, {"viscous_drag": {"c1_per_s": 0.1}}))
    assert with_friction_speed(fit, "viscous_drag") is fit


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
