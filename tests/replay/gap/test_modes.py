"""Contact modes and missing effects together: modes replaced by others, the test against slipping, torques
as they act.
"""

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import analyse, base_model
from wmr_replay.gap.estimation.modes import identified_modes, lasting_effects, with_acting_torques
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.estimation.relabel import without_skid
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.slip_test import may_be_slipping
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack
from wmr_synth import hidden_log

GIVEN = GapOptions(modes="given")
SETTINGS = GateSettings()
SWITCH_S = 0.3


def problem_of(log: Log, *, margin_s: float = 0.04):
    """The log with its own labels, and its base model."""
    return Problem.of(bin_log(log, SETTINGS, log.mode, margin_s=margin_s)), base_model(
        log, None, GIVEN
    ).extension


def relabelled(log: Log, start_s: float, end_s: float, mode: int) -> Log:
    """The log with another mode between two times."""
    seconds = (log.mode.t_ns - log.pose.t_ns[0]) / 1e9
    inside = (seconds >= start_s) & (seconds < end_s)
    track = ModeTrack(log.mode.t_ns, np.where(inside, mode, log.mode.mode).astype(np.int8))
    return Log(log.pose, log.torque, track, log.robot)


def test_modes_without_skid_keep_slipping():
    track = ModeTrack(np.arange(4, dtype=np.int64), np.array([0, 1, 2, 3], np.int8))
    assert without_skid(track).mode.tolist() == [0, 0, 2, 2]


def test_a_loss_beside_the_path_may_be_anything():
    log, _ = hidden_log("patrol", seed=90_112, noise="rtk")
    problem, extension = problem_of(log, margin_s=SWITCH_S)
    place = {"x_m": 1e3, "y_m": 1e3, "radius_m": 0.5, "loss": 0.4}
    fit = fit_model(problem, extension)
    beside = evaluate(problem, extension.with_effect("low_friction_patch", place), fit.noise)
    assert may_be_slipping(problem, beside, "low_friction_patch")


def test_torques_act_less_where_traction_is_lost():
    log, _ = hidden_log("patrol", seed=90_107, noise="mocap")
    seconds = (log.torque.t_ns - log.pose.t_ns[0]) / 1e9
    inside, outside = (seconds > 31) & (seconds < 39), (seconds < 29) | (seconds > 41)
    extension = base_model(log, None, GIVEN).extension
    assert with_acting_torques(log, extension, SETTINGS) is log
    lost = extension.with_effect("slip_interval", {"start_s": 30.0, "end_s": 40.0, "loss": 0.4})
    acting = with_acting_torques(log, lost, SETTINGS).torque
    np.testing.assert_allclose(acting.left_nm[inside], 0.6 * log.torque.left_nm[inside], rtol=1e-6)
    np.testing.assert_allclose(acting.right_nm[outside], log.torque.right_nm[outside], rtol=1e-6, atol=1e-9)
    loaded = extension.with_effect("load_step", {"mass_ratio": 0.25, "t0_s": 20.0})
    acting = with_acting_torques(log, loaded, SETTINGS).torque
    late = seconds > 23
    total, difference = log.torque.left_nm + log.torque.right_nm, log.torque.right_nm - log.torque.left_nm
    np.testing.assert_allclose(
        (acting.left_nm + acting.right_nm)[late], total[late] / 1.25, rtol=1e-3, atol=1e-9
    )
    np.testing.assert_allclose(acting.right_nm - acting.left_nm, difference, atol=1e-9)


def test_torques_act_less_in_a_place():
    log, _ = hidden_log("patrol", seed=90_108, noise="mocap")
    binned = bin_log(log, SETTINGS)
    x, y = binned.pose[len(binned) // 2, :2]
    extension = base_model(log, None, GIVEN).extension
    place = {"x_m": float(x), "y_m": float(y), "radius_m": 1.0, "loss": 0.5}
    acting = with_acting_torques(log, extension.with_effect("low_friction_patch", place), SETTINGS).torque
    at = [np.interp(log.torque.t_ns, log.pose.t_ns, p) for p in (log.pose.x_m, log.pose.y_m)]
    distance = np.hypot(at[0] - x, at[1] - y)
    inside, outside = distance < 0.7, distance > 1.5
    assert inside.sum() > 20
    np.testing.assert_allclose(acting.left_nm[inside], 0.5 * log.torque.left_nm[inside], rtol=0.06)
    np.testing.assert_allclose(acting.left_nm[outside], log.torque.left_nm[outside], rtol=1e-3)


def test_a_slip_interval_that_the_identifier_calls_slipping_is_found():
    log, _ = hidden_log(
        "patrol", seed=90_109, hide=["slip_interval:start_s=28,end_s=37,loss=.45"], noise="rtk"
    )
    result = analyse(Log(log.pose, log.torque, None, log.robot))
    assert [effect.name for effect in result.effects] == ["slip_interval"]
    assert result.effects[0].parameters["loss"].value == pytest.approx(0.45, abs=0.12)


def test_the_identifier_knows_the_base_models_effects_and_the_new_ones():
    base = base_of(RobotParameters(alpha=0.5, half_track_m=0.3))
    known = {
        "viscous_drag": {"c1_per_s": 0.2},
        "torque_saturation": {"limit_nm": 3.0},
        "slip_interval": {"start_s": 1.0, "end_s": 2.0, "loss": 0.5},
    }
    extension = Extension(base, {"viscous_drag": {"c1_per_s": 0.1}}, 1.0, tuple(known.items()))
    extension = extension.with_effect("torque_saturation", {"limit_nm": 4.0})
    extension = extension.with_effect("payload", {"mass_ratio": 0.3})
    told = {effect.name: dict(effect.parameters) for effect in lasting_effects(extension)}
    assert told == {
        "viscous_drag": {"c1_per_s": pytest.approx(0.3)},
        "torque_saturation": {"limit_nm": 3.0},
        "payload": {"mass_ratio": 0.3},
    }


def test_modes_are_the_same_whether_an_effect_is_known_or_new():
    log, truth = hidden_log("patrol", seed=90_111, hide=["viscous_drag:c1_per_s=.3"], noise="rtk")
    base = base_model(log, None, GIVEN).extension
    (effect,) = truth["effects"]
    known = Extension(base.base, {}, base.wheel_radius_m, ((effect["name"], effect["parameters"]),))
    new = base.with_effect(effect["name"], effect["parameters"])
    modes = [identified_modes(log, extension, SETTINGS).mode for extension in (base, known, new)]
    np.testing.assert_array_equal(modes[1], modes[2])
    assert np.mean(modes[0] != modes[1]) > 0.02
