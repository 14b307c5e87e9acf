"""Frozen poses in a log: what the tables, the summary and the terminal say of them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import wmr_replay as wr
from wmr_replay.align import FrozenPose
from wmr_replay.cli import cli
from wmr_schemas.arrays import Bool
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack


def bursts(n: int, seed: int, share: float, longest: int, first: int) -> Bool:
    """Rows (n,) in bursts of up to ``longest`` from row ``first`` on."""
    rng, rows, begin = np.random.default_rng(seed), np.zeros(n, bool), first
    while begin < n:
        length = int(rng.integers(1, longest + 1))
        rows[begin : begin + length] = True
        begin += length + 1 + int(rng.exponential(length * (1 - share) / share))
    return rows


def frozen(log: Log, rows: Bool) -> Log:
    """The log with the pose of the last row before each of ``rows``."""
    at = np.maximum.accumulate(np.where(rows, 0, np.arange(len(rows))))
    p = log.pose
    return replace(log, pose=PoseTrack(p.t_ns, p.x_m[at], p.y_m[at], p.yaw_rad[at]))


def drawn(seed: int, rate_hz: float = 100.0, noise: Any = "mocap") -> Log:
    scenario = ("stop-and-go", "patrol", "random")[seed % 3]
    return wr.synthesise(scenario, seed=seed, duration_s=12, rate_hz=rate_hz, noise=noise).log


def told(log: Log) -> tuple[dict[str, Any], list[dict[str, Any]], Any]:
    """Summary row, findings and samples of a replay."""
    result = wr.replay(log)
    row = result.summary.row(0, named=True)
    return row, json.loads(row["findings"]), result.samples.collect()


@pytest.mark.parametrize("seed", range(6))
def test_repeats_are_holes_and_a_finding_counts_them(seed: int) -> None:
    rate, noise = (50.0, 100.0, 200.0)[seed // 2], ("mocap", "rtk")[seed % 2]
    clean = drawn(seed, rate, noise)
    rows = bursts(len(clean.pose), seed, 0.35, round(0.6 * rate), round(2 * rate))
    _, findings, samples = told(frozen(clean, rows))
    (found,) = [f for f in findings if f["code"] == "frozen_pose"]
    assert found["severity"] == "bars"
    assert found["n"] == pytest.approx(rows.sum(), rel=0.05)
    speeds = samples["v_long_mps"].to_numpy()
    assert np.isnan(speeds[rows]).mean() > 0.95
    fastest = np.nanmax(np.abs(told(clean)[2]["v_long_mps"].to_numpy()))
    assert np.nanmax(np.abs(speeds)) < fastest + 0.3


@pytest.mark.parametrize("rate_hz", [20.0, 50.0])
def test_a_position_that_stands_while_the_wheels_advance_is_frozen_whatever_the_rate(rate_hz: float) -> None:
    """By the pose alone, noise of 1 mm tells it from 100 Hz on."""
    clean = drawn(2, rate_hz)
    rows = bursts(len(clean.pose), 5, 0.3, round(rate_hz), round(2 * rate_hz))
    p, at = clean.pose, np.maximum.accumulate(np.where(rows, 0, np.arange(len(rows))))
    _, findings, _ = told(replace(clean, pose=PoseTrack(p.t_ns, p.x_m[at], p.y_m[at], p.yaw_rad)))
    (found,) = [f for f in findings if f["code"] == "frozen_pose"]
    assert found["n"] > 0.6 * rows.sum()
    assert "the position alone" in found["text"]


def test_a_simulated_robot_that_turns_on_the_spot_is_not_frozen() -> None:
    n = 400
    t_ns, turning = np.arange(n, dtype=np.int64) * 20_000_000, np.arange(n) >= 100
    x_m = np.cumsum(np.where(turning, 0.0, 1e-6 * np.arange(n) ** 2))
    yaw = np.cumsum(np.where(turning, 0.02, 0.0))
    wheels = np.where(turning, np.array([[-2.0], [2.0]]), 5.0)
    stage = FrozenPose()
    assert not stage.frozen(t_ns, np.stack([x_m, np.zeros(n), yaw]), wheels)[110:].any()
    assert stage.frozen(
        t_ns + t_ns[-1] + 1, np.stack([x_m[-1] + 0 * x_m, 0 * x_m, yaw[-1] + yaw]), 0 * wheels + 5
    )[50:].all()


def test_rows_far_behind_the_last_measured_pose_have_no_verdict() -> None:
    clean = drawn(2)
    rows = np.zeros(len(clean.pose), bool)
    rows[600:800] = True
    _, _, samples = told(frozen(clean, rows))
    late = samples[650:800]
    assert (late["status"] == "gap").all()
    assert (late["mode"] == "undecided").all()
    assert late["p_ideal"].is_nan().all()
    assert samples["mode"][601] == samples["mode"][599]


def test_a_tracker_at_half_the_rate_of_its_messages_is_replayed_at_its_own() -> None:
    clean = drawn(1)
    row, findings, samples = told(frozen(clean, np.arange(len(clean.pose)) % 2 == 1))
    (found,) = findings
    assert (found["code"], found["severity"]) == ("frozen_pose", "note")
    assert "every pose comes 2 times" in found["text"]
    assert row["rate_hz"] == pytest.approx(50.0)
    half = replace(clean, pose=PoseTrack(*(getattr(clean.pose, k)[::2] for k in vars(clean.pose))))
    slow, _, slow_samples = told(half)
    assert row["accuracy"] > slow["accuracy"] - 0.02
    assert (samples["status"] == "gap").sum() <= 2 * (slow_samples["status"] == "gap").sum()


@pytest.mark.parametrize("seed", range(3))
def test_clean_logs_have_no_frozen_pose(seed: int) -> None:
    clean = drawn(seed)
    p = clean.pose
    grid = PoseTrack(p.t_ns, p.x_m.round(3), p.y_m.round(3), p.yaw_rad.round(3))
    for log in (clean, replace(clean, pose=grid)):
        assert not [f for f in told(log)[1] if f["code"] == "frozen_pose"]


@pytest.mark.parametrize("seed", range(8))
def test_jumps_are_counted_wherever_rows_say_so(seed: int) -> None:
    clean = drawn(seed, noise=("mocap", "rtk", "poor")[seed % 3])
    rng, p = np.random.default_rng(seed), clean.pose
    at = int(rng.integers(300, len(p) - 100))
    shift = 10.0 ** rng.uniform(-2, 1)
    x_m = p.x_m + shift * (np.arange(len(p)) >= at)
    row, _, samples = told(replace(clean, pose=PoseTrack(p.t_ns, x_m, p.y_m, p.yaw_rad)))
    if (samples["status"] == "pose_jump").any():
        assert row["n_pose_jumps"] > 0


def test_the_bank_goes_on_after_an_effort_without_sense() -> None:
    clean = drawn(0)
    torque = clean.torque
    assert torque is not None
    left = torque.left_nm.copy()
    left[400:403] = 1e200
    columns = {k: v for k, v in vars(torque).items() if k != "left_nm"}
    _, _, samples = told(replace(clean, torque=TorqueTrack(left_nm=left, **columns)))
    posterior = samples["p_ideal"].to_numpy()
    assert np.isfinite(posterior[-300:]).all()


def test_the_terminal_says_how_many_poses_are_frozen(tmp_path: Path) -> None:
    made = wr.synthesise("patrol", seed=4, duration_s=12)
    rows = bursts(len(made.log.pose), 4, 0.3, 100, 200)
    made._simulated = replace(made._simulated, log=frozen(made.log, rows))
    made.save(tmp_path / "frozen.mcap")
    answer = CliRunner().invoke(
        cli, ["run", str(tmp_path / "frozen.mcap"), "--out", str(tmp_path / "out"), "--no-rrd"]
    )
    assert answer.exit_code == 0, answer.output
    assert "frozen_pose" in answer.output
    said = " ".join(answer.output.split())
    assert f"of {len(rows)} poses" in said
    assert "while the robot moves" in said


@pytest.mark.parametrize("seed", [1, 5])
def test_a_gap_analysis_leaves_frozen_poses_out(tmp_path: Path, seed: int) -> None:
    made = wr.synthesise("patrol", seed=seed, duration_s=25)
    rows = bursts(len(made.log.pose), seed, 0.3, 60, 200)
    made._simulated = replace(made._simulated, log=frozen(made.log, rows))
    (path, *_) = made.save(tmp_path / "frozen.mcap")
    answer = wr.gap(path)
    assert len(answer.log.pose) == pytest.approx((~rows).sum(), rel=0.02)
    assert any("repeat the one before" in note for note in answer.document.notes)
