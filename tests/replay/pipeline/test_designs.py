"""The engine's default kernel: the rule's, until a better one is tuned on a stretch with motion."""

import json
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from wmr_replay.differentiate import KernelSpec, uniform_taps
from wmr_replay.differentiate.backends import in_blocks
from wmr_replay.differentiate.joint import JointErrorModel, tune_jointly
from wmr_replay.jobs.run import run_log
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.errors import InvalidSetting
from wmr_synth import SCENARIOS, Sensors, record, synthesise

SENSORS = Sensors(rate_hz=100.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.01)
RULE = Settings(tune=False)
STATE = ("v_long_mps", "yaw_rate_radps", "a_long_mps2")
STEP_S, SIGMA = 0.01, np.array([0.01, 0.01, 0.01])
OLD = (KernelSpec(2), 0.6)


def simulate(scenario="random", seed=3, duration_s=40.0, sensors=SENSORS):
    return synthesise(scenario, seed=seed, duration_s=duration_s, sensors=sensors)


def replayed(log_rows, log, settings=None):
    """Samples and what was decided."""
    rows = log_rows(log)
    engine = Engine(settings or Settings(), ReplayModel(rows.robot))
    engine.push(rows.batch(0, rows.n))
    engine.finish()
    return rows.samples(settings), engine.tuning


def at_rest_first(log, rest_s):
    """The same log behind ``rest_s`` of standing still."""
    rng = np.random.default_rng(0)
    n, step_ns = round(rest_s * SENSORS.rate_hz), round(1e9 / SENSORS.rate_hz)
    pose = log.pose
    before = [
        values[0] + 0.01 * rng.standard_normal(n) for values in (pose.x_m, pose.y_m, np.unwrap(pose.yaw_rad))
    ]
    t_ns = pose.t_ns[0] - step_ns * np.arange(n, 0, -1)
    joined = [
        np.concatenate([a, b])
        for a, b in zip(before, (pose.x_m, pose.y_m, np.unwrap(pose.yaw_rad)), strict=True)
    ]
    return replace(log, pose=type(pose)(np.concatenate([t_ns, pose.t_ns]), *joined))


def wiggle(n=800, seed=0):
    """Three noisy signals with motion, (3, n)."""
    t_s = np.arange(n) * STEP_S
    clean = np.stack([np.sin(0.9 * t_s), np.cos(0.7 * t_s), 0.5 * np.sin(1.3 * t_s)])
    return clean + SIGMA[:, None] * np.random.default_rng(seed).standard_normal((3, n))


def test_rows_before_the_tuned_design_are_those_of_the_rule_and_rows_after_it_are_not(log_rows):
    log = simulate().log
    tuned, decided = replayed(log_rows, log)
    rule, by_rule = replayed(log_rows, log, RULE)
    assert (decided.design, by_rule.design) == ("tuned", "rule")
    assert decided.design_since_s == pytest.approx(8.0, abs=1e-6)
    before = pl.col("t_s") < decided.design_since_s
    assert tuned.filter(before).select(STATE).equals(rule.filter(before).select(STATE))
    after = pl.col("t_s") > decided.design_since_s + 1
    assert not tuned.filter(after).select(STATE).equals(rule.filter(after).select(STATE))


def test_the_change_of_design_leaves_no_hole_and_no_other_delay(log_rows):
    samples, decided = replayed(log_rows, simulate().log)
    delays = samples.filter(pl.col("t_s") > 2)["delay_s"]
    assert decided.design == "tuned"
    assert delays.null_count() == 0
    assert delays.max() - delays.min() < 1e-9


@pytest.mark.parametrize("scenario", ["random", "figure-eight"])
def test_tuned_estimates_are_nearer_to_the_truth_than_the_rules(log_rows, scenario):
    simulated = simulate(scenario, seed=6, duration_s=60.0)
    errors = []
    for settings in (Settings(), RULE):
        samples, _ = replayed(log_rows, simulated.log, settings)
        late = samples.filter(pl.col("t_s") > 10)
        at = late["t_ns"].to_numpy() - late["delay_s"].to_numpy() * 1e9
        truth_ns = simulated.log.pose.t_ns
        errors.append(
            [
                np.std(late[name].to_numpy() - np.interp(at, truth_ns, getattr(simulated.truth, name)))
                for name in ("v_long_mps", "yaw_rate_radps")
            ]
        )
    assert np.all(np.array(errors[0]) < 0.97 * np.array(errors[1]))


def test_a_robot_at_rest_keeps_the_rules_design_until_a_stretch_in_which_it_moves(log_rows):
    log = at_rest_first(simulate().log, 20.0)
    _, decided = replayed(log_rows, log)
    # stretches of 8 s: two lie within the 20 s at rest, the third holds 4 s of motion, the next nothing else
    assert decided.design == "tuned"
    assert min(abs(decided.design_since_s - since_s) for since_s in (24.0, 32.0, 40.0)) < 0.1
    still = at_rest_first(simulate(duration_s=1.0).log, 30.0)
    assert replayed(log_rows, still)[1].design == "rule"


def test_a_log_shorter_than_the_stretch_keeps_the_rules_design(log_rows):
    log = simulate(duration_s=7.0).log
    samples, decided = replayed(log_rows, log)
    rule, _ = replayed(log_rows, log, RULE)
    assert decided.design == "rule"
    assert "8 s" in decided.design_reason
    assert samples.select(STATE).equals(rule.select(STATE))


def test_what_was_given_is_not_tuned(log_rows):
    for given in ({"window_s": 0.5}, {"degree": 3}, {"theta": 0.2}, {"tune": False}):
        assert replayed(log_rows, simulate(duration_s=20.0).log, Settings(**given))[1].design != "tuned"


@pytest.mark.parametrize("max_delay_s", [0.03, 0.15, 0.6])
def test_no_design_is_later_than_allowed(log_rows, max_delay_s):
    samples, decided = replayed(log_rows, simulate().log, Settings(max_delay_s=max_delay_s))
    assert decided.delay_s <= max_delay_s + 1e-9
    assert samples["delay_s"].max() <= max_delay_s + 1e-9


def test_contradicting_settings_are_refused():
    with pytest.raises(InvalidSetting, match="leave out the window or the delay"):
        Settings(window_s=0.5, max_delay_s=0.2)
    with pytest.raises(InvalidSetting, match="above 0 s"):
        Settings(max_delay_s=0.0)


def test_the_chosen_design_and_why_stand_in_the_summary(tmp_path):
    log = tmp_path / "log.mcap"
    record(synthesise(SCENARIOS["random"], seed=1, duration_s=15.0, sensors=SENSORS), log)
    row = run_log(log, tmp_path / "out", timeline=False).summary
    tuning = json.loads(row["settings"])["tuning"]
    assert tuning["design"] == "tuned"
    assert tuning["design_reason"].startswith("tuned on 0 to 8 s")
    assert tuning["window_s"] * (1 - tuning["theta"]) / 2 == pytest.approx(tuning["delay_s"])
    assert 0 < tuning["error_ratio"] <= 0.95


@pytest.mark.parametrize("seed", range(3))
def test_no_choice_is_worse_in_any_derivative_and_all_are_on_the_fast_road(seed):
    found = tune_jointly(wiggle(seed=seed), SIGMA, 0.3, step_s=STEP_S, old=OLD)
    assert found is not None
    assert found.ratio <= found.worst_ratio <= 1.0
    assert found.spec.delay_s(found.window_s) <= 0.3 + 1e-9
    assert in_blocks(found.spec)


def test_expected_errors_are_noise_bias_and_steps_as_worked_out_by_hand():
    """A noise-free straight line has no bias: what is left are Σ h² and the error on tⁿ/n!, t ≥ 0."""
    t_s = np.arange(400) * STEP_S
    line = np.stack([t_s, 2 * t_s, -t_s])
    model = JointErrorModel(line, SIGMA, STEP_S, OLD)
    new = KernelSpec(3, 0, 1, 0.5)
    ratios = []
    for order in (1, 2):
        squares = []
        for spec, n_taps in ((OLD[0], 61), (new, 121)):
            taps = uniform_taps(spec, n_taps, STEP_S)[order]
            age_s = np.arange(n_taps) * STEP_S
            answers = [taps @ (np.maximum(now - age_s, 0.0) ** order / (1, 1, 2)[order]) for now in age_s]
            errors = np.array(answers) - (age_s >= 0.3 - 1e-9)
            squares.append((SIGMA[0] ** 2 * np.sum(taps**2), np.sum(errors**2)))
        (noise, blur), (new_noise, new_blur) = squares
        ratios.append((new_noise + noise * new_blur / blur) / (2 * noise))
    assert model.rate(new, 121).ratio == pytest.approx(np.sqrt(np.mean(ratios)), rel=0.02)


def test_a_stretch_too_short_says_so():
    with pytest.raises(InvalidSetting, match="23 samples are too few"):
        tune_jointly(np.zeros((3, 23)), SIGMA, 0.1, step_s=STEP_S, old=OLD)
