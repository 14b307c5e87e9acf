"""Noise level of each signal, tracked from the data up to each row.

Every four neighbours give one number free of motion up to constant acceleration: their third divided
difference on the actual stamps, scaled so that white noise keeps its standard deviation. Its squares, clipped
at nine times the current variance so that outliers and mode switches count little, are averaged with a time
constant.
"""

import math

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.clipping import clipped_update
from wmr_schemas.compiled.lean import lean

MAD_TO_SD = 1.4826
UNIFORM = 20**-0.5
"""1/√(1 + 3² + 3² + 1): of the differences 1, −3, 3, −1 on uniform stamps."""
HOLE_IN_STEPS = 3.5
"""Four neighbours that span more than 3 × 3.5 steps are passed over: motion would show in them."""
LEAST_SD = 1e-12


@lean
def third_difference(t_ns: I64, last: int) -> tuple[float, float, float]:
    """Weights of x − x_last at the samples last − 3 … last − 1: Σ c_k t_kᵖ = 0 for p ≤ 2 and Σ c_k² = 1."""
    ab, bc, cd = t_ns[last - 2] - t_ns[last - 3], t_ns[last - 1] - t_ns[last - 2], t_ns[last] - t_ns[last - 1]
    if ab == bc and bc == cd:
        return -UNIFORM, 3.0 * UNIFORM, -3.0 * UNIFORM
    whole = float(ab + bc + cd)
    p, q, r = ab / whole, bc / whole, cd / whole
    a, b = -1.0 / (p * (p + q)), 1.0 / (p * q * (q + r))
    c, d = -1.0 / ((p + q) * q * r), 1.0 / ((q + r) * r)
    size = math.sqrt(a * a + b * b + c * c + d * d)
    return a / size, b / size, c / size


@lean
def track_variances(
    t_ns: I64, samples: F64, n_old: int, step_ns: float, gain: float, variances: F64, out: F64
) -> None:
    """s² ← s² + g (min(d², 9 s²)/b − s²) row by row from ``n_old`` on; ``out`` ← s² (s, n) at these rows.

    ``samples`` (s, n), ``variances`` (s,) are carried on in place.
    """
    n_signals, longest_ns = len(samples), 3 * HOLE_IN_STEPS * step_ns
    for i in range(n_old, len(t_ns)):
        if i >= 3 and t_ns[i] - t_ns[i - 3] <= longest_ns:
            a, b, c = third_difference(t_ns, i)
            for s in range(n_signals):
                x, last, variance = samples[s], samples[s, i], variances[s]
                difference = a * (x[i - 3] - last) + b * (x[i - 2] - last) + c * (x[i - 1] - last)
                square = difference * difference
                if math.isfinite(square):
                    variances[s] = max(clipped_update(variance, square, gain), LEAST_SD**2)
        for s in range(n_signals):
            out[s, i - n_old] = variances[s]


@lean
def third_differences(t_ns: I64, signal: F64, out: F64) -> None:
    """``out`` ← third differences, scaled as :func:`third_difference` says, from the fourth sample on."""
    for i in range(len(out)):
        a, b, c = third_difference(t_ns, i + 3)
        last = signal[i + 3]
        out[i] = a * (signal[i] - last) + b * (signal[i + 1] - last) + c * (signal[i + 2] - last)


def robust_sigma(t_ns: I64, signal: F64) -> float:
    """Robust sd of the noise on a stretch (n,): the scaled median of |d|; 0 for fewer than four samples.

    A signal quantised more coarsely than its noise has a median of 0; the root mean square is given then.
    """
    differences = np.empty(max(len(signal) - 3, 0))
    third_differences(np.ascontiguousarray(t_ns), np.ascontiguousarray(signal, np.float64), differences)
    sizes = np.abs(differences[np.isfinite(differences)])
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
        track = np.empty((len(held), len(t_ns)))
        track_variances(t, held, n_old, self._step_ns, self._gain, self._variances, track)
        self._t_ns, self._samples = t[-3:], held[:, -3:]
        return np.asarray(np.sqrt(track))
