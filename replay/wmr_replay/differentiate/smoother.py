"""A smooth guess at what lies behind a noisy stretch: Whittaker's smoother, its stiffness by Mallows' C_p.

Not causal: it rates candidate designs on a stretch, and no result is computed from it.
"""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from wmr_replay.differentiate.quintic import Quintic, through
from wmr_schemas.arrays import F64
from wmr_schemas.lapack import routines

STENCIL = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
"""Fourth differences are penalised: motion of constant jerk passes untouched."""
STIFFNESSES = 10.0 ** np.arange(-2.0, 20.1, 0.5)


MOST_KNOTS = 1500
"""Longer stretches are averaged in groups first, for speed and because λ grows with the eighth power of the
rate.
"""


class Smoothed(NamedTuple):
    """The guess as a spline in seconds, and what the same smoother leaves of a noise realisation."""

    signal: Quintic
    noise: Quintic


def penalty_bands(n: int) -> F64:
    """Upper bands of DᵀD for the differences D of n samples, (5, n), diagonal last (LAPACK's ``dpbsv``)."""
    bands = np.zeros((5, n))
    for lag in range(5):
        products = STENCIL[: 5 - lag] * STENCIL[lag:]
        ones = np.zeros(n - lag + 2 * (4 - lag))
        ones[4 - lag : 4 - lag + n - 4] = 1.0
        bands[4 - lag, lag:] = sliding_window_view(ones, 5 - lag)[: n - lag] @ products[::-1]
    return bands


def smooth(signals: F64, noise: F64, sigma: F64, step_s: float) -> list[Smoothed]:
    """The smoother (1 + λ DᵀD)⁻¹ with the λ of least C_p = mean (y − s)² + 2σ² tr/n, one λ for each signal.

    ``signals`` (s, n) of noise ``sigma`` (s,), and ``noise`` (n,), a realisation of sd 1; n ≥ 10, every
    ``step_s`` from 0 on.
    """
    group = -(-len(noise) // MOST_KNOTS)
    n = len(noise) // group
    columns = np.vstack([signals, noise])[:, : n * group].reshape(-1, n, group).mean(axis=2).T
    t_s = (np.arange(n, dtype=np.float64) * group + (group - 1) / 2) * step_s
    chosen = stiffest_within_noise(columns, sigma / np.sqrt(group))
    splines = [through(t_s, both) for both in chosen]
    return [
        Smoothed(signal, unit.scaled(level)) for (signal, unit), level in zip(splines, sigma, strict=True)
    ]


def stiffest_within_noise(columns: F64, sigma: F64) -> F64:
    """Signals (n, s) of noise ``sigma`` (s,), and in the last column a realisation of noise: (s, n, 2), each
    signal smoothed as it demands, the noise with it.

    The trace comes from the eigenvalues 1/(1 + λ (2 sin(πk/2n))⁸).
    """
    dpbsv = routines("_flapack").dpbsv
    n, signals = len(columns), columns[:, :-1]
    bands, eigenvalues = penalty_bands(n), (2 * np.sin(np.pi * np.arange(n) / (2 * n))) ** 8
    chosen = np.stack([columns[:, np.array([s, -1])] for s in range(len(sigma))])
    best = np.full(len(sigma), np.inf)
    for stiffness in STIFFNESSES:
        matrix = stiffness * bands
        matrix[4] += 1.0
        _, smoothed, failed = dpbsv(matrix, columns)
        if failed:  # stiffer than double precision carries
            break
        trace = np.sum(1 / (1 + stiffness * eigenvalues))
        cost = np.mean((signals - smoothed[:, :-1]) ** 2, axis=0) + 2 * sigma**2 * trace / n
        for s in np.flatnonzero(cost < best):
            best[s], chosen[s] = cost[s], smoothed[:, np.array([s, -1])]
    return chosen
