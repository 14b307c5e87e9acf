"""Kernels on uniform stamps in exact rationals."""

from fractions import Fraction
from functools import lru_cache
from math import comb

import numpy as np

from wmr_replay.differentiate.design import KernelSpec
from wmr_schemas.arrays import F64

Polynomial = list[Fraction]
ORDERS = 3


def times(a: Polynomial, b: Polynomial) -> Polynomial:
    """Product of two polynomials, lowest power first."""
    out = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def solve(matrix: list[Polynomial], right: Polynomial) -> Polynomial:
    """Solution of a small regular system by Gauss–Jordan."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    n = len(rows)
    for i in range(n):
        pivot = next(k for k in range(i, n) if rows[k][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(n):
            if k != i and rows[k][i]:
                rows[k] = [x - rows[k][i] * y for x, y in zip(rows[k], rows[i], strict=True)]
    return [row[n] for row in rows]


@lru_cache(maxsize=32)
def tap_polynomials(spec: KernelSpec, n_taps: int) -> list[Polynomial]:
    """Taps as polynomials in the age m = 0 … L−1, counted in steps; order n in units of 1/stepⁿ.

    h_n(m) = m^κ (L−1−m)^μ Σ_p c_np m^p, with Σ_m h_n(m) (−m)^p = dⁿ/dsⁿ s^p at s = −δ/step for all p ≤ N.
    Degrees above N add their share of what each changes.
    """
    last = n_taps - 1
    weight: Polynomial = [Fraction(0)] * spec.kappa + [Fraction(1)]
    for _ in range(spec.mu):
        weight = times(weight, [Fraction(last), Fraction(-1)])
    top = spec.top_degree
    sums = [sum(m**p for m in range(n_taps)) for p in range(2 * top + len(weight))]
    moments = [Fraction(sum(w * sums[p + q] for q, w in enumerate(weight))) for p in range(2 * top + 1)]
    delay = last * (1 - Fraction(spec.theta)) / 2
    return [
        times(weight, blended(moments, [power_derivative(p, n, delay) for p in range(top + 1)], spec))
        for n in range(min(ORDERS, spec.degree + 1))
    ]


def blended(moments: Polynomial, wanted: Polynomial, spec: KernelSpec) -> Polynomial:
    """C of degree N, and of each higher degree the share of what it changes."""
    total, before = [Fraction(0)] * len(wanted), [Fraction(0)] * len(wanted)
    for degree in range(spec.degree, spec.top_degree + 1):
        size = degree + 1
        fit = solve([moments[p : p + size] for p in range(size)], wanted[:size])
        fit += [Fraction(0)] * (len(wanted) - size)
        share = Fraction(float(spec.all_shares[degree]))
        total = [t + share * (new - old) for t, new, old in zip(total, fit, before, strict=True)]
        before = fit
    return total


def power_derivative(power: int, order: int, age: Fraction) -> Fraction:
    """n-th derivative by time of agᵖ, where age runs against time."""
    if order > power:
        return Fraction(0)
    factor = Fraction((-1) ** order)
    for i in range(order):
        factor *= power - i
    return factor * age ** (power - order)


def to_long(value: Fraction) -> np.longdouble:
    """The nearest number in extended precision to a rational."""
    high = float(value)
    return np.longdouble(high) + np.longdouble(float(value - Fraction(high)))


def anchored_taps(spec: KernelSpec, n_taps: int, step_s: float) -> F64:
    """Taps about an anchor: ``out[n, p, r]`` (3, D+1, L), D = N + κ + μ.

    For a window that ends r samples behind the anchor the tap of the sample k steps from the anchor is
    Σ_p out[n, p, r] (k/(L−1))^p.
    """
    polynomials = tap_polynomials(spec, n_taps)
    n_powers = len(polynomials[0])
    r = np.arange(n_taps, dtype=np.longdouble)
    out = np.empty((len(polynomials), n_powers, n_taps))
    for n, polynomial in enumerate(polynomials):
        long = [to_long(c) for c in polynomial]
        for p in range(n_powers):
            total = np.zeros_like(r)
            for q in range(n_powers - 1, p - 1, -1):
                total = total * r + long[q] * comb(q, p)
            scale = np.longdouble(-(n_taps - 1)) ** p / np.longdouble(step_s) ** n
            out[n, p] = (total * scale).astype(np.float64)
    return out
