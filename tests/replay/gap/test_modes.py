"""Contact modes and missing effects together: modes replaced by others, the test against slipping, torques
as they act.
"""

import sys

import numpy as np
import pytest

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import analyse, base_model
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import identified_modes, lasting_effects, with_acting_torques
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.estimation.relabel import without_skid
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import BinnedLog, bin_log
from wmr_replay.gap.model.dynamics import N_STATE, V_LAT, Row, V, W, step
from wmr_replay.gap.model.extension import Extension, skid_speed
from wmr_replay.gap.search.slip_test import may_be_slipping
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack
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


@pytest.mark.parametrize("seed", [90_107, 90_120])
def test_skids_that_a_precise_pose_shows_are_kept(seed):
    """Two dozen seconds of skids by centimetres, with poses to a millimetre."""
    log, _ = hidden_log("patrol", seed=seed, noise="mocap")
    extension = Extension(base_of(log.robot))
    true, seen = (
        bin_log(log, SETTINGS, track) for track in (log.mode, likely_modes(log, extension, SETTINGS))
    )
    skids_s = true.step_s[true.skids].sum()
    assert skids_s > 20
    assert true.step_s[true.skids & seen.skids].sum() > 0.79 * skids_s


def test_on_a_calibration_log_false_slipping_is_taken_back(monkeypatch):
    """A log without slipping: 3 s of it where the torques change most while the robot rolls."""
    log, _ = hidden_log("patrol", seed=90_107, noise="mocap")
    extension, truth = Extension(base_of(log.robot)), bin_log(log, SETTINGS, log.mode)
    start_s = most_torque_s(truth, extension, 3.0)
    inside = (truth.t_s >= start_s) & (truth.t_s < start_s + 3.0)
    mode = np.where(inside, ContactMode.SLIPPING, truth.mode).astype(np.int8)
    stamps = log.pose.t_ns[0] + np.rint(truth.t_s * 1e9).astype(np.int64)
    false = ModeTrack(stamps, mode)
    monkeypatch.setattr(sys.modules[likely_modes.__module__], "identified_modes", lambda *_: false)
    kept, cleared = (
        bin_log(log, SETTINGS, likely_modes(log, extension, SETTINGS, nothing_missing=missing))
        for missing in (False, True)
    )
    assert not truth.slips.any()
    assert np.mean(kept.slips[inside]) > 0.9
    assert not cleared.slips.any()
    assert np.mean(cleared.skids[truth.skids]) > 0.8


def most_torque_s(binned: BinnedLog, extension: Extension, seconds: float) -> float:
    """When the torques change most within so many seconds of rolling."""
    effort, t_s = binned.torque.means(binned.t_s, extension.input_effects()).sum(axis=0), binned.t_s
    starts = np.arange(5.0, t_s[-1] - seconds, 0.5)
    windows = [(t_s >= start) & (t_s < start + seconds) for start in starts]
    change = [0.0 if binned.mode[w].any() else float(np.std(effort[w])) for w in windows]
    return float(starts[int(np.argmax(change))])


def test_a_skid_is_held_as_loosely_as_it_moves():
    """A circle at a constant speed: the model's own skid settles at the speed that is given to its ends."""
    n, v_mps, yaw_rate = 1000, 0.8, 0.4
    t_s = np.arange(n) * 0.01
    yaw = yaw_rate * t_s
    circle = PoseTrack(
        np.arange(n, dtype=np.int64) * 10_000_000,
        v_mps / yaw_rate * np.sin(yaw),
        v_mps / yaw_rate * (1 - np.cos(yaw)),
        yaw,
    )
    torque = TorqueTrack(circle.t_ns, *np.zeros((2, n)), *np.full((2, n), np.nan))
    modes = ModeTrack(
        np.array([0, 5_000_000_000]), np.array([ContactMode.IDEAL, ContactMode.SKIDDING], np.int8)
    )
    base = base_of(RobotParameters(alpha=0.3, alpha_yaw=0.3, half_track_m=0.25))
    binned = bin_log(Log(circle, torque, None, RobotParameters()), SETTINGS, modes, margin_s=SWITCH_S)
    row, z = Extension(base).rows(binned)[-1], np.zeros(N_STATE)
    assert row[Row.LOOSE] == 0
    row[[Row.LEFT, Row.RIGHT]] = 0.0
    for _ in range(200):
        z[V], z[W] = v_mps, yaw_rate * base.half_track_m
        step(z, row, Extension(base).theta(), base, z)
    loose = Extension(base).rows(binned)[:, Row.LOOSE]
    middle = np.argmax(binned.skids)
    assert skid_speed(binned, base)[middle] == pytest.approx(abs(z[V_LAT]), rel=0.1)
    assert loose[middle] == pytest.approx(abs(z[V_LAT]), rel=0.1)
    assert not loose[: middle // 2].any()


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
