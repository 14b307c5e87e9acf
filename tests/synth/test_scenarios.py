"""Scenarios, sensors and random streams."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_schemas import RobotParameters
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.errors import InvalidSetting
from wmr_synth import SCENARIOS, Sensors, synthesise, truth_frame
from wmr_synth.scenarios import random_phases
from wmr_synth.sensors import STREAMS, sampling_instants, stream
from wmr_synth.synthesis import START_NS

QUIET = Sensors().without_noise()


def at_100_hz(name: str, **changes: float) -> Sensors:
    return replace(SCENARIOS[name].sensors, rate_hz=100.0, **changes)


def test_paper_acceleration_goes_through_the_papers_six_conditions_of_ten_seconds():
    log = synthesise("paper-acceleration", sensors=at_100_hz("paper-acceleration")).log
    assert log.mode is not None
    assert log.mode.mode.tolist() == [0, 1, 2, 1, 0, 2]
    assert ((log.mode.t_ns - START_NS) / NS_PER_S).tolist() == [0, 10, 20, 30, 40, 50]


def test_paper_acceleration_accelerates_along_the_heading_only():
    truth = synthesise("paper-acceleration", sensors=at_100_hz("paper-acceleration")).truth
    assert truth.a_long_mps2[0] == pytest.approx(0.51, abs=0.001)
    assert truth.yaw_rate_radps == pytest.approx(0.3, abs=1e-9)
    assert np.all(np.diff(truth.v_long_mps) > -1e-9)


@pytest.mark.parametrize("name", ["paper-acceleration", "paper-alpha-ideal"])
def test_paper_scenarios_carry_noise_of_variance_a_tenth_at_one_kilohertz(name):
    simulated = synthesise(name, seed=3, duration_s=10)
    pose, truth = simulated.log.pose, simulated.truth
    assert len(pose) == 10_001
    for column in ("x_m", "y_m", "yaw_rad"):
        assert np.var(getattr(pose, column) - getattr(truth, column)) == pytest.approx(0.1, rel=0.1)


def test_uniform_scenario_has_no_torque_so_that_ideal_and_slipping_move_alike():
    truth = synthesise("paper-uniform", sensors=at_100_hz("paper-uniform")).truth
    assert np.all(truth.effort_left_nm == 0)
    not_skidding = np.isin(truth.mode, (0, 2))
    assert np.abs(truth.a_long_mps2[not_skidding]).max() < 1e-9


def test_deceleration_brakes_throughout_without_coming_to_rest():
    truth = synthesise("paper-deceleration", sensors=at_100_hz("paper-deceleration")).truth
    assert np.all(truth.effort_left_nm < 0)
    assert truth.v_long_mps.min() > 0.3
    assert truth.v_long_mps[-1] < truth.v_long_mps[0] / 4


def test_longer_paper_runs_keep_the_speeds_of_a_minute():
    short, long = (
        synthesise("paper-alpha-ideal", duration_s=d, sensors=at_100_hz("paper-alpha-ideal")).truth
        for d in (60, 240)
    )
    assert long.v_long_mps[-1] == pytest.approx(short.v_long_mps[-1], rel=1e-6)


def test_figure_eight_turns_both_ways_and_stays_in_place():
    truth = synthesise("figure-eight", sensors=QUIET).truth
    assert truth.yaw_rate_radps.max() > 0.4
    assert truth.yaw_rate_radps.min() < -0.4
    assert np.hypot(truth.x_m, truth.y_m).max() < 20


def test_stop_and_go_reverses_and_stops():
    truth = synthesise("stop-and-go", sensors=QUIET).truth
    assert truth.v_long_mps.max() > 1.5
    assert truth.v_long_mps.min() < -1.0
    assert np.mean(np.abs(truth.v_long_mps) < 0.05) > 0.03


@given(seed=st.integers(0, 2**32), duration_s=st.floats(0.5, 500))
def test_random_phases_last_two_to_ten_seconds_and_always_switch(seed, duration_s):
    modes = random_phases(duration_s, np.random.default_rng(seed))
    lengths_s = np.diff(modes.t_ns) / NS_PER_S
    assert modes.t_ns[0] == 0
    assert np.all((lengths_s >= 2 - 1e-9) & (lengths_s <= 10 + 1e-9))
    assert np.all(np.diff(modes.mode) != 0)
    assert set(modes.mode.tolist()) <= {0, 1, 2}


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_runs_from_a_second_to_minutes(name):
    for duration_s in (1.0, 200.0):
        simulated = synthesise(
            name, duration_s=duration_s, sensors=replace(SCENARIOS[name].sensors, rate_hz=20.0)
        )
        assert len(simulated.log.pose) == duration_s * 20 + 1
        assert np.abs(simulated.truth.v_long_mps).max() < 50


def test_one_seed_gives_one_log_and_another_seed_another():
    first, again, other = (synthesise("random", seed=seed, duration_s=20) for seed in (5, 5, 6))
    assert np.array_equal(first.log.pose.x_m, again.log.pose.x_m)
    assert not np.array_equal(first.truth.v_long_mps, other.truth.v_long_mps)


@pytest.mark.parametrize(
    "change",
    [
        {"noise_yaw_sd_rad": 0.5},
        {"noise_effort_sd_nm": 2.0},
        {"noise_wheel_speed_sd_radps": 0.1},
        {"dropout": 0.3},
        {"clock_offset_s": 0.25},
    ],
    ids=lambda change: next(iter(change)),
)
def test_changing_one_sensor_option_leaves_the_other_draws_alone(change):
    sensors = Sensors(dropout=0.1)
    plain = synthesise("random", seed=2, duration_s=10, sensors=sensors).log.pose
    changed = synthesise("random", seed=2, duration_s=10, sensors=replace(sensors, **change)).log.pose
    common, rows, rows_changed = np.intersect1d(plain.t_ns, changed.t_ns, return_indices=True)
    assert len(common) > 500
    assert np.array_equal(plain.x_m[rows], changed.x_m[rows_changed])


def test_streams_are_distinct():
    assert len({stream(0, name).integers(2**62) for name in STREAMS}) == len(STREAMS)


@settings(max_examples=50)
@given(jitter_s=st.floats(0, 1), rate_hz=st.floats(1, 1e4), seed=st.integers(0, 1000))
def test_jittered_instants_stay_in_order_and_start_at_zero(jitter_s, rate_hz, seed):
    t_ns = sampling_instants(100 / rate_hz, rate_hz, jitter_s, np.random.default_rng(seed))
    assert t_ns[0] == 0
    assert np.all(np.diff(t_ns) > 0)
    assert len(t_ns) in (100, 101)


def test_jittered_samples_are_taken_where_they_are_stamped():
    sensors = replace(QUIET, jitter_s=0.002)
    log = synthesise("paper-alpha-ideal", duration_s=5, sensors=sensors).log
    t_s = (log.pose.t_ns - START_NS) / NS_PER_S
    assert np.std(np.diff(t_s)) > 0.002
    assert log.pose.yaw_rad == pytest.approx(0.3 * t_s, abs=1e-9)


def test_dropout_loses_the_share_that_was_asked_for():
    log = synthesise("random", duration_s=60, sensors=replace(QUIET, dropout=0.2)).log
    assert log.torque is not None
    assert len(log.pose) == pytest.approx(0.8 * 6001, rel=0.05)
    assert len(log.torque) == pytest.approx(0.8 * 6001, rel=0.05)


def test_clock_offset_moves_the_torque_stamps_only():
    plain, late = (
        synthesise("random", duration_s=5, sensors=replace(QUIET, clock_offset_s=offset)).log
        for offset in (0, 0.125)
    )
    assert plain.torque is not None
    assert late.torque is not None
    assert np.all(late.torque.t_ns - plain.torque.t_ns == 125_000_000)
    assert np.array_equal(late.pose.t_ns, plain.pose.t_ns)
    assert np.array_equal(late.pose.x_m, plain.pose.x_m)


def test_truth_stands_at_the_logged_pose_stamps_and_agrees_with_a_noise_free_log():
    simulated = synthesise("stop-and-go", sensors=replace(QUIET, dropout=0.1))
    frame = truth_frame(simulated)
    assert frame["t_ns"].to_list() == simulated.log.pose.t_ns.tolist()
    assert np.array_equal(frame["x_m"], simulated.log.pose.x_m)
    assert frame["mode"].unique().sort().to_list() == [0, 1, 2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "paper-accelaration"}, "did you mean paper-acceleration"),
        ({"duration_s": 0.0}, "duration"),
        ({"duration_s": float("inf")}, "duration"),
        ({"duration_s": 1e9}, "lower the rates"),
        ({"seed": -1}, "seed"),
        ({"robot": RobotParameters(alpha=0.1)}, "half_track_m"),
    ],
    ids=["scenario", "zero", "infinite", "huge", "seed", "robot"],
)
def test_senseless_requests_are_refused_with_what_is_wrong(arguments, message):
    with pytest.raises(InvalidSetting, match=message):
        synthesise(**{"scenario": "random", **arguments})


@pytest.mark.parametrize("field", ["rate_hz", "noise_xy_sd_m", "jitter_s", "dropout"])
def test_sensors_refuse_negative_numbers(field):
    with pytest.raises(InvalidSetting, match=field):
        Sensors(**{field: -1.0})
