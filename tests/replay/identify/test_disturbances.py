"""Coloured disturbances in the filter bank: their formulas, and what they must not be taken for."""

import importlib.util
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wmr_replay.identify.filter_bank.predict import let_disturbances_fade
from wmr_replay.identify.filter_bank.states import AHEAD, AROUND, N_STATES
from wmr_replay.identify.filter_bank.steps import rest, told
from wmr_replay.jobs.replay import MemorySource, Replay
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack

TIME_S = 1.0
"""Correlation time of the bank's disturbances."""
COMPENSATED_SD = 3.0
"""A demand of so many standard deviations of the disturbance counts half."""


def covariance_of(seed):
    root = np.random.default_rng(seed).normal(size=(N_STATES, N_STATES))
    return root @ root.T


@given(st.floats(1e-4, 0.3), st.floats(0.05, 0.5), st.floats(1e-3, 5.0), st.integers(0, 9))
def test_disturbances_fade_as_an_ornstein_uhlenbeck_process(sd, half_track_m, dt, seed):
    """Mean m e^(−dt/τ); P ← D P Dᵀ + Q with D = diag(1, …, e^(−dt/τ), …), Q = σ² (1 − e^(−2 dt/τ))."""
    mean, covariance = np.arange(1.0, N_STATES + 1.0), covariance_of(seed)
    fading, fresh = np.ones(N_STATES), np.zeros(N_STATES)
    fading[[AHEAD, AROUND]] = math.exp(-dt / TIME_S)
    fresh[AHEAD] = sd**2 * -math.expm1(-2 * dt / TIME_S)
    fresh[AROUND] = fresh[AHEAD] / half_track_m**2
    expected = np.diag(fading) @ covariance @ np.diag(fading) + np.diag(fresh)
    expected_mean = fading * mean
    let_disturbances_fade(mean, covariance, sd**2, 1 / half_track_m**2, dt)
    np.testing.assert_allclose(mean, expected_mean, rtol=1e-12)
    np.testing.assert_allclose(covariance, expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("dt", [0.001, 0.02, 0.7])
def test_a_disturbance_that_is_not_seen_keeps_its_variance(dt):
    """Whatever the steps: σ² ahead, σ²/l² around, and independence of everything else."""
    mean, covariance = np.zeros(N_STATES), np.eye(N_STATES)
    covariance[AHEAD, AROUND] = covariance[AROUND, AHEAD] = 0.3
    for _ in range(math.ceil(30.0 / dt)):
        let_disturbances_fade(mean, covariance, 0.03**2, 1 / 0.4**2, dt)
    assert covariance[AHEAD, AHEAD] == pytest.approx(0.03**2, rel=1e-6)
    assert covariance[AROUND, AROUND] == pytest.approx((0.03 / 0.4) ** 2, rel=1e-6)
    assert covariance[AHEAD, AROUND] == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-100, 100), st.floats(1e-3, 1.0), st.floats(1e-3, 0.3))
def test_efforts_count_by_how_far_their_demand_is_beyond_the_disturbance(effort, gain, sd):
    demand, least = abs(effort) * gain, COMPENSATED_SD * sd
    share = demand**4 / (demand**4 + least**4)
    assert told(effort, gain, sd**2) == pytest.approx(effort * share, rel=1e-9, abs=1e-300)


def test_an_effort_well_beyond_the_disturbance_counts_in_full_and_one_below_hardly():
    assert told(10.0, 0.1, 0.01**2) == pytest.approx(10.0, rel=1e-5)
    assert told(-10.0, 0.1, 0.01**2) == pytest.approx(-10.0, rel=1e-5)
    assert told(0.1, 0.1, 0.01**2) == pytest.approx(0.1 / 82, rel=1e-6)
    assert told(0.3, 0.1, 0.01**2) == pytest.approx(0.15)
    assert told(0.0, 0.1, 0.01**2) == 0.0


@given(st.floats(-100, 100), st.floats(1e-3, 1.0), st.floats(1e-3, 0.3))
def test_what_an_effort_does_not_tell_accelerates_all_the_same(effort, gain, sd):
    counted = told(effort, gain, sd**2)
    assert gain * counted + rest(effort, counted, gain) == pytest.approx(gain * effort, rel=1e-9, abs=1e-12)
    assert rest(math.nan, 0.0, gain) == 0.0


@pytest.fixture(scope="module")
def slips():
    """``slips(family)``: shares of truly ideal rows that are told to slip, (seeds, 2): causal, in hindsight.

    Nothing but rolling under closed loop, with a disturbance of .015 m/s²; motion capture at 100 Hz.
    """
    bench = Path(__file__).parents[3] / "bench" / "quality_logs.py"
    spec = importlib.util.spec_from_file_location("quality_logs", bench)
    logs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(logs)
    ideal = ModeTrack(np.zeros(1, np.int64), np.zeros(1, np.int8))

    def share(log):
        replay = Replay(MemorySource(log, "log"), Engine(Settings(), ReplayModel(log.robot)))
        tables = [pl.concat(replay.samples()), pl.concat(replay.hindsight())]
        judged = [table.filter(pl.col("status") != "warming_up") for table in tables]
        assert all((table["mode_true"] == ContactMode.IDEAL).all() for table in judged)
        return [(table["mode"] == ContactMode.SLIPPING).mean() for table in judged]

    def shares(family):
        draw = logs.FAMILIES[family]
        logs.FAMILIES[family] = lambda duration_s, rng: replace(draw(duration_s, rng), modes=ideal)
        made = [logs.clean_log(family, seed, noise="mocap", rate_hz=100.0) for seed in range(5)]
        logs.FAMILIES[family] = draw
        return np.array([share(log) for log in made])

    return shares


def test_straight_runs_at_constant_speed_are_no_slips(slips):
    """A bank without disturbances told 59 to 83 % of each of these logs to slip."""
    assert (slips("straight") < 0.2).all()


def test_steering_in_square_waves_at_constant_speed_is_mostly_no_slip(slips):
    """A bank without disturbances told 54 % of these logs to slip. Single logs stay at .43, causally."""
    causal, hindsight = slips("square-wave").mean(axis=0)
    assert causal < 0.25
    assert hindsight < 0.15


def test_at_three_times_the_disturbance_that_counts_an_effort_lacks_a_hundredth():
    """What is left out biases the traction by as much: with the second power it was a tenth."""
    assert told(1.0, 9 * 0.01, 0.01**2) == pytest.approx(81 / 82)
