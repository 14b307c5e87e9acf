"""Small algebra on many rows at once: the last axis runs over rows, and every operation is one pass over it.

Each row's result depends on that row alone, in a fixed order of operations.
"""

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

SINGULAR = 1e-9
"""Least pivot over its diagonal element: below it the instants do not determine the fit."""


@compiled
def add_product(out: F64, a: F64, b: F64) -> None:
    """``out += a·b``, row by row."""
    for i in range(len(out)):
        out[i] += a[i] * b[i]


@compiled
def add_scaled(out: F64, factor: float, b: F64) -> None:
    """``out += factor·b``, row by row."""
    for i in range(len(out)):
        out[i] += factor * b[i]


@compiled
def shift_moments(moments: F64, by: F64) -> None:
    """Σ sᵖ → Σ (s + by)ᵖ in place: ``moments`` (p, m), ``by`` (m,)."""
    for k in range(1, len(moments)):
        for p in range(len(moments) - 1, k - 1, -1):
            add_product(moments[p], by, moments[p - 1])


@compiled
def shift_polynomials(coefficients: F64, by: F64) -> None:
    """q(u) → q(s + by) in place: ``coefficients`` (p, m), ``by`` (m,)."""
    for k in range(len(coefficients) - 1):
        for p in range(len(coefficients) - 2, k - 1, -1):
            add_product(coefficients[p], by, coefficients[p + 1])


@compiled
def factorise(weighted: F64, lower: F64, diagonal: F64) -> None:
    """M = L D Lᵀ of M_pq = ``weighted[p + q]``, row by row: ``lower`` (k, k, m) holds −L, ``diagonal`` (k, m)
    1/D.

    A row whose M is singular to working precision gets NaN.
    """
    scaled = np.empty_like(diagonal)
    for i in range(len(lower)):
        for j in range(i):
            scaled[j] = weighted[i + j]
            for k in range(j):
                add_product(scaled[j], lower[j, k], scaled[k])
            lower[i, j] = -scaled[j] * diagonal[j]
        pivot = weighted[2 * i].copy()
        for k in range(i):
            add_product(pivot, lower[i, k], scaled[k])
        for m in range(len(pivot)):
            diagonal[i, m] = 1.0 / pivot[m] if pivot[m] > SINGULAR * weighted[2 * i, m] else np.nan


@compiled
def solve(lower: F64, diagonal: F64, shares: F64, right: F64, out: F64) -> None:
    """``out`` (k, m) = L⁻ᵀ D⁻¹ S L⁻¹ ``right`` (k,); L⁻¹ holds orthogonal polynomials, S their shares."""
    size = len(lower)
    for i in range(size):
        out[i] = right[i]
        for k in range(i):
            add_product(out[i], lower[i, k], out[k])
    for i in range(size - 1, -1, -1):
        out[i] *= diagonal[i] * shares[i]
        for k in range(i + 1, size):
            add_product(out[i], lower[k, i], out[k])
