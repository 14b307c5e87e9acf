"""Noise that is correlated in time is told, with its size; white noise and motion are not."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

import wmr_replay as wr
from wmr_replay.identify import Motion
from wmr_replay.quality import Observed
from wmr_replay.quality.noise_colour import NoiseColour
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth import write_mcap

SD = np.array([[0.005], [0.005], [0.004]])


def path(n, rate_hz, seed):
    """A winding path with starts, stops and jerks (3, n)."""
    rng, step_s = np.random.default_rng(seed), 1 / rate_hz
    t = np.arange(n) * step_s
    knots = np.arange(0, t[-1] + 2, rng.uniform(0.5, 3.0))
    v = np.interp(t, knots, rng.uniform(-1, 2, len(knots)))
    rate = np.interp(t, knots, rng.uniform(-1, 1, len(knots)))
    yaw = np.cumsum(rate) * step_s
    return np.stack([np.cumsum(v * np.cos(yaw)) * step_s, np.cumsum(v * np.sin(yaw)) * step_s, yaw])


def noise_of(kind, n, rate_hz, seed):
    """Noise (3, n) of standard deviation 1, but for that from pose to pose."""
    rng = np.random.default_rng([seed, 1])
    white = rng.standard_normal((3, n))
    if kind == "white":
        return white
    kept = np.exp(-1 / (rate_hz * 0.04))
    if kind == "markov":
        return lfilter([np.sqrt(1 - kept**2)], [1, -kept], white, axis=1)
    if kind == "wobble":
        return 0.4 * white + 1.3 * np.sin(
            2 * np.pi * np.arange(n) / rate_hz / 0.15 + rng.uniform(0, 6, (3, 1))
        )
    raise AssertionError(kind)


def observed(pose, rate_hz, wheels_radps=5.0):
    n = pose.shape[1]
    t_ns = 10**18 + (np.arange(n) * round(1e9 / rate_hz)).astype(np.int64)
    nothing, inputs = np.zeros(n), np.zeros((4, n))
    inputs[2:] = wheels_radps
    motion = Motion(*(nothing for _ in Motion._fields))
    rows = {"t_ns": t_ns, "t_s": (t_ns - t_ns[0]) / 1e9, "pose": pose, "inputs": inputs, "smoothed": inputs}
    rows |= {"motion": motion, "variances": np.zeros((2, n))}
    return Observed(**rows, robot=RobotParameters(), smoothed_pose=pose, pose_raw=pose)


def part(rows, a, b):
    cut = {
        name: column[..., a:b] for name, column in rows._asdict().items() if isinstance(column, np.ndarray)
    }
    return rows._replace(**cut)


def told(rows, cuts=()):
    monitor = NoiseColour()
    for a, b in pairwise([0, 60, *sorted(cuts), len(rows.t_ns)]):
        monitor.push(part(rows, a, b))
    return monitor.findings()


@pytest.mark.parametrize("kind", ["markov", "wobble"])
@pytest.mark.parametrize("rate_hz", [100.0, 250.0, 1000.0])
def test_coloured_noise_is_told(kind, rate_hz):
    found = []
    for seed in range(50):
        n = int(30 * rate_hz)
        pose = path(n, rate_hz, seed) + SD * noise_of(kind, n, rate_hz, seed)
        findings = told(observed(pose, rate_hz))
        found.append(bool(findings) and "position" in findings[0].text and "yaw" in findings[0].text)
    assert np.mean(found) >= 0.95


@pytest.mark.parametrize("rate_hz", [10.0, 30.0, 100.0, 1000.0])
@pytest.mark.parametrize("size", [0.0, 0.1, 1.0, 10.0])
def test_white_noise_in_motion_is_not(rate_hz, size):
    for seed in range(12):
        n = int(30 * rate_hz)
        pose = path(n, rate_hz, seed) + size * SD * noise_of("white", n, rate_hz, seed)
        assert told(observed(pose, rate_hz)) == []


def test_a_slow_drift_is_told_where_the_wheels_stand_still():
    rate_hz, n = 20.0, 20 * 240
    rng = np.random.default_rng(4)
    drift = np.cumsum(rng.standard_normal((3, n)), axis=1) / np.sqrt(rate_hz)
    still = SD * (noise_of("white", n, rate_hz, 4) + 3 * drift)
    (found,) = told(observed(still, rate_hz, wheels_radps=0.0))
    assert "noise at rest" in found.text
    assert told(observed(SD * noise_of("white", n, rate_hz, 5), rate_hz, wheels_radps=0.0)) == []


def test_the_sizes_said_are_those_of_the_noise():
    """A first-order Markov process: third differences over m steps of a, b = e^(−mh/τ) have the variance
    σ² (20 − 30 b + 12 b² − 2 b³).
    """
    rate_hz, n, tau_s = 200.0, 40_000, 0.04
    pose = SD * noise_of("markov", n, rate_hz, 1)
    text = told(observed(pose, rate_hz))[0].text
    single = float(text.split("noise is ")[1].split(" mm")[0])
    kept = np.exp(-1 / (rate_hz * tau_s))
    expected = 5.0 * np.sqrt((20 - 30 * kept + 12 * kept**2 - 2 * kept**3) / 20)
    assert single == pytest.approx(expected, rel=0.06)


@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.integers(60, 3000), max_size=6))
def test_batches_change_nothing(cuts):
    pose = path(3000, 100.0, 2) + SD * noise_of("markov", 3000, 100.0, 2)
    assert told(observed(pose, 100.0), cuts) == told(observed(pose, 100.0))


def test_run_says_so_and_bars_nothing(tmp_path):
    n = 3000
    pose = path(n, 100.0, 3) + SD * noise_of("markov", n, 100.0, 3)
    t_ns = (np.arange(n) * 10_000_000).astype(np.int64)
    write_mcap(Log(PoseTrack(t_ns, *pose), None, None), tmp_path / "filtered.mcap")
    found = {f["code"]: f for f in wr.run(tmp_path / "filtered.mcap", out=tmp_path / "out").findings}
    assert found["coloured_noise"]["severity"] == "warning"
    assert not any(f["severity"] == "bars" for f in found.values())
