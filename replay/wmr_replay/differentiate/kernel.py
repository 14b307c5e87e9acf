"""The continuous kernel of the algebraic differentiator: shape, integrals, noise, frequency response,
efficiency.

Sources as in ``design``. With u = 1 − 2·age/T, a = κ + n, b = μ + n, q = N − n and Jacobi polynomials
P_i^{(a,b)} of squared norm ‖P_i‖² (terms of degree i + n > N take their share, see ``design.KernelSpec``):

    h(age) = 2^{2n+1} T^{−n−1} (1−u)^κ (1+u)^μ
             · Σ_{i=0}^{q} P_i^{(a,b)}(θ)/‖P_i‖² · (i+n)!/i! · P_{i+n}^{(κ,μ)}(u)
"""

from math import comb, factorial

import numpy as np
from numpy.polynomial import Polynomial, legendre

from wmr_replay.differentiate.design import KernelSpec, basis_derivative
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting


def jacobi_norm(i: int, a: int, b: int) -> float:
    """‖P_i^{(a,b)}‖² = ∫ (1−u)^a (1+u)^b P_i² du over [−1, 1]."""
    ratio = factorial(i + a) * factorial(i + b) / (factorial(i + a + b) * factorial(i))
    return 2.0 ** (a + b + 1) / (2 * i + a + b + 1) * ratio


def jacobi_values(i: int, a: int, b: int, u: F64) -> F64:
    """P_i^{(a,b)}(u), from degree to degree by the three-term recurrence, in differences of neighbours."""
    if i == 0:
        return np.ones_like(u)
    step = (a + b + 2) * (u - 1) / (2 * (a + 1))
    value = step + 1
    for k in range(1, i):
        t = 2 * k + a + b
        onward, kept = t * (t + 1) * (t + 2) * (u - 1), 2 * k * (k + b) * (t + 2)
        step = (onward * value + kept * step) / (2 * (k + a + 1) * (k + a + b + 1) * t)
        value = step + value
    return comb(i + a, i) * value


def continuous_kernel(order: int, spec: KernelSpec, window_s: float, age_s: F64) -> F64:
    """h(age) in 1/s^{n+1}: the estimate of x⁽ⁿ⁾(t − δ) is ∫₀ᵀ h(age) x(t − age) d age. Zero outside the
    window.

    Raises InvalidSetting for an order above N.
    """
    if not 0 <= order <= spec.degree:
        raise InvalidSetting(f"order must be 0 to the degree {spec.degree}, not {order}")
    u = 1 - 2 * np.asarray(age_s, np.float64) / window_s
    a, b = spec.kappa + order, spec.mu + order
    total = np.zeros_like(u)
    for i in range(spec.top_degree - order + 1):
        factor = (
            spec.all_shares[i + order]
            * jacobi_values(i, a, b, np.array(spec.theta))
            / jacobi_norm(i, a, b)
            * factorial(i + order)
            / factorial(i)
        )
        total += factor * jacobi_values(i + order, spec.kappa, spec.mu, u)
    inside = np.abs(u) <= 1
    weight = np.where(inside, (1 - u) ** spec.kappa * (1 + u) ** spec.mu, 0.0)
    return np.asarray(2.0 ** (2 * order + 1) / window_s ** (order + 1) * weight * total)


def kernel_in_age(order: int, spec: KernelSpec, window_s: float) -> Polynomial:
    """The same kernel as a polynomial in the age (s), inside the window."""
    size = spec.top_degree + spec.kappa + spec.mu + 1
    ages = window_s * (1 - np.cos(np.pi * (np.arange(size) + 0.5) / size)) / 2
    domain = [0, window_s]
    return Polynomial.fit(ages, continuous_kernel(order, spec, window_s, ages), size - 1, domain=domain)


def folded_kernel(order: int, spec: KernelSpec, window_s: float, age_s: F64, fold: int) -> F64:
    """The ``fold``-times integrated kernel g(age) = ∫₀^age (age − a)^{f−1}/(f−1)! h(a) da, 0 outside the
    window.

    With x⁽ᶠ⁾ = u the estimate is ∫ g(age) u(t − age) d age, for f ≤ n: integration by parts, whose boundary
    terms vanish because the moments of h below n do. An input so filtered lags as its derivative does.
    """
    if not 0 <= fold <= order:
        raise InvalidSetting(f"a kernel of order {order} folds 0 to {order} times, not {fold}")
    age = np.asarray(age_s, np.float64)
    inside = (age >= 0) & (age <= window_s)
    return np.asarray(np.where(inside, kernel_in_age(order, spec, window_s).integ(fold, lbnd=0)(age), 0.0))


def noise_coefficient(order: int, spec: KernelSpec) -> float:
    """C in sd = σ·√(c·step/T^{2n+1}): ∫ h² of the kernel over 1 s, by Gauss' rule (exact here)."""
    nodes, weights = legendre.leggauss(spec.top_degree + spec.kappa + spec.mu + 1)
    return float(weights @ continuous_kernel(order, spec, 1.0, (1 - nodes) / 2) ** 2 / 2)


def best_noise_coefficient(order: int, degree: int, theta: float) -> float:
    """The least c of any kernel that is exact to ``degree`` at θ: Σ_{k=n}^{M} (2k+1) [2ⁿ P_k⁽ⁿ⁾(θ)]², white
    noise.
    """
    slopes = 2.0**order * basis_derivative(KernelSpec(degree, theta=theta), order)
    return float(np.sum((2 * np.arange(degree + 1) + 1) * slopes**2))


def efficiency(order: int, spec: KernelSpec, degree: int | None = None) -> float:
    """Variance of the best unbiased estimator of ``degree`` (default: N) at the same delay, over this
    kernel's.
    """
    best = best_noise_coefficient(order, spec.degree if degree is None else degree, spec.theta)
    return best / noise_coefficient(order, spec)


def frequency_response(
    taps: F64, step_s: float, frequency_hz: F64
) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
    """Σ_k h_k e^{−i 2π f k step} of taps (L,), newest first."""
    phase = -2j * np.pi * step_s * np.multiply.outer(np.asarray(frequency_hz), np.arange(len(taps)))
    return np.asarray(np.exp(phase) @ taps)
