"""Irregular stamps: weighted least squares on the actual times of each window, constant work per row.

The fit needs Σ w uᵖ and Σ w uᵖ x with u = 1 − 2·age/T. Both are binomial combinations of moments about the
block's anchor (see ``blocks``), for the weight w = τ^κ(1−τ)^μ is itself a polynomial in u.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from wmr_replay.differentiate.blocks import (
    Signals,
    block_of,
    centred_samples,
    integrated_input,
    moments_about_head,
)
from wmr_replay.differentiate.design import KernelSpec
from wmr_replay.differentiate.rowwise import (
    add_product,
    add_scaled,
    factorise,
    shift_moments,
    shift_polynomials,
    solve,
)
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.compiled import compiled


class Fit(NamedTuple):
    """Constants of the fit: ``weight`` the coefficients of w in u; ``wanted`` (3, N+1) derivatives of uᵖ at
    θ.
    """

    weight: F64
    wanted: F64
    shares: F64
    window_ns: int


def make_fit(spec: KernelSpec, window_ns: int) -> Fit:
    """The fit of a kernel: τ = (1 − u)/2, 1 − τ = (1 + u)/2, d/dt = (2/T) d/du."""
    old, new = polynomial.polypow([0.5, -0.5], spec.kappa), polynomial.polypow([0.5, 0.5], spec.mu)
    powers = np.eye(spec.top_degree + 1)
    rate = 2 * NS_PER_S / window_ns
    wanted = [
        [rate**n * polynomial.polyval(spec.theta, polynomial.polyder(p, n)) for p in powers] for n in range(3)
    ]
    return Fit(np.atleast_1d(polynomial.polymul(old, new)), np.array(wanted), spec.all_shares, window_ns)


@compiled
def kernels_of(moments: F64, fit: Fit) -> F64:
    """Kernels (3, D+1, m) as polynomials in u, from the moments Σ uᵖ, (2D+1, m), of m windows."""
    n_weight, size, n_rows = len(fit.weight), fit.wanted.shape[1], moments.shape[1]
    weighted = np.zeros((2 * size - 1, n_rows))
    for p in range(2 * size - 1):
        for q in range(n_weight):
            add_scaled(weighted[p], fit.weight[q], moments[p + q])
    lower, diagonal = np.empty((size, size, n_rows)), np.empty((size, n_rows))
    factorise(weighted, lower, diagonal)
    solution, kernels = np.empty((size, n_rows)), np.zeros((3, size + n_weight - 1, n_rows))
    for n in range(3):
        solve(lower, diagonal, fit.shares, fit.wanted[n], solution)
        for q in range(n_weight):
            for p in range(size):
                add_scaled(kernels[n, p + q], fit.weight[q], solution[p])
    return kernels


@compiled
def covariances(kernels: F64, moments: F64) -> F64:
    """Σ_k h_a h_b of each row, (3, 3, m)."""
    n_powers, n_rows = kernels.shape[1:]
    out, inner = np.zeros((3, 3, n_rows)), np.empty((n_powers, n_rows))
    for a in range(3):
        inner[:] = 0.0
        for p in range(n_powers):
            for q in range(n_powers):
                add_product(inner[p], kernels[a, q], moments[p + q])
        for b in range(a + 1):
            for p in range(n_powers):
                add_product(out[a, b], kernels[b, p], inner[p])
            out[b, a] = out[a, b]
    return out


@compiled
def powers_about(t_ns: I64, anchor_ns: int, window_ns: int, n_powers: int) -> F64:
    """Σ-ready powers (2 (t − anchor)/T)^p, (n_powers, n)."""
    powers = np.ones((n_powers, len(t_ns)))
    for j in range(len(t_ns)):
        place = 2.0 * (t_ns[j] - anchor_ns) / window_ns
        for p in range(1, n_powers):
            powers[p, j] = powers[p - 1, j] * place
    return powers


@compiled
def gather(running: F64, split: int, first: I64, last: I64) -> F64:
    """Moments (p, m) of the windows ``first … last`` out of those of the two sides."""
    out = np.empty((len(running), len(last)))
    for p in range(len(running)):
        side = running[p]
        for i in range(len(last)):
            out[p, i] = side[last[i]] + (side[first[i]] if first[i] < split else 0.0)
    return out


@compiled
def weigh(kernel: F64, moments: F64) -> F64:
    """Σ_k h_k y_k of each row, (m,)."""
    total = np.zeros(kernel.shape[1])
    for p in range(len(kernel)):
        add_product(total, kernel[p], moments[p])
    return total


@compiled
def put(values: F64, rows: I64, out: F64) -> None:
    """Scatter: ``out[rows] = values``, both (m,)."""
    for i in range(len(rows)):
        out[rows[i]] = values[i]


@compiled
def put_covariances(values: F64, rows: I64, out: F64) -> None:
    """Scatter: ``out[:, :, rows] = values``, (3, 3, m)."""
    for a in range(len(values)):
        for b in range(len(values)):
            put(values[a, b], rows, out[a, b])


@compiled
def irregular_rows(signals: Signals, first: I64, rows: I64, fit: Fit, out: tuple[F64, F64, F64]) -> None:
    """Fill the columns ``rows`` of ``out``: estimates (s, 3, n), filtered inputs (k, n), gains (3, 3, n).

    The window of row i is ``first[i] … i``. Rows whose instants do not determine the fit get NaN.
    """
    start = 0
    while start < len(rows):
        anchor_ns, head, stop = block_of(signals, rows[start])
        end = start + int(np.searchsorted(rows[start:], stop))
        bounds = (anchor_ns, min(first[rows[start]], head), head, stop)
        rows_of_block(signals, bounds, first, rows[start:end], fit, out)
        start = end


@compiled
def rows_of_block(
    signals: Signals,
    bounds: tuple[int, int, int, int],
    first: I64,
    rows: I64,
    fit: Fit,
    out: tuple[F64, F64, F64],
) -> None:
    """:func:`irregular_rows` for the rows of one block.

    ``bounds``: anchor in ns, first sample needed, the block's first, the one behind its last.
    """
    anchor_ns, low, head, stop = bounds
    t_ns, samples, inputs = signals.t_ns[low:stop], signals.samples, signals.inputs
    oldest, newest, split = first[rows] - low, rows - low, head - low
    n_powers = fit.wanted.shape[1] + len(fit.weight) - 1
    powers = powers_about(t_ns, anchor_ns, fit.window_ns, 2 * n_powers - 1)
    shift = 1.0 - powers[1][newest]
    running, local = np.empty_like(powers), np.ones(stop - low)
    moments_about_head(local, powers, split, running)
    moments = gather(running, split, oldest, newest)
    shift_moments(moments, shift)
    kernels = kernels_of(moments, fit)
    put_covariances(covariances(kernels, moments), rows, out[2])
    for n in range(3):
        shift_polynomials(kernels[n], shift)
    running = running[:n_powers]
    for s in range(len(samples)):
        centred_samples(samples[s], low, head, stop, local)
        moments_about_head(local, powers[:n_powers], split, running)
        moments = gather(running, split, oldest, newest)
        for n in range(3):
            offset = samples[s, head] if n == 0 else 0.0
            put(weigh(kernels[n], moments) + offset, rows, out[0][s, n])
    dt_s = np.zeros(stop)
    dt_s[low + 1 :] = (t_ns[1:] - t_ns[:-1]) * 1e-9
    for k in range(len(inputs)):
        integrated_input(inputs[k], dt_s, signals.folds[k], low, head, stop, local)
        moments_about_head(local, powers[:n_powers], split, running)
        put(weigh(kernels[signals.folds[k]], gather(running, split, oldest, newest)), rows, out[1][k])
