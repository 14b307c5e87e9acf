"""Modes, slips, traction and dimensions from torques and wheel speeds together, on logs of a plant that slips
by friction and shares no code with the analysis.
"""

import json
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import wmr_replay as wr
from wmr_replay.identify.joint_bank.traction import Axis, Step, follow_traction
from wmr_replay.identify.wheel_bank.states import LN_SCALE
from wmr_schemas import PAPER_ROBOT
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log
from wmr_synth import synthesise
from wmr_synth.scenarios import SCENARIOS
from wmr_synth.wheel_speed.driving import lively
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import DRY

POOR = EncoderSensors(noise_xy_sd_m=0.05, noise_yaw_sd_rad=0.02)
RTK = EncoderSensors(noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
SLIPS = ["slipping", "skidding_slipping"]
LIVELY = SCENARIOS["encoders"]
STEADY = replace(LIVELY, plan=replace(LIVELY.plan, driver=lively(1.0, 0.6)))


@pytest.fixture(scope="module")
def simulated():
    """40 s of a drive with slips and some skids, torques in the messages of the wheel speeds."""
    return synthesise(STEADY, seed=3, duration_s=40, sensors=POOR, torques_as="together")


@pytest.fixture(scope="module")
def replayed(simulated):
    """Its replay."""
    return wr.replay(simulated.log)


def summary_of(log: Log, **options):
    return wr.replay(log, **options).summary.row(0, named=True)


def test_both_tell_as_much_as_wheels_and_more_than_torques(simulated, replayed):
    both = replayed.summary.row(0, named=True)
    assert json.loads(both["settings"])["told_by"] == "both"
    wheels = summary_of(simulated.log, evidence="wheel-speeds")
    torques = summary_of(simulated.log, evidence="torques")
    assert both["accuracy"] > 0.85
    assert both["accuracy"] > wheels["accuracy"] - 0.02
    assert both["accuracy"] > torques["accuracy"] + 0.2
    assert both["hindsight_accuracy"] > both["accuracy"]


def test_traction_and_dimensions_are_learnt_with_honest_deviations(simulated, replayed):
    row, robot = replayed.summary.row(0, named=True), simulated.facts["true_robot"]
    last = replayed.samples.collect().tail(1)
    alpha = simulated.facts["drivetrain"]["alpha"]
    assert abs(last["alpha"][0] - alpha) < 4 * last["alpha_sd"][0]
    assert last["alpha_sd"][0] < 0.05 * alpha
    true = {
        "wheel_scale": robot["wheel_radius_m"] / robot["stated_radius_m"],
        "effective_half_track_m": robot["half_track_m"],
    }
    for name, value in true.items():
        assert abs(row[name] - value) < 4 * row[f"{name}_sd"] + 0.003, name
    later = replayed.hindsight.collect()["alpha"].drop_nulls()
    assert later.median() == pytest.approx(alpha, rel=0.05)


def gripping(seed: int, ratio: float) -> Log:
    """A drive on dry ground whose stated wheel radius is ``ratio`` times the true one."""
    dry = replace(LIVELY, plan=replace(LIVELY.plan, floor=DRY, nominal_error=0.0))
    log = synthesise(dry, seed=seed, duration_s=30, sensors=RTK, torques_as="together").log
    assert log.robot.wheel_radius_m is not None
    return replace(log, robot=replace(log.robot, wheel_radius_m=log.robot.wheel_radius_m * ratio))


def test_a_radius_that_is_off_is_no_slipping():
    """It scales the wheels' speeds at all times, and leaves traction alone."""
    result = wr.replay(gripping(3, 1.1), hindsight=False)
    told = result.samples.collect().filter(pl.col("t_s") > 3)
    assert told["mode"].is_in(SLIPS).mean() < 0.01
    assert result.summary["wheel_scale"][0] == pytest.approx(1 / 1.1, abs=0.01)


def test_lost_traction_is_no_radius(simulated, replayed):
    """Slips of a third of a metre a second do not move the scale, at any time once it is known."""
    robot = simulated.facts["true_robot"]
    scale = robot["wheel_radius_m"] / robot["stated_radius_m"]
    told = replayed.samples.collect().filter(pl.col("t_s") > 15)
    slipping = told.filter(pl.col("mode_true").is_in(SLIPS))
    assert len(slipping) > 100
    assert (slipping["wheel_scale"] - scale).abs().max() < 0.03


def test_a_channel_of_their_own_serves_as_well(simulated, tmp_path):
    """Torques in one channel and wheel speeds in another, through a file."""
    path = tmp_path / "apart.mcap"
    made = wr.synthesise("encoders", path, seed=11, duration_s=20, noise="rtk", torques="apart")
    assert np.isnan(made.log.torque.left_radps).all()
    result = wr.run(path)
    row = result.summary.row(0, named=True)
    assert json.loads(row["settings"])["told_by"] == "both"
    assert row["accuracy"] > 0.85
    in_memory = wr.replay(made.log).samples.collect()
    assert in_memory["mode"].equals(result.samples.collect()["mode"])
    alone = wr.run(path, evidence="torques").samples.collect()
    assert alone["slip_left_mps"].count() == 0


def test_the_papers_robot_is_told_by_torques():
    """Its wheels do not run away where traction is lost."""
    log = synthesise("random", seed=5, duration_s=8).log
    assert log.robot == PAPER_ROBOT
    auto, torques = (wr.replay(log, **o).samples.collect() for o in ({}, {"evidence": "torques"}))
    assert auto.equals(torques)
    assert auto["slip_left_mps"].count() == 0


def test_what_a_log_lacks_is_said():
    log = synthesise("encoders", seed=4, duration_s=8, sensors=RTK).log
    result = wr.replay(log, evidence="both", hindsight=False)
    assert "without torques" in str(result.summary["notes"][0])
    assert result.samples.collect()["slip_left_mps"].count() > 0


def test_an_unknown_alpha_is_learnt(simulated):
    robot = RobotParameters(
        wheel_radius_m=simulated.log.robot.wheel_radius_m, half_track_m=simulated.log.robot.half_track_m
    )
    result = wr.replay(replace(simulated.log, robot=robot), hindsight=False)
    last = result.samples.collect().tail(1)
    assert last["alpha"][0] == pytest.approx(simulated.facts["drivetrain"]["alpha"], rel=0.1)
    assert result.summary["accuracy"][0] > 0.8


@pytest.fixture(scope="module")
def pieces(log_rows):
    """The rows of a log with torques and wheel speeds apart, and the table of the whole."""
    made = synthesise("skid-steer", seed=2, duration_s=12, sensors=RTK, torques_as="apart")
    rows = log_rows(made.log)
    return rows, rows.samples()


@settings(max_examples=6, deadline=None)
@given(data=st.data())
def test_batches_and_later_rows_change_no_bit(pieces, data):
    rows, whole = pieces
    assert whole["slip_left_mps"].count() > 500
    cuts = data.draw(st.lists(st.integers(1, rows.n - 1), max_size=12))
    assert whole.equals(rows.samples(cuts=cuts))
    stop = data.draw(st.integers(rows.n // 2, rows.n - 1))
    prefix = rows.samples(stop=stop)
    n = max(len(prefix) - 300, 0)
    assert prefix[:n].equals(whole[:n])


def test_the_line_of_traction_is_a_kalman_update_of_all_its_unknowns():
    """Beside the textbook: the new slip and the new error as states of their own, updated and moved on."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(20, 20)) * 0.1
    mean, covariance = rng.normal(size=20) * 0.1, root @ root.T
    at = Axis(3, 12, 14, 16, 18)
    by = Step(1.02, 0.03, 2.0, 0.7, 0.1, 0.05, 0.95, 4e-4, 0.0, 2e-4, 1e-5, 0.02)
    slope = np.zeros(22)
    effort = (1 + by.spinning) * by.effort
    pull = effort * mean[12] - by.resists * mean[14] + mean[16] + by.coupling
    slope[[3, 18, 12, 14, 16]] = (
        *(1 - by.left, by.scale),
        *(-by.dt * effort, by.dt * by.resists, -by.dt),
    )
    slope[20:] = -1.0, -by.scale
    slope[LN_SCALE] = by.dt * pull - (1 - by.left) * mean[3]
    off = by.scale * (1 + by.spinning) * by.change + by.scale * mean[18] - slope[LN_SCALE]
    full = np.zeros((22, 22))
    full[:20, :20], full[20, 20], full[21, 21] = covariance, by.fresh, by.error
    variance = slope @ full @ slope + by.line
    gain = full @ slope / variance
    states = np.concatenate([mean, [0.0, 0.0]]) - gain * off
    full -= np.outer(gain, slope @ full)
    move = np.eye(22)[:20]
    move[3, 3], move[3, 20], move[18, 18], move[18, 21] = by.left, 1.0, 0.0, 1.0
    likely = follow_traction(mean, covariance, at, by, np.zeros((2, 20)))
    np.testing.assert_allclose(mean, move @ states, atol=1e-12)
    np.testing.assert_allclose(covariance, move @ full @ move.T, atol=1e-12)
    assert likely == pytest.approx(-0.5 * (off**2 / variance + np.log(variance)))
