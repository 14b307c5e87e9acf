"""Kernels of the causal algebraic differentiator: parameters, delay, and taps with exact discrete moments.

Sources: Mboup, Join, Fliess, "Numerical differentiation with annihilators in noisy environment" (2009);
Othmane, Kiltz, Rudolph, "Survey on algebraic numerical differentiation" (2022). The annihilator-based
estimator of order n and degree N with parameters κ, μ over a window T is weighted least squares of degree N
with weight τ^κ(1−τ)^μ, τ = age/T, whose n-th derivative is taken at the age δ = T(1−θ)/2. All orders share
one θ here, so that they describe one instant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting


@dataclass(frozen=True)
class KernelSpec:
    """Degree N, weight exponents κ and μ, evaluation point θ in [−1, 1] (0: the window's middle; 1: now).

    ``shares``, if any, are what the kernel takes of the degrees N + 1, N + 2, …: 0 leaves a degree out,
    1 takes it as least squares does, and what lies between trades bias for noise. Exactness stays at N.
    """

    degree: int = 2
    kappa: int = 0
    mu: int = 0
    theta: float = 0.0
    shares: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.degree <= 8:
            raise InvalidSetting(f"degree must be 0 to 8, not {self.degree}")
        if self.top_degree > 8 or not np.isfinite(self.shares).all():
            raise InvalidSetting(f"shares must be finite and reach degree 8 at most, not {self.shares}")
        if min(self.kappa, self.mu) < 0 or max(self.kappa, self.mu) > 8:
            raise InvalidSetting(f"kappa and mu must be 0 to 8, not {self.kappa} and {self.mu}")
        if not -1 <= self.theta <= 1:
            raise InvalidSetting(f"theta must lie in -1 to 1, not {self.theta}")

    @property
    def top_degree(self) -> int:
        """The highest degree that has a share."""
        return self.degree + len(self.shares)

    @property
    def all_shares(self) -> F64:
        """Shares of the degrees 0 to the top: 1 up to N."""
        return np.array([1.0] * (self.degree + 1) + list(self.shares))

    def delay_s(self, window_s: float) -> float:
        """δ = T(1 − θ)/2 for the window T = ``window_s``."""
        return window_s * (1 - self.theta) / 2


def root_theta(order: int, spec: KernelSpec) -> float:
    """The largest root of P_{q+1}^{(κ+n, μ+n)}, q = N − n: at it one more order of exactness is gained."""
    from scipy.special import jacobi  # noqa: PLC0415 – a fifth of a second, and no run needs it

    polynomial = jacobi(spec.degree - order + 1, spec.kappa + order, spec.mu + order)
    return float(np.max(polynomial.roots.real))


def fit_functionals(spec: KernelSpec, age: F64, window_s: float, orders: int = 3) -> F64:
    """Taps (orders, L): the derivative of order n of the fit over samples of these ages is taps[n] @ samples.

    Weighted least squares in the Legendre basis by QR: with V_ki = P_i(u_k), u = 1 − 2·age/T, W =
    diag(τ^κ(1−τ)^μ), h_n = W V (VᵀWV)⁻¹ p⁽ⁿ⁾(θ)·(2/T)ⁿ; the columns of Q are orthogonal polynomials, one a
    degree, and take their shares. Exact for polynomials up to N on any stamps. ``age`` (L,) in s,
    ``window_s`` = T.
    """
    factors, basis = fit_factors(spec, age, window_s, orders)
    return np.ascontiguousarray(factors * spec.all_shares @ basis)


def fit_factors(spec: KernelSpec, age: F64, window_s: float, orders: int = 3) -> tuple[F64, F64]:
    """What :func:`fit_functionals` is a product of: factors (orders, p) by degree, before their shares, and
    the basis (p, L), orthogonal polynomials times the weight.
    """
    tau = age / window_s
    root_weight = np.sqrt(tau**spec.kappa * (1 - tau) ** spec.mu)
    q, r = np.linalg.qr(root_weight[:, None] * legendre.legvander(1 - 2 * tau, spec.top_degree))
    rows = [np.linalg.solve(r.T, basis_derivative(spec, n) * (2 / window_s) ** n) for n in range(orders)]
    return np.stack(rows), q.T * root_weight


def basis_derivative(spec: KernelSpec, order: int) -> F64:
    """n-th derivatives of P_0 … P_top at θ, by (i + 1) P_{i+1} = (2i + 1) θ P_i − i P_{i−1} and P⁽ⁿ⁾_{i+1} =
    P⁽ⁿ⁾_{i−1} + (2i + 1) P⁽ⁿ⁻¹⁾_i.
    """
    top, theta = spec.top_degree, spec.theta
    values = [1.0, theta]
    for i in range(1, top):
        values.append(((2 * i + 1) * theta * values[i] - i * values[i - 1]) / (i + 1))
    for _ in range(order):
        slopes = [0.0, values[0]]
        for i in range(1, top):
            slopes.append(slopes[i - 1] + (2 * i + 1) * values[i])
        values = slopes
    return np.array(values[: top + 1])


def uniform_taps(spec: KernelSpec, n_taps: int, step_s: float) -> F64:
    """Taps (3, L) on uniform stamps, newest sample first; the window is T = (L − 1)·step."""
    return fit_functionals(spec, np.arange(n_taps, dtype=np.float64) * step_s, (n_taps - 1) * step_s)


def input_taps(taps: F64, step_s: float, fold: int) -> F64:
    """Taps (L,) for the mean inputs of the intervals that end at the samples: the fold-times integrated
    kernel.

    An input u with x⁽ᶠ⁾ = u makes Σ_k h_k x(t_k) = ∫ g(s) u(s) ds with g(s) = Σ_k h_k (t_k −
    s)₊^{f−1}/(f−1)!. For an input that is constant over each interval (t_k − step, t_k] this is exact: out[k]
    = ∫ g over that interval. Newest first; the oldest interval lies before the window and has weight 0.
    ``fold`` is 1 or 2.
    """
    once = np.cumsum(taps)
    if fold == 1:
        return np.append(once[:-1] * step_s, 0.0)
    g = np.concatenate([[0.0], np.cumsum(once)[:-1]]) * step_s
    return np.append((g[:-1] + g[1:]) / 2 * step_s, 0.0)
