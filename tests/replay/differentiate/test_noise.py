"""Noise tracked from the data: level, outliers, motion, irregular stamps, initialisation, causality."""

import itertools

import numpy as np
import pytest

from wmr_replay.differentiate import NoiseTracker, robust_sigma


def stamps(n, rng, jitter=0.0, dropout=0.0, step_ns=10_000_000):
    t_ns = 10**18 + (np.arange(n) * step_ns + rng.uniform(-jitter, jitter, n) * step_ns).astype(np.int64)
    return t_ns[rng.random(n) >= dropout]


def motion(t_ns):
    t_s = (t_ns - t_ns[0]) * 1e-9
    return 1e5 + 3 * t_s + 2 * np.sin(2 * t_s)


@pytest.mark.parametrize(("jitter", "dropout"), [(0.0, 0.0), (0.3, 0.1)])
def test_level_is_found_on_moving_signals_in_spite_of_outliers(jitter, dropout):
    rng = np.random.default_rng(0)
    t_ns = stamps(4000, rng, jitter, dropout)
    x = motion(t_ns) + 0.01 * rng.normal(size=len(t_ns))
    x[rng.random(len(t_ns)) < 0.01] += 5
    assert robust_sigma(t_ns, x) == pytest.approx(0.01, rel=0.08)


def test_a_change_of_level_is_followed_and_outliers_are_not():
    rng = np.random.default_rng(1)
    t_ns = stamps(12_000, rng, 0.1, 0.02)
    n = len(t_ns)
    level = np.where(np.arange(n) < n // 2, 0.01, 0.04)
    x = motion(t_ns) + level * rng.normal(size=n)
    x[rng.random(n) < 0.002] += 3
    sigma = NoiseTracker(np.array([0.01]), step_s=0.01).push(t_ns, x[None])[0]
    assert sigma[n // 2 - 1] == pytest.approx(0.01, rel=0.15)
    assert sigma[-1] == pytest.approx(0.04, rel=0.15)


def test_a_robot_at_rest_without_noise_does_not_blind_the_tracker():
    rng = np.random.default_rng(2)
    t_ns = stamps(9000, rng)
    x = np.where(np.arange(9000) < 1000, 0.0, 0.02 * rng.normal(size=9000))
    sigma = NoiseTracker(np.array([0.0]), step_s=0.01).push(t_ns, x[None])[0]
    assert sigma[999] <= 1e-12
    assert sigma[-1] == pytest.approx(0.02, rel=0.15)


def test_a_coarsely_quantised_signal_has_the_noise_of_its_steps():
    rng = np.random.default_rng(3)
    t_ns = stamps(3000, rng)
    x = np.round(np.sin(0.5 * (t_ns - t_ns[0]) * 1e-9), 1)
    assert 0 < robust_sigma(t_ns, x) < 0.1
    assert robust_sigma(t_ns[:3], x[:3]) == 0


def test_rows_depend_on_no_later_sample_and_batches_change_no_bit():
    rng = np.random.default_rng(4)
    t_ns = stamps(500, rng, 0.2, 0.1)
    x = rng.normal(size=(2, len(t_ns)))
    x[0, 50] = np.nan
    whole = NoiseTracker(np.array([1.0, 2.0]), step_s=0.01).push(t_ns, x)
    tracker = NoiseTracker(np.array([1.0, 2.0]), step_s=0.01)
    edges = [0, 1, 2, 5, 100, 100, 333, len(t_ns)]
    parts = [tracker.push(t_ns[a:b], x[:, a:b]) for a, b in itertools.pairwise(edges)]
    assert np.isfinite(whole).all()
    assert np.array_equal(np.concatenate(parts, axis=1), whole)
    prefix = NoiseTracker(np.array([1.0, 2.0]), step_s=0.01).push(t_ns[:200], x[:, :200])
    assert np.array_equal(prefix, whole[:, :200])
