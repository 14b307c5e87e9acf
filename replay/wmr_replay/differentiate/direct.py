"""Weighted least squares on the actual times, solved for each window by itself: the backend for kernels that
are too steep for ``blocks``.
"""

import numpy as np

from wmr_replay.differentiate.blocks import Signals
from wmr_replay.differentiate.irregular import Fit
from wmr_replay.differentiate.rowwise import factorise, solve
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled

ORDERS = 3


@compiled
def inner_product(a: F64, b: F64) -> float:
    """Σ a_k b_k, in eight sums side by side: one fixed order, and the processor need not wait for each."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    whole = len(a) // 8 * 8
    for k in range(0, whole, 8):
        s0 += a[k] * b[k]
        s1 += a[k + 1] * b[k + 1]
        s2 += a[k + 2] * b[k + 2]
        s3 += a[k + 3] * b[k + 3]
        s4 += a[k + 4] * b[k + 4]
        s5 += a[k + 5] * b[k + 5]
        s6 += a[k + 6] * b[k + 6]
        s7 += a[k + 7] * b[k + 7]
    for k in range(whole, len(a)):
        s0 += a[k] * b[k]
    return ((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7))


@compiled
def weights_at(t_ns: I64, exponents: tuple[int, int], window_ns: int, place: F64, weight: F64) -> None:
    """Places u = 1 − 2 τ and weights w = τ^κ (1 − τ)^μ at the stamps of a window, (n,) each, oldest first."""
    for k in range(len(t_ns)):
        tau = (t_ns[-1] - t_ns[k]) / window_ns
        place[k], weight[k] = 1.0 - 2.0 * tau, 1.0
        for _ in range(exponents[0]):
            weight[k] *= tau
        for _ in range(exponents[1]):
            weight[k] *= 1.0 - tau


@compiled
def window_taps(place: F64, weight: F64, fit: Fit, term: F64, taps: F64) -> None:
    """Fill ``taps`` (3, n) with the functionals of a window, from ``weights_at``; ``term`` (n,) is scratch.

    Moments exact for polynomials up to N on these stamps: M = Σ w u^{p+q}, h_nk = w_k Σ_p [M⁻¹ p⁽ⁿ⁾(θ)]_p
    u_kᵖ.
    """
    size = fit.wanted.shape[1]
    moments, solution = np.empty((2 * size - 1, 1)), np.empty((size, 1))
    term[:] = 1.0
    for p in range(2 * size - 1):
        moments[p, 0] = inner_product(weight, term)
        for k in range(len(term)):
            term[k] *= place[k]
    lower, diagonal = np.empty((size, size, 1)), np.empty((size, 1))
    factorise(moments, lower, diagonal)
    for n in range(ORDERS):
        solve(lower, diagonal, fit.shares, fit.wanted[n], solution)
        row = taps[n]
        row[:] = 0.0
        for p in range(size - 1, -1, -1):
            coefficient = solution[p, 0]
            for k in range(len(row)):
                row[k] = row[k] * place[k] + coefficient
        for k in range(len(row)):
            row[k] *= weight[k]


@compiled
def filtered_input(taps: F64, t_ns: I64, means: F64, fold: int) -> float:
    """∫ g(s) u(s) ds with the fold-times integrated kernel and interval means u, see ``design.input_taps``.

    All (n,), oldest first; ``means[k]`` is the input over (t_ns[k − 1], t_ns[k]].
    """
    once, g, total = 0.0, 0.0, 0.0
    for k in range(len(taps) - 1, 0, -1):
        step = (t_ns[k] - t_ns[k - 1]) * 1e-9
        once += taps[k]
        if fold == 1:
            total += once * step * means[k]
        else:
            total += (g + 0.5 * once * step) * step * means[k]
            g += once * step
    return total


@compiled
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
    for i in rows:
        low, stop = first[i], i + 1
        taps, scratch = np.empty((ORDERS, stop - low)), np.empty((3, stop - low))
        place, weight, centred = scratch[0], scratch[1], scratch[2]
        t_ns = signals.t_ns[low:stop]
        weights_at(t_ns, exponents, fit.window_ns, place, weight)
        window_taps(place, weight, fit, centred, taps)
        for a in range(ORDERS):
            for b in range(a + 1):
                gains[a, b, i] = gains[b, a, i] = inner_product(taps[a], taps[b])
        for s in range(len(signals.samples)):
            newest = signals.samples[s, i]
            centred[:] = signals.samples[s, low:stop] - newest
            for a in range(ORDERS):
                estimates[s, a, i] = inner_product(taps[a], centred) + (newest if a == 0 else 0.0)
        for k in range(len(signals.inputs)):
            fold = signals.folds[k]
            filtered[k, i] = filtered_input(taps[fold], t_ns, signals.inputs[k, low:stop], fold)
