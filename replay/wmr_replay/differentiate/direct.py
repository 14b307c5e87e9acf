"""Weighted least squares on the actual times, each window anew: the road for kernels too steep for
``blocks``.
"""

import numpy as np
from numba import njit

from wmr_replay.differentiate.blocks import Signals
from wmr_schemas.arrays import F64, I64

ORDERS = 3


@njit(cache=True)
def powers_at(theta: float, degree: int, window_s: float) -> F64:
    """n-th derivatives by time of uᵖ at u = θ, u = 1 − 2·age/T: shape (3, N+1)."""
    out = np.zeros((ORDERS, degree + 1))
    for n in range(ORDERS):
        for p in range(n, degree + 1):
            factor = 1.0
            for m in range(n):
                factor *= (p - m) * 2.0 / window_s
            out[n, p] = factor * theta ** (p - n)
    return out


@njit(cache=True)
def window_taps(
    t_ns: I64, last: int, first: int, shape: tuple[int, int, int, float], window_ns: int, taps: F64
) -> None:
    """Fill ``taps`` (3, last − first + 1), newest first, with the functionals of the window
    ``t_ns[first..last]``.

    Moments exact for polynomials up to N on these stamps: M = Σ w u^{p+q}, h_nk = w_k Σ_p [M⁻¹ p⁽ⁿ⁾(θ)]_p
    u_kᵖ. ``shape`` is (N, κ, μ, θ).
    """
    degree, kappa, mu, theta = shape
    moments = np.zeros(2 * degree + 1)
    for k in range(last, first - 1, -1):
        tau = (t_ns[last] - t_ns[k]) / window_ns
        term = tau**kappa * (1.0 - tau) ** mu
        for p in range(2 * degree + 1):
            moments[p] += term
            term *= 1.0 - 2.0 * tau
    normal = np.empty((degree + 1, degree + 1))
    for p in range(degree + 1):
        for q in range(degree + 1):
            normal[p, q] = moments[p + q]
    coefficients = np.linalg.solve(normal, powers_at(theta, degree, window_ns * 1e-9).T.copy())
    for k in range(last, first - 1, -1):
        tau = (t_ns[last] - t_ns[k]) / window_ns
        weight = tau**kappa * (1.0 - tau) ** mu
        u = 1.0 - 2.0 * tau
        for n in range(ORDERS):
            value = 0.0
            for p in range(degree, -1, -1):
                value = value * u + coefficients[p, n]
            taps[n, last - k] = weight * value


@njit(cache=True)
def filtered_input(taps: F64, n_taps: int, t_ns: I64, last: int, means: F64, fold: int) -> float:
    """∫ g(s) u(s) ds with the fold-times integrated kernel and interval means u, see ``design.input_taps``.

    ``means[k]`` is the input over (t_ns[k − 1], t_ns[k]].
    """
    once, g, total = 0.0, 0.0, 0.0
    for m in range(n_taps - 1):
        k = last - m
        step = (t_ns[k] - t_ns[k - 1]) * 1e-9
        once += taps[m]
        if fold == 1:
            total += once * step * means[k]
        else:
            total += (g + 0.5 * once * step) * step * means[k]
            g += once * step
    return total


@njit(cache=True)
def direct_rows(
    signals: Signals,
    first: I64,
    rows: I64,
    shape: tuple[int, int, int, float],
    window_ns: int,
    out: tuple[F64, F64, F64],
) -> None:
    """As ``irregular.irregular_rows``, with the work of a window in each row. ``shape`` is (N, κ, μ, θ)."""
    estimates, filtered, gains = out
    samples, longest = signals.samples, 0
    for i in rows:
        longest = max(longest, i - first[i] + 1)
    taps = np.empty((ORDERS, longest))
    for i in rows:
        n_taps = i - first[i] + 1
        window_taps(signals.t_ns, i, first[i], shape, window_ns, taps)
        for a in range(ORDERS):
            for b in range(ORDERS):
                gains[a, b, i] = np.sum(taps[a, :n_taps] * taps[b, :n_taps])
            for s in range(len(samples)):
                total = samples[s, i] if a == 0 else 0.0
                for m in range(n_taps):
                    total += taps[a, m] * (samples[s, i - m] - samples[s, i])
                estimates[s, a, i] = total
        for k in range(len(signals.inputs)):
            fold = signals.folds[k]
            filtered[k, i] = filtered_input(taps[fold], n_taps, signals.t_ns, i, signals.inputs[k], fold)
