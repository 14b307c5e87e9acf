"""Irregular stamps: weighted least squares on the actual times of each window, constant work per row.

The fit needs Σ w uᵖ and Σ w uᵖ x with u = 1 − 2·age/T. Both are binomial combinations of moments about the
block's anchor (see ``blocks``), for the weight w = τ^κ(1−τ)^μ is itself a polynomial in u.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial import polynomial

from wmr_replay.differentiate.blocks import (
    block_rows,
    centred_samples,
    integrated_input,
    moments_about_head,
)
from wmr_replay.differentiate.design import KernelSpec
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool

SINGULAR = 1e-9
"""Least pivot over its diagonal element: below it the instants do not determine the fit."""


class Fit(NamedTuple):
    """Constants of the fit: ``weight`` the coefficients of w in u; ``wanted`` (3, N+1) derivatives of uᵖ at θ."""

    weight: F64
    wanted: F64
    window_ns: int


def make_fit(spec: KernelSpec, window_ns: int) -> Fit:
    """The fit of a kernel: τ = (1 − u)/2, 1 − τ = (1 + u)/2, d/dt = (2/T) d/du."""
    old, new = polynomial.polypow([0.5, -0.5], spec.kappa), polynomial.polypow([0.5, 0.5], spec.mu)
    powers = np.eye(spec.degree + 1)
    rate = 2 * NS_PER_S / window_ns
    wanted = [[rate**n * polynomial.polyval(spec.theta, polynomial.polyder(p, n)) for p in powers] for n in range(3)]
    return Fit(np.atleast_1d(polynomial.polymul(old, new)), np.array(wanted), window_ns)


@njit(cache=True)
def shift_moments(moments: F64, by: float) -> None:
    """Σ sᵖ → Σ (s + by)ᵖ, in place."""
    for k in range(1, len(moments)):
        for p in range(len(moments) - 1, k - 1, -1):
            moments[p] += by * moments[p - 1]


@njit(cache=True)
def shift_polynomial(coefficients: F64, by: float) -> None:
    """q(u) → q(s + by), in place."""
    for k in range(len(coefficients) - 1):
        for p in range(len(coefficients) - 2, k - 1, -1):
            coefficients[p] += by * coefficients[p + 1]


@njit(cache=True)
def cholesky(weighted: F64, factor: F64) -> bool:
    """Lower ``factor`` (m, m) of the matrix M_pq = weighted[p + q]; false when it is singular to working precision."""
    for i in range(factor.shape[0]):
        for j in range(i + 1):
            total = weighted[i + j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j and not total > SINGULAR * weighted[2 * i]:
                return False
            factor[i, j] = np.sqrt(total) if i == j else total / factor[j, j]
    return True


@njit(cache=True)
def solve_cholesky(factor: F64, right: F64, out: F64) -> None:
    """``out`` = M⁻¹ ``right``."""
    size = factor.shape[0]
    for i in range(size):
        total = right[i]
        for k in range(i):
            total -= factor[i, k] * out[k]
        out[i] = total / factor[i, i]
    for i in range(size - 1, -1, -1):
        total = out[i]
        for k in range(i + 1, size):
            total -= factor[k, i] * out[k]
        out[i] = total / factor[i, i]


@njit(cache=True)
def window_kernels(moments: F64, fit: Fit, kernels: F64) -> bool:
    """Kernels (3, D+1) as polynomials in u, from the moments Σ uᵖ, p = 0 … 2D, of a window; false: too few instants.
    """
    n_weight, size = len(fit.weight), fit.wanted.shape[1]
    weighted, factor, solution = np.zeros(2 * size - 1), np.empty((size, size)), np.empty(size)
    for p in range(2 * size - 1):
        for q in range(n_weight):
            weighted[p] += fit.weight[q] * moments[p + q]
    if not cholesky(weighted, factor):
        return False
    kernels[:] = 0.0
    for n in range(kernels.shape[0]):
        solve_cholesky(factor, fit.wanted[n], solution)
        for q in range(n_weight):
            for p in range(size):
                kernels[n, p + q] += fit.weight[q] * solution[p]
    return True


@njit(cache=True)
def covariances(kernels: F64, moments: F64, out: F64, row: int) -> None:
    """``out[a, b, row]`` = Σ_k h_a h_b."""
    n_orders, n_powers = kernels.shape
    for a in range(n_orders):
        for b in range(a + 1):
            total = 0.0
            for p in range(n_powers):
                for q in range(n_powers):
                    total += kernels[a, p] * kernels[b, q] * moments[p + q]
            out[a, b, row] = total
            out[b, a, row] = total


class Block(NamedTuple):
    """Running moments of a block about its anchor, columns from sample ``low`` on."""

    anchor_ns: int
    low: int
    head: int
    of_time: F64
    of_signals: F64


@njit(cache=True)
def block_moments(
    t_ns: I64, samples: F64, inputs: F64, folds: I64, window_ns: int, n_powers: int, bounds: tuple[int, int, int, int]
) -> Block:
    """Moments Σ sᵖ (2D+1, span) and Σ sᵖ x (signals, D+1, span) with s = 2 (t − anchor)/T.

    ``bounds``: anchor in ns, first sample needed, first sample of the block, and the one behind its last.
    """
    anchor_ns, low, head, stop = bounds
    n_signals, n_inputs, span = samples.shape[0], inputs.shape[0], stop - low
    powers, dt_s = np.ones((2 * n_powers - 1, span)), np.zeros(stop)
    for j in range(low, stop):
        if j > low:
            dt_s[j] = (t_ns[j] - t_ns[j - 1]) * 1e-9
        for p in range(1, 2 * n_powers - 1):
            powers[p, j - low] = powers[p - 1, j - low] * 2.0 * (t_ns[j] - anchor_ns) / window_ns
    local = np.empty((n_signals + n_inputs, span))
    centred_samples(samples, low, head, stop, local)
    for k in range(n_inputs):
        integrated_input(inputs[k], dt_s, folds[k], low, head, stop, local[n_signals + k])
    of_time, of_signals = np.empty_like(powers), np.empty((n_signals + n_inputs, n_powers, span))
    moments_about_head(np.ones(span), powers, head - low, of_time)
    for s in range(n_signals + n_inputs):
        moments_about_head(local[s], powers[:n_powers], head - low, of_signals[s])
    return Block(anchor_ns, low, head, of_time, of_signals)


@njit(cache=True)
def weigh_window(kernel: F64, of_signal: F64, block: Block, row: int, first: int) -> float:
    """Σ_k h_k y_k over the window ``first … row``."""
    total = 0.0
    for p in range(len(kernel)):
        moment = of_signal[p, row - block.low]
        if first < block.head:
            moment += of_signal[p, first - block.low]
        total += kernel[p] * moment
    return total


@njit(cache=True)
def window_kernels_about(block: Block, row: int, first: int, shift: float, fit: Fit, raw: F64, kernels: F64) -> bool:
    """Fill ``raw``, the moments Σ uᵖ, and ``kernels`` of one window."""
    for p in range(len(raw)):
        raw[p] = block.of_time[p, row - block.low]
        if first < block.head:
            raw[p] += block.of_time[p, first - block.low]
    shift_moments(raw, shift)
    return window_kernels(raw, fit, kernels)


@njit(cache=True)
def irregular_rows(
    t_ns: I64,
    samples: F64,
    inputs: F64,
    folds: I64,
    grid: tuple[int, int],
    first: I64,
    wanted: Bool,
    fit: Fit,
    out: tuple[F64, F64, F64],
) -> None:
    """Fill the columns with ``wanted`` of ``out``: estimates (s, 3, n), filtered inputs (k, n), gains (3, 3, n).

    All arrays run over the buffer of n samples; the window of row i is ``t_ns[first[i]..i]``. ``grid`` is (first
    stamp of the log, block length) in ns. Rows whose instants do not determine the fit stay as they are.
    """
    estimates, filtered, gains = out
    n_signals, n_powers = samples.shape[0], fit.wanted.shape[1] + len(fit.weight) - 1
    kernels, raw = np.empty((3, n_powers)), np.empty(2 * n_powers - 1)
    stop = 0
    block = Block(0, 0, 0, np.empty((0, 0)), np.empty((0, 0, 0)))
    for i in range(len(t_ns)):
        if not wanted[i]:
            continue
        if i >= stop:
            anchor_ns, head, stop = block_rows(t_ns, i, grid[0], grid[1])
            bounds = (anchor_ns, min(first[i], head), head, stop)
            block = block_moments(t_ns, samples, inputs, folds, fit.window_ns, n_powers, bounds)
        shift = 1.0 - 2.0 * (t_ns[i] - block.anchor_ns) / fit.window_ns
        if not window_kernels_about(block, i, first[i], shift, fit, raw, kernels):
            continue
        covariances(kernels, raw, gains, i)
        for n in range(3):
            shift_polynomial(kernels[n], shift)
            for s in range(n_signals):
                estimates[s, n, i] = weigh_window(kernels[n], block.of_signals[s], block, i, first[i])
        for s in range(n_signals):
            estimates[s, 0, i] += samples[s, block.head]
        for k in range(len(folds)):
            kernel = kernels[folds[k]]
            filtered[k, i] = weigh_window(kernel, block.of_signals[n_signals + k], block, i, first[i])
