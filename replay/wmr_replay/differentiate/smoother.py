"""A smooth guess at what lies behind a noisy stretch: Whittaker's smoother, its stiffness by Mallows' C_p.

Not causal: used on an initial stretch to judge candidates by, never on the road.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import BSpline, make_interp_spline
from scipy.linalg import LinAlgError, solveh_banded

from wmr_schemas.arrays import F64

STENCIL = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
"""Fourth differences are penalised: motion of constant jerk passes untouched."""
STIFFNESSES = 10.0 ** np.arange(-2.0, 20.1, 0.5)


MOST_KNOTS = 1500
"""Longer stretches are averaged in groups first, for speed and because λ grows with the eighth power of the
rate.
"""


class Smoothed(NamedTuple):
    """The guess as a spline in seconds, and what the same smoother leaves of a noise realisation."""

    signal: BSpline
    noise: BSpline


def penalty_bands(n: int) -> F64:
    """Upper bands of DᵀD for the differences D of n samples, (5, n), diagonal last (``solveh_banded``)."""
    bands = np.zeros((5, n))
    for lag in range(5):
        products = STENCIL[: 5 - lag] * STENCIL[lag:]
        ones = np.zeros(n - lag + 2 * (4 - lag))
        ones[4 - lag : 4 - lag + n - 4] = 1.0
        bands[4 - lag, lag:] = sliding_window_view(ones, 5 - lag)[: n - lag] @ products[::-1]
    return bands


def smooth(samples: F64, noise: F64, sigma: float, step_s: float) -> Smoothed:
    """The smoother (1 + λ DᵀD)⁻¹ with the λ of least C_p = mean (y − s)² + 2σ² tr/n.

    ``samples`` and ``noise`` (n,) of sd ``sigma``, n ≥ 10, every ``step_s`` from 0 on.
    """
    group = -(-len(samples) // MOST_KNOTS)
    n = len(samples) // group
    both = np.stack([samples, noise], axis=1)[: n * group].reshape(n, group, 2).mean(axis=1)
    values = stiffest_within_noise(both, sigma / np.sqrt(group))
    t_s = (np.arange(n) * group + (group - 1) / 2) * step_s
    return Smoothed(*(make_interp_spline(t_s, column, 5) for column in values.T))


def stiffest_within_noise(both: F64, sigma: float) -> F64:
    """Columns ``both`` (n, 2), smoothed as the first demands; the trace from the eigenvalues 1/(1 + λ (2
    sin(πk/2n))⁸).
    """
    n = len(both)
    bands, eigenvalues = penalty_bands(n), (2 * np.sin(np.pi * np.arange(n) / (2 * n))) ** 8
    best, chosen = np.inf, both
    for stiffness in STIFFNESSES:
        matrix = stiffness * bands
        matrix[4] += 1.0
        try:
            smoothed = solveh_banded(matrix, both)
        except LinAlgError:  # stiffer than double precision carries
            break
        trace = np.sum(1 / (1 + stiffness * eigenvalues))
        cost = float(np.mean((both[:, 0] - smoothed[:, 0]) ** 2) + 2 * sigma**2 * trace / n)
        if cost < best:
            best, chosen = cost, smoothed
    return chosen
