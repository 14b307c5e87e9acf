"""The adaptive window: long on steady stretches, short after a switch, causal, with its delay in the row."""

import itertools

import numpy as np
import pytest

from wmr_replay.differentiate import AdaptiveDifferentiator, Differentiator, KernelSpec
from wmr_replay.differentiate.adaptive import longest_consistent
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.status import Status

STEP_S = 0.01
WINDOWS_S = (0.3, 0.42, 0.6, 0.84, 1.2)


def switching(n, seed=0):
    """x with an acceleration that switches every 3 s: stamps, x, v."""
    rng = np.random.default_rng(seed)
    a = np.repeat(rng.permutation([-1.5, 0.0, 1.5] * (n // 900 + 1)), 300)[:n]
    v = np.concatenate([[0.0], np.cumsum(a[:-1]) * STEP_S])
    x = np.concatenate([[0.0], np.cumsum(v[:-1] * STEP_S + a[:-1] * STEP_S**2 / 2)])
    return 10**18 + np.arange(n) * 10_000_000, x, v


def adaptive(sigma, n_signals=1, **options):
    return AdaptiveDifferentiator(
        KernelSpec(2), windows_s=WINDOWS_S, step_s=STEP_S, sigma=np.full(n_signals, sigma), **options
    )


def no_inputs(t_ns):
    return np.empty((0, len(t_ns)))


def test_intervals_are_intersected_from_short_to_long():
    nan = np.nan
    estimates = np.array([[0.0, 0.0, 0.0, nan], [0.5, 5.0, 0.5, 0.0], [0.9, 0.1, nan, 0.0]])[:, None, :]
    half = np.array([1.0, 0.5, 0.2])[:, None, None] * np.ones((3, 1, 4))
    assert longest_consistent(estimates, half).tolist() == [2, 0, 1, -1]


def test_at_equal_delay_it_beats_every_fixed_window_on_a_signal_that_switches():
    t_ns, x, v = switching(12_000)
    sigma = 0.003
    noisy = (x + sigma * np.random.default_rng(7).normal(size=len(x)))[None]
    t_s = (t_ns - t_ns[0]) * 1e-9

    def rmse(differentiator):
        out = differentiator.push(t_ns, noisy, no_inputs(t_ns))
        rows = slice(150, None)
        assert (out.state[rows] == Status.OK).all()
        assert np.allclose(out.delay_s[rows], 0.15)
        return np.sqrt(np.mean((out.estimates[0, 1, rows] - np.interp(t_s - 0.15, t_s, v)[rows]) ** 2))

    fixed = [
        rmse(Differentiator(KernelSpec(2, theta=1 - 0.3 / w), window_s=w, step_s=STEP_S)) for w in WINDOWS_S
    ]
    assert rmse(adaptive(sigma, common_delay_s=0.15)) < 0.95 * min(fixed)


def test_the_window_is_long_on_a_steady_stretch_and_short_after_a_switch():
    n = 2000
    t_s = np.arange(n) * STEP_S
    x = np.where(t_s < 10, 0.0, (t_s - 10) ** 2)
    noisy = (x + 0.001 * np.random.default_rng(3).normal(size=n))[None]
    t_ns = 10**18 + np.arange(n) * 10_000_000
    out = adaptive(0.001).push(t_ns, noisy, no_inputs(t_ns))
    steady = np.mean(out.delay_s[500:990])
    assert steady > 0.55
    assert np.median(out.delay_s[1030:1060]) <= 0.21 + 1e-9
    assert np.mean(out.delay_s[1200:]) > 0.5
    gains = np.sqrt(out.gains[1, 1])
    assert gains[1045] > 3 * np.median(gains[500:990])


def test_inputs_gains_and_delay_are_those_of_the_window_taken():
    rng = np.random.default_rng(1)
    t_ns, x, _ = switching(1200)
    samples, inputs = np.stack([x, -x]) + 0.003 * rng.normal(size=(2, 1200)), rng.normal(size=(1, 1200))
    out = adaptive(0.003, 2, folds=(2,)).push(t_ns, samples, inputs)
    singles = [
        Differentiator(KernelSpec(2), window_s=w, step_s=STEP_S, folds=(2,)).push(t_ns, samples, inputs)
        for w in WINDOWS_S
    ]
    n_taken = 0
    for single in singles:
        rows = out.delay_s == single.delay_s
        n_taken += np.count_nonzero(rows)
        for name in ("estimates", "inputs", "gains", "coverage"):
            assert np.array_equal(getattr(out, name)[..., rows], getattr(single, name)[..., rows])
    assert n_taken == np.count_nonzero(out.state == Status.OK)


@pytest.mark.parametrize("common_delay_s", [None, 0.15])
def test_rows_depend_on_no_later_sample_and_batches_change_no_bit(common_delay_s):
    rng = np.random.default_rng(6)
    t_ns, x, _ = switching(900)
    keep = rng.random(900) > 0.03
    t_ns, x = t_ns[keep], x[keep]
    samples, inputs = (x + 0.003 * rng.normal(size=len(x)))[None], rng.normal(size=(1, len(x)))

    def run(edges):
        stage = adaptive(0.003, folds=(1,), common_delay_s=common_delay_s)
        parts = [stage.push(t_ns[a:b], samples[:, a:b], inputs[:, a:b]) for a, b in itertools.pairwise(edges)]
        names = ("estimates", "inputs", "gains", "state", "coverage", "delay_s")
        return [np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in names]

    whole = run([0, len(x)])
    for column, cut, prefix in zip(whole, run([0, 1, 7, 200, 201, 640, len(x)]), run([0, 400]), strict=True):
        assert np.array_equal(column, cut, equal_nan=True)
        assert np.array_equal(column[..., :400], prefix, equal_nan=True)


def test_windows_out_of_order_and_delays_outside_the_shortest_are_refused():
    with pytest.raises(InvalidSetting, match="rising"):
        AdaptiveDifferentiator(KernelSpec(2), windows_s=(0.5, 0.3), step_s=STEP_S, sigma=np.ones(1))
    with pytest.raises(InvalidSetting, match="outside the shortest window"):
        adaptive(1.0, common_delay_s=0.4)
