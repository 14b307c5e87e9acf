"""Kernels: published figures, a peer's kernels, exact moments, delay, integrals, response."""

import warnings
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from scipy.integrate import quad

from wmr_replay.differentiate import (
    KernelSpec,
    best_noise_coefficient,
    continuous_kernel,
    efficiency,
    folded_kernel,
    frequency_response,
    noise_coefficient,
    root_theta,
    uniform_taps,
)
from wmr_replay.differentiate.exact import anchored_taps, tap_polynomials
from wmr_replay.differentiate.uniform import anchor_powers
from wmr_schemas.errors import InvalidSetting


@pytest.mark.parametrize(
    ("n", "degree", "kappa", "mu", "delay", "c", "own", "next_degree"),
    [
        (1, 1, 0, 0, 0.5, 12, 1, 1),
        (1, 2, 0, 0, 0.2764, 48, 1, 1),
        (1, 2, 0, 1, 0.2265, 81.3, 0.81, 1),
        (1, 2, 1, 1, 0.311, 57.1, 0.66, 0.75),
        (1, 2, 2, 2, 0.3333, 78.3, 0.41, 0.57),
        (2, 2, 0, 0, 0.5, 720, 1, 1),
        (2, 3, 0, 0, 0.311, 4320, 1, 1),
        (2, 3, 1, 1, 0.3333, 5701, 0.62, 0.69),
    ],
)
def test_delay_noise_and_efficiency_are_those_of_the_literature(
    n, degree, kappa, mu, delay, c, own, next_degree
):
    spec = KernelSpec(degree, kappa, mu, root_theta(n, KernelSpec(degree, kappa, mu)))
    assert spec.delay_s(1.0) == pytest.approx(delay, abs=6e-5)
    assert noise_coefficient(n, spec) == pytest.approx(c, rel=1e-3)
    assert efficiency(n, spec) == pytest.approx(own, abs=0.005)
    assert efficiency(n, spec, degree + 1) == pytest.approx(next_degree, abs=0.005)


def test_kernels_are_those_of_algdiff():
    """α = κ + n, β = μ + n, N_A = N − n; AlgDiff computes them by another formula."""
    peer = pytest.importorskip("AlgDiff").AlgebraicDifferentiator
    age = np.linspace(0.007, 0.693, 51)
    n_cases = 0
    for n, extra, kappa, mu in product(range(5), range(4), range(4), range(4)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            theirs = peer(ts=0.01, alpha=kappa + n, beta=mu + n, N=extra, T=0.7, display=False)
            for theta in (1.0, 0.2, root_theta(n, KernelSpec(n + extra, kappa, mu))):
                theirs.set_theta(theta, False)
                expected = theirs.evalKernelDer(age, n)
                ours = continuous_kernel(n, KernelSpec(n + extra, kappa, mu, theta), 0.7, age)
                assert np.max(np.abs(ours - expected)) <= 1e-12 * np.max(np.abs(expected))
                n_cases += 1
    assert n_cases == 960


@pytest.mark.parametrize("theta", [0.0, 0.4, 1.0])
def test_the_continuous_kernel_answers_polynomials_with_their_delayed_derivative(theta):
    for n, degree, kappa, mu in [(0, 2, 0, 0), (1, 1, 0, 0), (1, 3, 1, 2), (2, 4, 0, 1), (3, 3, 2, 2)]:
        spec, window_s = KernelSpec(degree, kappa, mu, theta), 0.8
        x = np.polynomial.Polynomial(np.arange(1.0, degree + 2))
        estimate, _ = quad(
            lambda age, n=n, spec=spec, x=x: float(continuous_kernel(n, spec, 0.8, np.array(age))) * x(-age),
            0,
            window_s,
        )
        assert estimate == pytest.approx(x.deriv(n)(-spec.delay_s(window_s)), rel=1e-9)


@pytest.mark.parametrize(
    "spec",
    [
        KernelSpec(2),
        KernelSpec(3, 1, 0, 0.3),
        KernelSpec(5, 2, 2, 1.0),
        KernelSpec(8),
        KernelSpec(2, shares=(0.4, 2.0)),
    ],
)
def test_taps_have_exact_discrete_moments(spec):
    step_s, n_taps = 0.002, 101
    taps, delay_s = uniform_taps(spec, n_taps, step_s), spec.delay_s(100 * step_s)
    age = np.arange(n_taps) * step_s
    for n in range(3):
        for power in range(spec.degree + 1):
            x = np.polynomial.Polynomial.basis(power)
            terms = taps[n] * x(-age)
            error = abs(terms.sum() - x.deriv(n)(-delay_s))
            assert error <= 1e-12 * np.abs(terms).sum()


def test_exact_taps_are_those_of_the_orthogonal_decomposition():
    shared = KernelSpec(2, 0, 1, 0.5, (1.5, 0.3))
    for spec, n_taps in [
        (KernelSpec(2), 51),
        (KernelSpec(3, 1, 1), 40),
        (KernelSpec(5, 0, 0, 0.5), 200),
        (shared, 90),
    ]:
        taps = uniform_taps(spec, n_taps, 1.0)
        for n, polynomial in enumerate(tap_polynomials(spec, n_taps)):
            exact = [
                float(sum(c * Fraction(m) ** p for p, c in enumerate(polynomial))) for m in range(n_taps)
            ]
            np.testing.assert_allclose(taps[n], exact, rtol=0, atol=1e-12 * np.max(np.abs(exact)))


def test_taps_about_an_anchor_are_the_taps_wherever_the_window_stands():
    spec, n_taps = KernelSpec(3, 1, 1, 0.2, (0.5,)), 64
    taps, anchored = uniform_taps(spec, n_taps, 0.01), anchored_taps(spec, n_taps, 0.01)
    powers = anchor_powers(n_taps, anchored.shape[1])
    for r in (0, 1, 31, 63):
        steps = np.arange(r, r - n_taps, -1) + n_taps
        found = anchored[:, :, r] @ powers[:, steps]
        assert np.max(np.abs(found - taps) / np.max(np.abs(taps), axis=1, keepdims=True)) < 1e-11


def test_delay_is_correct_to_a_nanosecond():
    """On a ramp of slope 1 the estimate of order 0 is t − δ, on a parabola that of order 1."""
    for spec in (
        KernelSpec(2),
        KernelSpec(3, 1, 2, 0.37),
        KernelSpec(2, 0, 1, -0.2),
        KernelSpec(4, theta=1.0),
    ):
        step_s, n_taps = 0.001, 501
        taps, age = uniform_taps(spec, n_taps, step_s), np.arange(n_taps) * step_s
        delay_s = spec.delay_s((n_taps - 1) * step_s)
        assert -(taps[0] @ -age) == pytest.approx(delay_s, abs=1e-9)
        assert -(taps[1] @ (age**2 / 2)) == pytest.approx(delay_s, abs=1e-9)


def test_integrated_kernels_filter_an_input_as_its_derivative_is():
    spec, window_s = KernelSpec(3, 1, 0, 0.3), 0.5
    for order, fold in ((1, 1), (2, 1), (2, 2)):
        estimate, _ = quad(
            lambda a, o=order, f=fold: (
                float(folded_kernel(o, spec, window_s, np.array(a), f)) * np.cos(3 * a)
            ),
            0,
            window_s,
        )
        x = {1: lambda a: -np.sin(3 * a) / 3, 2: lambda a: -np.cos(3 * a) / 9}[
            fold
        ]  # xᶠ = cos(3 t), t = −age
        direct, _ = quad(
            lambda a, o=order, x=x: float(continuous_kernel(o, spec, window_s, np.array(a))) * x(a),
            0,
            window_s,
        )
        assert estimate == pytest.approx(direct, abs=1e-9)


def test_frequency_response_is_that_of_a_sine_sent_through():
    taps, step_s = uniform_taps(KernelSpec(3), 101, 0.01)[1], 0.01
    response = frequency_response(taps, step_s, np.array([0.8]))[0]
    t = np.arange(1000) * step_s
    out = np.convolve(np.exp(2j * np.pi * 0.8 * t), taps, "valid")
    np.testing.assert_allclose(out, response * np.exp(2j * np.pi * 0.8 * t[100:]), atol=1e-10)


def test_no_kernel_of_a_degree_has_less_noise_than_the_bound():
    for theta, kappa, mu in product((0.0, 0.5, 1.0), range(3), range(3)):
        for n, degree in ((0, 2), (1, 2), (2, 4)):
            assert efficiency(n, KernelSpec(degree, kappa, mu, theta)) <= 1 + 1e-9
    assert best_noise_coefficient(1, 1, 0.0) == pytest.approx(12)


def test_orders_and_folds_out_of_range_are_refused():
    with pytest.raises(InvalidSetting, match="order must be 0 to the degree 2, not 3"):
        continuous_kernel(3, KernelSpec(2), 1.0, np.zeros(1))
    with pytest.raises(InvalidSetting, match="folds 0 to 1 times, not 2"):
        folded_kernel(1, KernelSpec(2), 1.0, np.zeros(1), 2)
