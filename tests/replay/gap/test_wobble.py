"""Pose noise that is correlated in time, in the gap analysis; the oracle is the noise that was drawn."""

import numpy as np
import pytest

from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.settings import GateSettings
from wmr_replay.pipeline.whole_colour import whole_colour
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

STEP_S, N = 0.01, 6000
WHITE_M, WHITE_RAD = 0.01, 0.005


def wobbling(tau_s: float, seed: int, wobble_m: float) -> np.ndarray:
    """Poses (3, n) of a robot on a circle, with white noise and a wobble of x and y."""
    rng = np.random.default_rng(seed)
    t_s = STEP_S * np.arange(N)
    kept = np.exp(-STEP_S / tau_s)
    wobble = np.zeros((2, N))
    for k in range(1, N):
        wobble[:, k] = kept * wobble[:, k - 1] + np.sqrt(1 - kept**2) * rng.normal(size=2)
    pose = np.stack([2 * np.cos(0.3 * t_s), 2 * np.sin(0.3 * t_s), 0.3 * t_s])
    pose[:2] += WHITE_M * rng.normal(size=(2, N)) + wobble_m * wobble
    pose[2] += WHITE_RAD * rng.normal(size=N)
    return pose


@pytest.mark.parametrize("tau_s", [0.05, 0.1, 0.2])
def test_a_wobble_counts_as_white_noise_of_its_density(tau_s):
    found = whole_colour(STEP_S * np.arange(N), wobbling(tau_s, 1, WHITE_M))
    density = 2 * WHITE_M**2 * tau_s / (1 + (tau_s / 0.2) ** 2)
    assert found.as_white[0] == pytest.approx(WHITE_M**2 + density / STEP_S, rel=0.5)
    assert found.factor[0] > 3.0
    assert found.factor[1] < 1.3


def test_white_noise_stays_nearly_as_it_is():
    for seed in range(5):
        found = whole_colour(STEP_S * np.arange(N), wobbling(0.1, seed, 0.0))
        assert (found.factor < 1.3).all()
        assert (found.wobble < 0.3 * np.array([WHITE_M, WHITE_RAD]) ** 2).all()


def test_bins_hold_the_density_for_the_filter_and_the_scatter_for_windows():
    def binned(wobble_m):
        t_ns = np.arange(N, dtype=np.int64) * 10_000_000
        x, y, yaw = wobbling(0.1, 2, wobble_m)
        none = np.full(N, np.nan)
        torque = TorqueTrack(t_ns, np.ones(N), np.ones(N), none, none)
        robot = RobotParameters(alpha=0.3, half_track_m=0.25)
        return bin_log(Log(PoseTrack(t_ns, x, y, yaw), torque, None, robot), GateSettings())

    calm, shaken = binned(0.0), binned(WHITE_M)
    assert calm.variances == pytest.approx(calm.noise_sd**2 / calm.count[:, None], rel=0.3)
    assert (calm.scatter <= calm.variances).all()
    assert shaken.variances[9, 0] > 3 * calm.variances[9, 0]
    assert shaken.scatter[9, 0] == pytest.approx(WHITE_M**2 * (1 + 1 / 4), rel=0.5)
    assert shaken.variances[9, 2] == pytest.approx(calm.variances[9, 2], rel=0.1)
