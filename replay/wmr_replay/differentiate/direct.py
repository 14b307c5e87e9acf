"""Weighted least squares on the actual times, each window anew: the road for kernels too steep for
``blocks``.
"""

import numpy as np
from numba import njit

from wmr_replay.differentiate.blocks import Signals
from wmr_replay.differentiate.irregular import Fit
from wmr_replay.differentiate.rowwise import factorise, solve
from wmr_schemas.arrays import F64, I64

ORDERS = 3


@njit(cache=True)
def window_taps(t_ns: I64, last: int, first: int, exponents: tuple[int, int], fit: Fit, taps: F64) -> None:
    """Fill ``taps`` (3, last − first + 1), newest first, with the functionals of the window
    ``t_ns[first..last]``.

    Moments exact for polynomials up to N on these stamps: M = Σ w u^{p+q}, h_nk = w_k Σ_p [M⁻¹ p⁽ⁿ⁾(θ)]_p
    u_kᵖ. ``exponents`` are κ and μ.
    """
    size = fit.wanted.shape[1]
    moments, solution = np.zeros((2 * size - 1, 1)), np.empty((size, 1))
    for k in range(last, first - 1, -1):
        tau = (t_ns[last] - t_ns[k]) / fit.window_ns
        term = tau ** exponents[0] * (1.0 - tau) ** exponents[1]
        for p in range(2 * size - 1):
            moments[p, 0] += term
            term *= 1.0 - 2.0 * tau
    lower, diagonal = np.empty((size, size, 1)), np.empty((size, 1))
    factorise(moments, lower, diagonal)
    for n in range(ORDERS):
        solve(lower, diagonal, fit.shares, fit.wanted[n], solution)
        for k in range(last, first - 1, -1):
            tau = (t_ns[last] - t_ns[k]) / fit.window_ns
            value = 0.0
            for p in range(size - 1, -1, -1):
                value = value * (1.0 - 2.0 * tau) + solution[p, 0]
            taps[n, last - k] = value * tau ** exponents[0] * (1.0 - tau) ** exponents[1]


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
    exponents: tuple[int, int],
    fit: Fit,
    out: tuple[F64, F64, F64],
) -> None:
    """As ``irregular.irregular_rows``, with the work of a window in each row. ``exponents`` are κ and μ."""
    estimates, filtered, gains = out
    samples, longest = signals.samples, 0
    for i in rows:
        longest = max(longest, i - first[i] + 1)
    taps = np.empty((ORDERS, longest))
    for i in rows:
        n_taps = i - first[i] + 1
        window_taps(signals.t_ns, i, first[i], exponents, fit, taps)
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
