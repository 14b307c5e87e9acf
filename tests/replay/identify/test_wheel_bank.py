"""Modes, slips and dimensions from wheel speeds, on logs of a plant that slips by friction."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import wmr_replay as wr
from wmr_replay.identify.filter_bank.bank import Bank, BankSettings
from wmr_replay.identify.filter_bank.bins import into_bins, open_bin
from wmr_replay.identify.wheel_bank.model import wheel_model
from wmr_replay.identify.wheel_bank.predict import body_motion, predict_pose
from wmr_replay.identify.wheel_bank.states import LN_TRACK, N_STATES, PSI, S_SUM
from wmr_replay.identify.wheel_bank.steps import PARAMETERS
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, WheelSpeedTrack
from wmr_synth import synthesise
from wmr_synth.wheel_speed.encoders import EncoderSensors

RTK = EncoderSensors(noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
SLIPS = ["slipping", "skidding_slipping"]


@pytest.fixture(scope="module", params=["encoders", "skid-steer"])
def simulated(request):
    """40 s of a lively drive with skids and slips, at a centimetre of noise."""
    return synthesise(request.param, seed=11, duration_s=40, sensors=RTK)


@pytest.fixture(scope="module")
def replayed(simulated):
    """Its replay."""
    return wr.replay(simulated.log)


def test_all_modes_are_told_causally_and_better_in_hindsight(replayed):
    row = replayed.summary.row(0, named=True)
    assert row["accuracy"] > 0.9
    assert row["hindsight_accuracy"] > 0.95
    assert row["ece"] < 0.05
    samples = replayed.samples.collect()
    told, true = (samples[name].is_in(SLIPS).to_numpy() for name in ("mode", "mode_true"))
    assert told[true].mean() > 0.75
    assert told[~true].mean() < 0.05


def test_dimensions_are_learnt_with_honest_deviations(simulated, replayed):
    row, robot = replayed.summary.row(0, named=True), simulated.facts["true_robot"]
    true = {
        "wheel_scale": robot["wheel_radius_m"] / robot["stated_radius_m"],
        "effective_half_track_m": robot["half_track_m"],
        "icr_offset_m": robot["icr_offset_m"],
    }
    for name, value in true.items():
        assert abs(row[name] - value) < 4 * row[f"{name}_sd"] + 0.003, name
        assert 0 < row[f"{name}_sd"] < 0.02


def test_slip_velocities_follow_the_true_ones(simulated, replayed):
    samples, truth = replayed.samples.collect(), simulated.truth
    since_ns = samples["t_ns"].to_numpy() - simulated.log.pose.t_ns[0]
    at = np.searchsorted(truth.t_ns[:-1], since_ns)
    assert at[-1] - at[0] > 3900
    sums, differences = truth.sigma_sum_mps[at], truth.sigma_diff_mps[at]
    for name, true in (("left", 1.5 * (sums - differences)), ("right", 1.5 * (sums + differences))):
        told = samples[f"slip_{name}_mps"].to_numpy()
        known = np.isfinite(told)
        assert known.mean() > 0.9
        error, sd = told[known] - true[known], samples[f"slip_{name}_mps_sd"].to_numpy()[known]
        assert np.median(np.abs(error)) < 0.01
        within = np.abs(error) < 2 * sd
        assert within.mean() > 0.94
        assert within[np.abs(true[known]) > 0.05].mean() > 0.88
        ratio = samples[f"slip_ratio_{name}"].drop_nulls().to_numpy()
        assert np.isfinite(ratio).all()
        assert np.abs(ratio).max() <= 3


@pytest.mark.parametrize("ticks", [2048, 100])
def test_rounding_of_encoders_is_no_slipping(ticks):
    """At 1 mm of noise 100 ticks a turn round a path to 6 mm: .6 m/s at 100 Hz."""
    stamps = synthesise("encoders", seed=4, duration_s=30).log
    driving = straight_and_turning(stamps, ticks)
    told = wr.replay(driving, hindsight=False).samples.collect()
    warm = told.filter(pl.col("t_s") > 1.5)
    assert warm["mode"].is_in(SLIPS).mean() < 0.01


def straight_and_turning(log: Log, ticks: int) -> Log:
    """An exact drive without any slip on the stamps of ``log``, its wheels rounded to ``ticks`` a turn."""
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) * 1e-9
    v, omega = 0.6 + 0.5 * np.sin(0.4 * t_s), 0.7 * np.sin(0.9 * t_s)
    dt = np.diff(t_s, prepend=t_s[0])
    yaw = np.cumsum(omega * dt)
    heading = yaw - 0.5 * omega * dt
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(3, len(t_s))) * np.array([[1e-3], [1e-3], [2e-3]])
    x, y = np.cumsum(v * np.cos(heading) * dt), np.cumsum(v * np.sin(heading) * dt)
    quantum = 2 * np.pi / ticks
    turned = [
        np.floor(np.cumsum((v + side * 0.25 * omega) * dt / 0.1) / quantum) * quantum for side in (-1, 1)
    ]
    speeds = [np.diff(angle, prepend=angle[0]) / np.maximum(dt, 1e-3) for angle in turned]
    pose = PoseTrack(log.pose.t_ns, x + noise[0], y + noise[1], yaw + noise[2])
    robot = RobotParameters(wheel_radius_m=0.1, half_track_m=0.25)
    return Log(pose, wheels=WheelSpeedTrack(log.pose.t_ns, *speeds), robot=robot)


def test_a_wheel_radius_far_off_is_learnt_and_not_slipping(simulated):
    """As on a real robot whose wheels were .82 of the nominal ones."""
    assert simulated.log.robot.wheel_radius_m is not None
    off = replace(simulated.log.robot, wheel_radius_m=simulated.log.robot.wheel_radius_m / 0.82)
    row = wr.replay(replace(simulated.log, robot=off), hindsight=False).summary.row(0, named=True)
    assert row["wheel_scale"] == pytest.approx(0.82, abs=0.03)
    assert row["accuracy"] > 0.85


def test_a_models_effects_are_known_from_the_first_row_on(simulated):
    """What ``fit`` writes of a robot serves its other logs."""
    true = {name: next(iter(size.values())) for name, size in simulated.facts["calibration"].items()}
    parameters = {"icr_offset": "offset_m", "lateral_slip": "seconds"}
    effects = tuple(
        Effect(name, {parameters.get(name, "ratio"): size}, {parameters.get(name, "ratio"): 0.001})
        for name, size in true.items()
    )
    samples = wr.replay(simulated.log, model=Model(RobotParameters(), effects=effects)).samples.collect()
    first = samples.filter(pl.col("wheel_scale").is_not_null()).head(1)
    robot = simulated.facts["true_robot"]
    scale = robot["wheel_radius_m"] / robot["stated_radius_m"]
    assert first["wheel_scale"][0] == pytest.approx(scale, abs=0.01)
    assert first["effective_half_track_m"][0] == pytest.approx(robot["half_track_m"], rel=0.02)
    assert first["effective_half_track_m_sd"][0] < 0.01


def test_batches_and_later_rows_change_no_bit(simulated, log_rows):
    rows = log_rows(simulated.log)
    whole = rows.samples()
    assert whole.equals(rows.samples(cuts=range(0, rows.n, 173)))
    stop = int(0.6 * rows.n)
    prefix = rows.samples(stop=stop)
    n = len(prefix) - 300
    assert n > 1000
    assert prefix[:n].equals(whole[:n])


def test_a_pose_computed_from_the_wheels_names_no_mode_and_teaches_nothing():
    log = straight_and_turning(synthesise("encoders", seed=4, duration_s=20).log, 4096)
    assert log.wheels is not None
    t_s = (log.wheels.t_ns - log.wheels.t_ns[0]) * 1e-9
    dt = np.diff(t_s, prepend=t_s[0])
    v = 0.05 * (log.wheels.left_radps + log.wheels.right_radps)
    omega = 0.1 * (log.wheels.right_radps - log.wheels.left_radps) / 0.5
    yaw = np.cumsum(omega * dt)
    pose = PoseTrack(log.pose.t_ns, np.cumsum(v * np.cos(yaw) * dt), np.cumsum(v * np.sin(yaw) * dt), yaw)
    result = wr.replay(replace(log, pose=pose), hindsight=False)
    told = result.samples.collect().filter(pl.col("status") != "warming_up")
    assert not told["mode"].is_in([*SLIPS, "ideal", "skidding"]).any()
    assert result.summary["wheel_scale"][0] is None
    assert "integrated from wheel speeds" in result.summary["verdict"][0]


def without_wheels(log: Log, rows, sides=("left", "right")) -> Log:
    """``log`` with unknown speeds of these wheels in the rows of a mask."""
    speeds = {f"{side}_radps": getattr(log.wheels, f"{side}_radps").copy() for side in ("left", "right")}
    for side in sides:
        speeds[f"{side}_radps"][rows] = np.nan
    return replace(log, wheels=replace(log.wheels, **speeds))


def test_nothing_is_said_of_slipping_while_no_wheel_speed_is_known():
    log = straight_and_turning(synthesise("encoders", seed=4, duration_s=30).log, 4096)
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) * 1e-9
    result = wr.replay(without_wheels(log, (t_s > 10) & (t_s < 20)))
    told, later = result.samples.collect(), result.hindsight.collect()
    hole, behind = pl.col("t_s").is_between(11.5, 19.5), pl.col("t_s").is_between(21, 29)
    for rows in (told.filter(hole), later.filter(hole)):
        assert not rows["mode"].is_in([*SLIPS, "ideal"]).any()
        assert (rows["status"] == "no_torque").mean() > 0.8
    assert told.filter(hole)["slip_left_mps"].count() == 0
    assert "without wheel speeds ideal rolling and slipping" in result.summary["verdict"][0]
    assert (told.filter(behind)["mode"] == "ideal").mean() > 0.9
    assert (later.filter(behind)["mode"] == "ideal").mean() > 0.9
    assert result.summary["effective_half_track_m"][0] == pytest.approx(0.25, abs=0.01)


def wheels_from(log: Log, begin_s: float) -> Log:
    """``log`` with no message of wheel speeds before ``begin_s``."""
    w = log.wheels
    kept = w.t_ns >= log.pose.t_ns[0] + round(begin_s * 1e9)
    return replace(log, wheels=WheelSpeedTrack(w.t_ns[kept], w.left_radps[kept], w.right_radps[kept]))


def test_wheel_speeds_that_begin_late_tell_from_then_on(log_rows):
    late = wheels_from(straight_and_turning(synthesise("encoders", seed=4, duration_s=25).log, 4096), 10.0)
    told = wr.replay(late).samples.collect()
    before, behind = told.filter(pl.col("t_s").is_between(2, 10)), told.filter(pl.col("t_s") > 12)
    assert not before["mode"].is_in([*SLIPS, "ideal"]).any()
    assert (before["status"] == "no_torque").mean() > 0.8
    assert (behind["mode"] == "ideal").mean() > 0.9
    rows = log_rows(late)
    whole = rows.samples()
    assert whole.equals(rows.samples(cuts=range(0, rows.n, 311)))
    prefix = rows.samples(stop=int(0.7 * rows.n))
    n = len(prefix) - 300
    assert n > 1200
    assert prefix[:n].equals(whole[:n])


def test_a_skid_in_a_hole_of_the_wheel_speeds_is_no_more_in_hindsight(simulated):
    t_s = (simulated.log.wheels.t_ns - simulated.log.pose.t_ns[0]) * 1e-9
    result = wr.replay(without_wheels(simulated.log, (t_s > 10) & (t_s < 30)), min_sideslip=0.0)
    hole = result.hindsight.collect().filter(pl.col("t_s").is_between(11.5, 29.5))
    assert not hole["mode"].is_in([*SLIPS, "ideal"]).any()
    assert (hole["mode"] == "skidding").any()
    samples = result.samples.collect()
    assert not ((samples["status"] == "ok") & (samples["mode"] == "undecided")).any()


def test_an_unknown_wheel_radius_is_said(simulated):
    true = simulated.facts["true_robot"]["wheel_radius_m"]
    bare = replace(simulated.log, robot=replace(simulated.log.robot, wheel_radius_m=None))
    row = wr.replay(bare, hindsight=False).summary.row(0, named=True)
    assert 0.15 * row["wheel_scale"] == pytest.approx(true, rel=0.03)
    assert "wheel_scale is relative to 0.15 m" in row["notes"]
    said = float(row["verdict"].split("the wheel radius is ")[1].split()[0])
    assert said == pytest.approx(0.15 * row["wheel_scale"], rel=0.01)


def test_one_wheel_teaches_nothing():
    log = straight_and_turning(synthesise("encoders", seed=4, duration_s=10).log, 4096)
    result = wr.replay(without_wheels(log, slice(None), sides=["right"]))
    assert not result.samples.collect()["mode"].is_in([*SLIPS, "ideal"]).any()
    assert result.summary["effective_half_track_m"][0] is None


def test_standstill_teaches_nothing_of_the_track():
    log = straight_and_turning(synthesise("encoders", seed=4, duration_s=20).log, 4096)
    rng, n = np.random.default_rng(2), len(log.pose)
    pose = PoseTrack(log.pose.t_ns, *(rng.normal(0, 0.003, n) for _ in range(3)))
    stands = replace(log, pose=pose, wheels=WheelSpeedTrack(log.pose.t_ns, np.zeros(n), np.zeros(n)))
    summary = wr.replay(stands, hindsight=False).summary
    assert summary["wheel_scale"][0] is summary["effective_half_track_m"][0] is None
    assert "By the wheel speeds" not in summary["verdict"][0]

    settings, rows = BankSettings(), 0.003**2 * np.ones((2, n))
    bank = Bank(wheel_model(log.robot, {}), 0.01, settings, 4)
    poses = np.stack([pose.x_m, pose.y_m, pose.yaw_rad])
    bins, done = into_bins(pose.t_ns, poses, np.zeros((2, n)), rows, np.zeros(n, bool), 2, open_bin())
    last = bank.push(bins, np.full(n, np.nan), np.full(n, np.nan), done)[PARAMETERS + 1, -1]
    assert np.exp(last) == pytest.approx(0.25, abs=1e-3)


def test_the_prediction_moves_by_its_own_slopes():
    """The covariance after a step is J P Jᵀ, with J by central differences of the predicted pose."""
    rng = np.random.default_rng(3)
    mean = rng.normal(size=N_STATES) * 0.1
    mean[LN_TRACK] = np.log(0.3)
    wheels, dt = np.array([0.8, 0.2, 0.5, -0.3]), 0.02
    root = rng.normal(size=(N_STATES, N_STATES)) * 0.05
    covariance, work = root @ root.T, np.zeros((12, N_STATES))

    def moved(state):
        after, unused = state.copy(), np.zeros((N_STATES, N_STATES))
        predict_pose(after, unused, wheels, dt, work)
        return after

    step = 1e-6
    jacobian = np.stack(
        [(moved(mean + step * e) - moved(mean - step * e)) / (2 * step) for e in np.eye(N_STATES)], axis=1
    )
    expected = jacobian @ covariance @ jacobian.T
    predict_pose(mean.copy(), covariance, wheels, dt, work)
    assert covariance == pytest.approx(expected, abs=1e-9)


def test_the_motion_is_the_declared_one():
    mean = np.zeros(N_STATES)
    mean[LN_TRACK], mean[S_SUM], mean[PSI] = np.log(0.5), 0.1, 1.0
    v, v_lat, omega = body_motion(mean, np.array([1.0, 0.25, 0.0, 0.0]))
    assert (v, v_lat, omega) == pytest.approx((0.9, 0.0, 0.5))
