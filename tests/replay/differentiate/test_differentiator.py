"""The differentiator: exactness, delay, noise, backends, gaps, causality and chunking."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.differentiate import (
    Differentiator,
    KernelSpec,
)
from wmr_replay.differentiate.design import input_taps, uniform_taps
from wmr_replay.differentiate.irregular import make_fit
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.status import Status

specs = st.builds(
    KernelSpec,
    degree=st.integers(2, 4),
    kappa=st.integers(0, 3),
    mu=st.integers(0, 3),
    shares=st.sampled_from([(), (0.5,), (1.1, 0.4, -0.2)]),
    theta=st.sampled_from([0.0, 0.3, 1.0, -0.2]),
)


def stamps(rng, n, step_s=0.01, jitter=0.0, dropout=0.0):
    t = np.arange(n) * step_s + rng.uniform(-jitter, jitter, n) * step_s
    keep = rng.random(n) >= dropout
    keep[:5] = True
    return (10**18 + np.sort(t[keep] * 1e9)).astype(np.int64)


def push_all(differentiator, t_ns, samples, inputs, cuts=()):
    edges = [0, *sorted(cuts), len(t_ns)]
    parts = [
        differentiator.push(t_ns[a:b], samples[:, a:b], inputs[:, a:b]) for a, b in itertools.pairwise(edges)
    ]
    return tuple(
        np.concatenate([getattr(p, name) for p in parts], axis=-1)
        for name in ("estimates", "inputs", "gains", "state", "coverage", "delay_s")
    )


@given(spec=specs, seed=st.integers(0, 2**32 - 1), irregular=st.booleans())
@settings(max_examples=60, deadline=None)
def test_polynomials_up_to_the_degree_are_exact_on_any_stamps(spec, seed, irregular):
    rng = np.random.default_rng(seed)
    t_ns = stamps(rng, 200, jitter=0.3 if irregular else 0.0, dropout=0.1 if irregular else 0.0)
    coefficients = rng.normal(size=spec.degree + 1)
    polynomial = np.polynomial.Polynomial(coefficients)
    t = (t_ns - t_ns[0]) * 1e-9
    differentiator = Differentiator(spec, window_s=0.4, step_s=0.01)
    estimates, _, _, state, *_ = push_all(
        differentiator, t_ns, (polynomial(t) + 1e6)[None], np.empty((0, len(t)))
    )
    good = state == Status.OK
    assert good.sum() > 50
    at = t[good] - differentiator.delay_s
    for n in range(3):
        expected = polynomial.deriv(n)(at) if n else polynomial(at) + 1e6
        scale = 1e-9 * (1e6 if n == 0 else 1.0) + 1e-9 * (2 / 0.4) ** n * 100
        np.testing.assert_allclose(estimates[0, n, good], expected, rtol=1e-8, atol=scale)


@given(spec=specs, seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_both_backends_agree_to_round_off_on_uniform_stamps(spec, seed):
    """A nominal step off by 3 ns sends the same uniform stamps through the solver on actual stamps."""
    rng = np.random.default_rng(seed)
    t_ns = 10**18 + np.arange(150) * 10_000_000
    samples, inputs = rng.normal(size=(2, 150)), rng.normal(size=(2, 150))
    fast = push_all(Differentiator(spec, window_s=0.3, step_s=0.01, folds=(2, 1)), t_ns, samples, inputs)
    off = Differentiator(spec, window_s=0.3, step_s=0.010000003, folds=(2, 1))
    off._rules = off._rules._replace(window_ns=300_000_000)
    off._backend._fit = make_fit(spec, 300_000_000)
    slow = push_all(off, t_ns, samples, inputs)
    sd = np.sqrt(np.diagonal(fast[2][:, :, -1]))
    both = (fast[3] == Status.OK) & (slow[3] == Status.OK)
    assert both.sum() > 100
    difference = np.abs(fast[0] - slow[0])[..., both]
    assert np.all(difference <= 1e-9 * sd[:, None]), difference.max(axis=(0, 2)) / sd
    largest = np.max(np.abs(fast[1][:, both]), axis=1, keepdims=True)
    assert np.all(np.abs(fast[1] - slow[1])[:, both] <= 1e-9 * np.maximum(largest, 1.0))


def test_predicted_standard_deviation_is_that_of_monte_carlo():
    rng = np.random.default_rng(1)
    t_ns = stamps(rng, 400_000)
    differentiator = Differentiator(KernelSpec(2, 0, 0), window_s=0.1, step_s=0.01)
    estimates, _, gains, state, *_ = push_all(
        differentiator, t_ns, rng.normal(size=(1, len(t_ns))), np.empty((0, len(t_ns)))
    )
    good = state == Status.OK
    for n in range(3):
        assert np.sqrt(gains[n, n, -1]) == pytest.approx(estimates[0, n, good].std(), rel=0.01)


@given(seed=st.integers(0, 2**32 - 1), irregular=st.booleans(), spec=specs)
@settings(max_examples=40, deadline=None)
def test_stepping_inputs_pass_through_the_same_window_as_the_derivative(seed, irregular, spec):
    """x'' = u with u constant over each interval: the filtered u is the second derivative, steps and all."""
    rng = np.random.default_rng(seed)
    t_ns = stamps(rng, 200, jitter=0.3 if irregular else 0.0, dropout=0.1 if irregular else 0.0)
    dt = np.diff(t_ns) * 1e-9
    u = np.concatenate([[0.0], np.repeat(rng.normal(size=10), 20)[: len(dt)]])
    v = np.concatenate([[0.3], 0.3 + np.cumsum(u[1:] * dt)])
    x = np.concatenate([[0.0], np.cumsum(v[:-1] * dt + u[1:] * dt**2 / 2)])
    differentiator = Differentiator(spec, window_s=0.4, step_s=0.01, folds=(2, 1))
    mean_v = np.concatenate([[np.nan], np.diff(x) / dt])
    estimates, filtered, _, state, *_ = push_all(differentiator, t_ns, x[None], np.stack([u, mean_v]))
    good = state == Status.OK
    assert good.any()
    np.testing.assert_allclose(filtered[0, good], estimates[0, 2, good], atol=1e-7 * 5000)
    np.testing.assert_allclose(filtered[1, good], estimates[0, 1, good], atol=1e-8)


@given(
    seed=st.integers(0, 2**32 - 1),
    irregular=st.booleans(),
    cuts=st.lists(st.integers(0, 300), max_size=12),
    stop=st.integers(1, 300),
    spec=specs,
)
@settings(max_examples=60, deadline=None)
def test_chunks_change_no_bit_and_rows_depend_on_no_later_sample(seed, irregular, cuts, stop, spec):
    rng = np.random.default_rng(seed)
    t_ns = stamps(rng, 320, jitter=0.2 if irregular else 0.0, dropout=0.05 if irregular else 0.0)
    samples, inputs = rng.normal(size=(3, len(t_ns))), rng.normal(size=(2, len(t_ns)))

    def fresh():
        return Differentiator(spec, window_s=0.25, step_s=0.01, folds=(2, 1))

    whole = push_all(fresh(), t_ns, samples, inputs)
    cut = push_all(fresh(), t_ns, samples, inputs, [c for c in cuts if c < len(t_ns)])
    stop = min(stop, len(t_ns))
    prefix = push_all(fresh(), t_ns[:stop], samples[:, :stop], inputs[:, :stop])
    for a, b, c in zip(whole, cut, prefix, strict=True):
        assert np.array_equal(a, b, equal_nan=True)
        assert np.array_equal(a[..., :stop], c, equal_nan=True)


def test_nothing_is_said_before_the_window_is_full_nor_while_a_hole_lies_in_it():
    rng = np.random.default_rng(0)
    t_ns = stamps(rng, 200)
    t_ns[100:] += 300_000_000
    differentiator = Differentiator(KernelSpec(), window_s=0.4, step_s=0.01)
    estimates, _, _, state, *_ = push_all(differentiator, t_ns, rng.normal(size=(1, 200)), np.empty((0, 200)))
    assert list(np.unique(state[:40])) == [Status.WARMING_UP]
    assert list(np.unique(state[40:100])) == [Status.OK]
    assert list(np.unique(state[100:129])) == [Status.GAP]
    assert list(np.unique(state[131:])) == [Status.OK]  # a quarter of the window may be missing at its edge
    assert np.isnan(estimates[0, :, state != Status.OK]).all()
    assert np.isfinite(estimates[0, :, state == Status.OK]).all()
    assert differentiator.n_gaps == 1


def test_input_taps_weigh_a_constant_by_one():
    for theta in (0.0, 0.4, 1.0):
        taps = uniform_taps(KernelSpec(3, 1, 0, theta), 101, 0.01)
        assert input_taps(taps[1], 0.01, 1).sum() == pytest.approx(1, abs=1e-12)
        assert input_taps(taps[2], 0.01, 2).sum() == pytest.approx(1, abs=1e-10)


def test_a_window_too_short_for_its_degree_says_how_long_it_must_be():
    with pytest.raises(InvalidSetting, match=r"degree 3 needs 5 or more: lengthen the window to 0\.04 s"):
        Differentiator(KernelSpec(3), window_s=0.02, step_s=0.01)


@pytest.mark.parametrize("bad", [{"degree": -1}, {"degree": 9}, {"kappa": -1}, {"mu": 9}, {"theta": 1.5}])
def test_impossible_kernels_are_refused(bad):
    with pytest.raises(InvalidSetting, match=next(iter(bad))):
        KernelSpec(**bad)
