"""Noise level of each signal, tracked from the data up to each row.

Every four neighbours give one number free of motion up to constant acceleration: their third divided
difference on the actual stamps, scaled so that white noise keeps its standard deviation. Its squares, clipped
at nine times the current variance so that outliers and mode switches count little, are averaged with a time
constant.
"""

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64, I64, NS_PER_S

MAD_TO_SD = 1.4826
CLIPPED_SQUARE = 0.9950072780344535
"""E[min(z², 9)] of a standard normal z."""
HOLE_IN_STEPS = 3.5
"""Four neighbours that span more than 3 × 3.5 steps are passed over: motion would show in them."""
LEAST_SD = 1e-12


@njit(cache=True)
def third_difference(t_ns: I64, signal: F64, last: int) -> float:
    """Σ c_k x_k over ``last − 3 … last`` with Σ c_k t_kᵖ = 0 for p ≤ 2 and Σ c_k² = 1."""
    total, squares = 0.0, 0.0
    for k in range(last - 3, last + 1):
        product = 1.0
        for m in range(last - 3, last + 1):
            if m != k:
                product *= (t_ns[k] - t_ns[m]) / (t_ns[last] - t_ns[last - 3])
        total += (signal[k] - signal[last]) / product
        squares += 1.0 / (product * product)
    return float(total / np.sqrt(squares))


@njit(cache=True)
def track_variance(t_ns: I64, signal: F64, n_old: int, step_ns: float, gain: float, variance: float) -> F64:
    """s² ← s² + g (min(d², 9 s²)/b − s²) row by row from ``n_old`` on; s² at each of these rows."""
    out = np.empty(len(t_ns) - n_old)
    for i in range(n_old, len(t_ns)):
        if i >= 3 and t_ns[i] - t_ns[i - 3] <= 3 * HOLE_IN_STEPS * step_ns:
            square = third_difference(t_ns, signal, i) ** 2
            if np.isfinite(square):
                variance += gain * (min(square, 9.0 * variance) / CLIPPED_SQUARE - variance)
                variance = max(variance, LEAST_SD**2)
        out[i - n_old] = variance
    return out


@njit(cache=True)
def third_differences(t_ns: I64, signal: F64) -> F64:
    """:func:`third_difference` at every sample from the fourth on."""
    out = np.empty(max(len(signal) - 3, 0))
    for i in range(len(out)):
        out[i] = third_difference(t_ns, signal, i + 3)
    return out


def robust_sigma(t_ns: I64, signal: F64) -> float:
    """Robust sd of the noise on a stretch (n,): the scaled median of |d|; 0 for fewer than four samples.

    A signal quantised more coarsely than its noise has a median of 0; the root mean square is given then.
    """
    sizes = np.abs(third_differences(t_ns, np.ascontiguousarray(signal, np.float64)))
    sizes = sizes[np.isfinite(sizes)]
    if not sizes.size:
        return 0.0
    level = MAD_TO_SD * float(np.median(sizes))
    return level if level > 0 else float(np.sqrt(np.mean(sizes**2)))


class NoiseTracker:
    """Stage: standard deviations (s, n) at each row, from rows up to it. ``sigma`` (s,) is where to begin."""

    def __init__(self, sigma: F64, *, step_s: float, time_constant_s: float = 5.0) -> None:
        self._variances = np.maximum(np.asarray(sigma, np.float64), LEAST_SD) ** 2
        self._step_ns, self._gain = step_s * NS_PER_S, min(1.0, step_s / time_constant_s)
        self._t_ns, self._samples = np.empty(0, np.int64), np.empty((len(self._variances), 0))

    def push(self, t_ns: I64, samples: F64) -> F64:
        """Rows of strictly increasing stamps, ``samples`` (s, n)."""
        n_old = len(self._t_ns)
        t = np.concatenate([self._t_ns, t_ns])
        held = np.concatenate([self._samples, samples], axis=1)
        tracks = [
            track_variance(t, signal, n_old, self._step_ns, self._gain, variance)
            for signal, variance in zip(held, self._variances, strict=True)
        ]
        if len(t_ns):
            self._variances = np.array([track[-1] for track in tracks])
        self._t_ns, self._samples = t[-3:], held[:, -3:]
        return np.sqrt(np.stack(tracks)) if tracks else np.empty((0, len(t_ns)))
