"""The corrected equation (10) in exact rationals."""

from fractions import Fraction
from itertools import product
from math import comb, factorial

import numpy as np
import pytest

from wmr_replay.differentiate import KernelSpec, kernel_polynomial
from wmr_replay.differentiate.design import fit_functionals

COMBINATIONS = [
    (n, N, kappa, mu) for n in range(5) for N in range(n, n + 4) for kappa, mu in product(range(5), repeat=2)
]


def moment(kernel, power):
    """∫₀¹ kernel(τ) (−τ)^p dτ: the estimate on x(s) = s^p about s = 0."""
    return sum(c * Fraction((-1) ** power, q + power + 1) for q, c in enumerate(kernel))


def test_corrected_equation_10_is_exact_on_polynomials_up_to_its_degree():
    assert len(COMBINATIONS) == 500
    for n, N, kappa, mu in COMBINATIONS:
        kernel = kernel_polynomial(n, N, kappa, mu)
        estimates = [moment(kernel, p) for p in range(N + 1)]
        assert estimates == [Fraction(factorial(n)) if p == n else Fraction(0) for p in range(N + 1)], (
            n,
            N,
            kappa,
            mu,
        )


def printed(n, N, kappa, mu, power):
    """(10) as printed, on x = τ^p."""
    nu = N + 1 + mu
    a = Fraction((-1) ** (n + kappa) * factorial(nu + n + kappa), factorial(n + kappa) * factorial(N - n))
    total = Fraction(0)
    for i in range(N - n + 1):
        b = comb(N - n, i) * Fraction(factorial(N + 1), factorial(n + i + 1))
        for j in range(max(0, kappa - i), n + kappa + 1):
            c = comb(n + kappa, j) * Fraction(factorial(n + i), factorial(i + j - kappa))
            rest = nu + kappa - i - j - 1
            beta = Fraction(factorial(rest) * factorial(i + j + power), factorial(rest + i + j + power + 1))
            total += a * b * c * (-1) ** (i + j) * beta
    return total


def test_equation_10_as_printed_is_wrong():
    assert [printed(2, 2, 0, 0, p) for p in range(3)] == [20, 5, 4]
    wrong = sum(
        any(
            printed(*combination, p) != (factorial(p) if p == combination[0] else 0)
            for p in range(combination[1] + 1)
        )
        for combination in COMBINATIONS
    )
    assert wrong == 480


def test_corrected_equation_10_is_weighted_least_squares_at_the_newest_instant():
    n_taps = 4001
    age = np.linspace(0, 1, n_taps)
    for N, kappa, mu in [(2, 0, 0), (3, 1, 2), (4, 2, 1)]:
        taps = fit_functionals(KernelSpec(N, kappa, mu, theta=1.0), age, 1.0) * (n_taps - 1)
        for n in range(3):
            kernel = np.polynomial.polynomial.polyval(
                age, [float(c) for c in kernel_polynomial(n, N, kappa, mu)]
            )
            assert np.max(np.abs(taps[n] - kernel)[5:-5]) < 0.01 * np.max(np.abs(kernel))


@pytest.mark.parametrize("bad", [(2, 1, 0, 0), (-1, 0, 0, 0), (1, 1, -1, 0), (1, 1, 0, -1)])
def test_impossible_orders_are_refused(bad):
    with pytest.raises(ValueError, match="need 0 <= n <= N"):
        kernel_polynomial(*bad)
