"""The interpolating spline of degree 5 with not-a-knot ends, and its derivatives.

``scipy.interpolate.make_interp_spline(t, y, 5)`` to the last bit, without its package, which takes a fifth of
a second to import. Source: de Boor, A Practical Guide to Splines (2001), chapters IX, X and XIII.
"""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.lapack import routines

DEGREE = 5


@dataclass(frozen=True, eq=False)
class Quintic:
    """Σ_j c_j B_j over the ``knots`` (m + 6,), with coefficients (m,); the end pieces go on outside."""

    knots: F64
    coefficients: F64

    def __call__(self, t: F64, order: int = 0) -> F64:
        """The derivative of this order at ``t`` (n,)."""
        piece = pieces(self.knots, t)
        bases = b_splines(self.knots, t, piece, order)
        total = np.zeros_like(t)
        for back in range(DEGREE + 1):
            total += self.coefficients[piece + back - DEGREE] * bases[back]
        return total

    def scaled(self, factor: float) -> "Quintic":
        """The spline times a factor."""
        return Quintic(self.knots, factor * self.coefficients)


def through(t: F64, values: F64) -> list[Quintic]:
    """The spline through each column of ``values`` (m, s) at the rising instants ``t`` (m,), m ≥ 6."""
    half, ends = (DEGREE + 1) // 2, DEGREE + 1
    knots = np.concatenate([np.repeat(t[0], ends), t[half:-half], np.repeat(t[-1], ends)])
    piece = pieces(knots, t)
    bands = np.zeros((3 * DEGREE + 1, len(t)))
    rows = np.arange(len(t))
    for back, base in enumerate(b_splines(knots, t, piece, 0)):
        column = piece + back - DEGREE
        bands[2 * DEGREE + rows - column, column] = base
    _, _, coefficients, info = routines("_flapack").dgbsv(DEGREE, DEGREE, bands, values)
    if info:
        raise np.linalg.LinAlgError(f"no spline through these instants (dgbsv: {info})")
    return [Quintic(knots, np.ascontiguousarray(column)) for column in coefficients.T]


def pieces(knots: F64, t: F64) -> I64:
    """The ℓ with knots[ℓ] ≤ t < knots[ℓ + 1]; the first or last piece for what lies outside."""
    inner = knots[DEGREE + 1 : -DEGREE - 1]
    return np.asarray(np.searchsorted(inner, t, side="right") + DEGREE, np.int64)


def b_splines(knots: F64, t: F64, piece: I64, order: int) -> F64:
    """Derivatives of this order of the B-splines ℓ − 5 … ℓ at ``t`` in piece ℓ, (6, n), by Cox and de Boor's
    recurrence up to degree 5 − order, and by differences from there on.
    """
    bases = np.zeros((DEGREE + 1, len(t)))
    bases[0] = 1.0
    for degree in range(1, DEGREE + 1):
        below = bases[:degree].copy()
        bases[0] = 0.0
        for n in range(1, degree + 1):
            after, before = knots[piece + n], knots[piece + n - degree]
            if degree <= DEGREE - order:
                weight = below[n - 1] / (after - before)
                bases[n - 1] += weight * (after - t)
                bases[n] = weight * (t - before)
            else:
                weight = degree * below[n - 1] / (after - before)
                bases[n - 1] -= weight
                bases[n] = weight
    return bases
