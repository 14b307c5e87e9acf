"""A camera in a hand and a flying tracker bar the rows; ramps, noise and askew mounting do not."""

import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer
from scipy.spatial.transform import Rotation

import wmr_replay as wr
from wmr_replay.cli.printing.run import print_result
from wmr_replay.ingest.channels.planarity import Planarity
from wmr_replay.ingest.decoding.bindings import upright_of, yaw_of
from wmr_schemas.status import Status

RATE_HZ = 30


def smooth(rng, n, period_s):
    """A smooth random signal of standard deviation 1 or so."""
    t = np.arange(n) / RATE_HZ
    phases = rng.uniform(0, 2 * np.pi, 5)
    periods = period_s * rng.uniform(0.6, 1.6, 5)
    return sum(np.sin(2 * np.pi * t / p + q) for p, q in zip(periods, phases, strict=True)) / np.sqrt(2.5)


def pose_of(kind, seed, seconds=60):
    """Positions (3, n) and quaternions (4, n) of a carrier."""
    rng, n = np.random.default_rng(seed), seconds * RATE_HZ
    t = np.arange(n) / RATE_HZ
    roll, pitch, z = np.zeros(n), np.zeros(n), np.zeros(n)
    yaw = np.cumsum(0.5 * smooth(rng, n, 8.0)) / RATE_HZ
    speed = 0.8 * np.ones(n)
    if kind == "hand":
        roll, pitch = 0.45 * smooth(rng, n, 3.0), 0.45 * smooth(rng, n, 4.0)
        z, speed = 0.3 * smooth(rng, n, 5.0), 0.3 * np.ones(n)
    if kind == "flight":
        roll, pitch, z = 0.05 * smooth(rng, n, 3.0), 0.05 * smooth(rng, n, 3.0), 1.5 * smooth(rng, n, 6.0)
    if kind == "ramp":
        slope = np.radians(rng.uniform(5, 18)) * np.sign(np.sin(2 * np.pi * t / 20 + seed))
        pitch, z = -slope, np.cumsum(speed * np.sin(slope)) / RATE_HZ
    if kind == "rough":
        roll, pitch = 0.1 * smooth(rng, n, 2.0), 0.1 * smooth(rng, n, 2.0)
    if kind == "rest":
        speed = 0 * speed
    sd = rng.choice([0.001, 0.01, 0.1])
    turn = Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], 1))
    if kind == "askew":
        turn = turn * Rotation.from_euler("xyz", rng.uniform(-1.5, 1.5, 3))
    place = np.stack([np.cumsum(speed * np.cos(yaw)) / RATE_HZ, np.cumsum(speed * np.sin(yaw)) / RATE_HZ, z])
    return place + sd * rng.standard_normal((3, n)), turn.as_quat().T


def columns_of(place, turn):
    return np.concatenate([upright_of(turn), place[2:3], place[:2]])


def watch(t_ns, columns, cuts=()):
    monitor, bars = Planarity(), []
    edges = [0, *sorted(cuts), len(t_ns)]
    for a, b in pairwise(edges):
        chosen = monitor.choose(t_ns[a:b])
        monitor.push(t_ns[a:b], chosen, columns[:, a:b][:, chosen])
        bars += monitor.take_bars()
    return bars, monitor.findings()


def stamps(n):
    return 10**18 + (np.arange(n) * round(1e9 / RATE_HZ)).astype(np.int64)


@pytest.mark.parametrize("kind", ["hand", "flight"])
def test_a_carried_or_flying_tracker_is_found(kind):
    found = []
    for seed in range(50):
        columns = columns_of(*pose_of(kind, seed))
        bars, findings = watch(stamps(columns.shape[1]), columns)
        found.append(bool(bars) and bars[0].status == Status.NO_HEADING and len(findings) == 1)
    assert np.mean(found) >= 0.95


@pytest.mark.parametrize("kind", ["flat", "ramp", "rough", "askew", "rest"])
def test_wheels_on_the_ground_are_not(kind):
    for seed in range(50):
        columns = columns_of(*pose_of(kind, seed))
        assert watch(stamps(columns.shape[1]), columns) == ([], [])


def test_the_upright_axis_is_that_of_a_rotation_matrix():
    turns = Rotation.random(20, random_state=3)
    scaled = turns.as_quat().T * 1.7
    np.testing.assert_allclose(upright_of(scaled), turns.as_matrix()[:, 2, :].T, atol=1e-12)
    angles = np.linspace(-3, 3, 20)
    flat = Rotation.from_rotvec(np.stack([0 * angles, 0 * angles, angles], 1)).as_quat().T
    np.testing.assert_allclose(yaw_of(flat), angles, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.integers(0, 900), max_size=6), seed=st.integers(0, 5))
def test_batches_change_nothing(cuts, seed):
    columns = columns_of(*pose_of("hand", seed, seconds=30))
    t_ns = stamps(columns.shape[1])
    assert watch(t_ns, columns, cuts) == watch(t_ns, columns)


def write_log(path, place, turn, topic="/camera/pose"):
    """A log of the poses as geometry_msgs/PoseStamped in JSON."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("geometry_msgs/PoseStamped", "jsonschema", b"{}")
        channel = writer.register_channel(topic, "json", schema)
        for t_ns, p, q in zip(stamps(place.shape[1]).tolist(), place.T, turn.T, strict=True):
            pose = {
                "position": dict(zip("xyz", p.tolist(), strict=True)),
                "orientation": dict(zip("xyzw", q.tolist(), strict=True)),
            }
            stamp = {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}
            message = {"header": {"stamp": stamp}, "pose": pose}
            writer.add_message(channel, t_ns, json.dumps(message).encode(), t_ns)
        writer.finish()
    return path


def test_run_tells_no_mode_of_a_camera_in_a_hand(tmp_path, capsys):
    result = wr.run(write_log(tmp_path / "hand.mcap", *pose_of("hand", 3)), out=tmp_path / "out")
    print_result(result, as_json=False)
    said = capsys.readouterr().out
    assert "bars      pose_not_planar: roll and pitch vary by" in said
    status = result.samples.collect()["status"]
    assert status[-1] == "no_heading"
    assert (status == "no_heading").mean() > 0.5


def test_names_of_a_mecanum_base_bar_every_row(tmp_path, capsys):
    log = write_log(tmp_path / "base.mcap", *pose_of("flat", 3), "/mecanum_base/pose")
    result = wr.run(log, out=tmp_path / "out")
    print_result(result, as_json=False)
    said = capsys.readouterr().out
    assert "bars      drives_sideways: the robot seems to be omnidirectional (/mecanum_base/pose)" in said
    assert set(result.samples.collect()["status"].unique()) == {"warming_up", "other_drive"}
    assert result.verdict.startswith("No contact mode can be named.")


def test_a_flat_log_is_answered(tmp_path):
    log = write_log(tmp_path / "flat.mcap", *pose_of("flat", 3), "/pose")
    assert wr.run(log, out=tmp_path / "out").findings == ()
