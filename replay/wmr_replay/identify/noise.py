"""Noise of the pose from its own third differences: an initial stretch, then row by row."""

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64, I64, Bool

MAD_TO_SD = 1.4826
CLIPPED_SQUARE = 0.9950072780344535
"""E[min(z², 9)] of a standard normal z."""


def third_differences(samples: F64) -> F64:
    """(x₃ − 3x₂ + 3x₁ − x₀)/√20 along the last axis: the sd of white noise survives, motion up to
    acceleration does not.
    """
    newest, newer, older, oldest = samples[..., 3:], samples[..., 2:-1], samples[..., 1:-2], samples[..., :-3]
    return np.asarray((newest - 3 * newer + 3 * older - oldest) / np.sqrt(20.0))


def initial_noise(samples: F64) -> float:
    """Robust sd of white noise on smooth signals (k, n): median absolute third difference, pooled over k."""
    third = third_differences(samples) if samples.shape[-1] > 3 else np.zeros(0)
    return float(MAD_TO_SD * np.median(np.abs(third))) if third.size else 0.0


@njit(cache=True)
def clipped_mean_square(third: F64, usable: Bool, gain: float, variance: float) -> F64:
    """s² ← s² + g·(min(d², 9 s²)/b − s²) over the rows of ``third`` (k, n); s² at each row, (n,)."""
    out = np.empty(third.shape[1])
    for i in range(third.shape[1]):
        if usable[i]:
            total = 0.0
            for k in range(third.shape[0]):
                total += min(third[k, i] ** 2, 9.0 * variance)
            variance += gain * (total / (third.shape[0] * CLIPPED_SQUARE) - variance)
        out[i] = variance
    return out


class NoiseTracker:
    """Variances of position and yaw noise at each row, from rows up to it; differences over irregular steps
    are passed over.
    """

    def __init__(
        self, *, position_sd_m: float, yaw_sd_rad: float, step_s: float, time_constant_s: float
    ) -> None:
        self._variances = [position_sd_m**2, yaw_sd_rad**2]
        self._step_ns, self._gain = step_s * 1e9, min(1.0, step_s / time_constant_s)
        self._t_ns, self._pose = np.empty(0, np.int64), np.empty((3, 0))

    def push(self, t_ns: I64, pose: F64) -> F64:
        """``pose`` (3, n) is x, y, yaw; returns (2, n), m² and rad²."""
        n = len(t_ns)
        t = np.concatenate([self._t_ns, t_ns])
        samples = np.concatenate([self._pose, pose], axis=1)
        regular = np.abs(np.diff(t) - self._step_ns) <= 0.2 * self._step_ns
        usable, third = np.zeros(n, bool), np.zeros((3, n))
        whole = len(t) - 3
        if whole > 0:
            usable[n - whole :] = regular[2:] & regular[1:-1] & regular[:-2]
            third[:, n - whole :] = third_differences(samples)
        self._t_ns, self._pose = t[-3:], samples[:, -3:]
        return np.stack([self._follow(0, third[:2], usable), self._follow(1, third[2:], usable)])

    def _follow(self, channel: int, third: F64, usable: Bool) -> F64:
        track = clipped_mean_square(third, usable, self._gain, self._variances[channel])
        if track.size:
            self._variances[channel] = float(track[-1])
        return track
