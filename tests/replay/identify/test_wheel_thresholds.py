"""The paper's thresholds by wheel speeds: skids and slips as they are measured, and nothing of α."""

import numpy as np
import pytest

import wmr_replay as wr
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_synth import synthesise
from wmr_synth.wheel_speed.encoders import EncoderSensors

MOCAP = EncoderSensors(noise_xy_sd_m=0.001, noise_yaw_sd_rad=0.002)
PARAMETER = {"icr_offset": "offset_m", "lateral_slip": "seconds"}


@pytest.fixture(scope="module", params=["encoders", "skid-steer"])
def simulated(request):
    """40 s with skids and slips."""
    return synthesise(request.param, seed=11, duration_s=40, sensors=MOCAP)


def calibrated(simulated) -> Model:
    """The robot's true dimensions, as a model holds them."""
    true = {name: next(iter(size.values())) for name, size in simulated.facts["calibration"].items()}
    effects = tuple(
        Effect(name, {PARAMETER.get(name, "ratio"): size}, {PARAMETER.get(name, "ratio"): 0.002})
        for name, size in true.items()
    )
    return Model(RobotParameters(), effects=effects)


def test_a_calibrated_robot_is_told_in_all_modes(simulated):
    row = wr.replay(simulated.log, identifier="paper", model=calibrated(simulated)).summary.row(0, named=True)
    assert row["accuracy"] > 0.85
    assert row["hindsight_accuracy"] > 0.95
    assert row["alpha"] is None
    assert row["share_skidding_slipping"] > 0.05


def test_stated_dimensions_claim_little_and_that_rightly(simulated):
    result = wr.replay(simulated.log, identifier="paper")
    row = result.summary.row(0, named=True)
    assert row["accuracy_decided"] > 0.8
    assert row["decided_share"] < 0.6
    assert "--model" in row["notes"]
    assert result.samples.collect()["alpha"].null_count() == len(result.samples.collect())


def test_slip_velocities_hold_the_true_ones(simulated):
    result = wr.replay(simulated.log, identifier="paper", model=calibrated(simulated))
    samples, truth = result.samples.collect(), simulated.truth
    instants = samples["t_ns"].to_numpy() - simulated.log.pose.t_ns[0]
    at = np.searchsorted(truth.t_ns[:-1], instants - np.nan_to_num(samples["delay_s"].to_numpy()) * 1e9)
    true = 1.5 * (truth.sigma_sum_mps + truth.sigma_diff_mps)[at]
    told, sd = (samples[name].to_numpy() for name in ("slip_right_mps", "slip_right_mps_sd"))
    known = np.isfinite(told)
    assert known.mean() > 0.9
    assert np.median(np.abs(told - true)[known]) < 0.02
    calm = known & (np.abs(true) < 0.05)
    assert (np.abs(told - true) < 3 * sd + 0.02)[calm].mean() > 0.9


def test_algebraic_claims_no_alpha_and_no_slip_without_torques(simulated):
    row = wr.replay(simulated.log, identifier="algebraic").summary.row(0, named=True)
    assert row["alpha"] is None
    assert row["share_slipping"] == row["share_ideal"] == 0
    assert "algebraic needs torques" in row["notes"]


@pytest.mark.parametrize("identifier", ["paper", "algebraic"])
def test_batches_and_later_rows_change_no_bit(simulated, log_rows, identifier):
    rows, settings = log_rows(simulated.log), wr.Settings(identifier=identifier)
    whole = rows.samples(settings)
    assert whole.equals(rows.samples(settings, cuts=range(0, rows.n, 173)))
    prefix = rows.samples(settings, stop=int(0.6 * rows.n))
    n = len(prefix) - 300
    assert n > 1000
    assert prefix[:n].equals(whole[:n])
