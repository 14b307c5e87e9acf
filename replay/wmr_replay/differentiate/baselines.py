"""Recursive differentiators to compare with, as impulse responses: Butterworth filters and a Kalman smoother.

They are linear and time-invariant: their impulse response, cut off where it has decayed, describes them
completely. The replay uses neither, for their memory has no end: a gap or an outlier stays in it.
"""

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.signal import butter, sosfilt
from scipy.special import factorial

from wmr_schemas.arrays import F64

DECAYED = 1e-9


def decayed(response: F64) -> F64 | None:
    """The response up to where all but 1e-9 of its energy has come; None when it ends before that."""
    energy = np.cumsum(response**2)
    length = int(np.searchsorted(energy, (1 - DECAYED) * energy[-1])) + 1
    return response[:length] if length < 0.9 * len(response) else None


def delay_of(taps: F64, order: int, step_s: float) -> float:
    """Delay of a differentiator at low frequency: its answer to t^{n+1}/(n+1)! is t − δ."""
    age_s = np.arange(len(taps)) * step_s
    return float(-np.sum(taps * (-age_s) ** (order + 1)) / factorial(order + 1))


def butterworth_response(order: int, poles: int, cutoff_hz: float, step_s: float, length: int) -> F64 | None:
    """Backward differences of order n behind a low-pass; None for a cut-off above .45 of the rate."""
    if not 0 < cutoff_hz * step_s < 0.45:
        return None
    impulse = np.zeros(length)
    impulse[0] = 1.0
    smooth = sosfilt(butter(poles, 2 * cutoff_hz * step_s, output="sos"), impulse)
    for _ in range(order):
        smooth = np.diff(smooth, prepend=0.0) / step_s
    return decayed(smooth)


def chain_of_integrators(size: int, step_s: float) -> tuple[F64, F64]:
    """Transition matrix and process noise (unit intensity) of white noise integrated ``size`` times."""
    transition, process = np.zeros((size, size)), np.zeros((size, size))
    for i in range(size):
        for j in range(size):
            if j >= i:
                transition[i, j] = step_s ** (j - i) / factorial(j - i)
            a, b = size - 1 - i, size - 1 - j
            process[i, j] = step_s ** (a + b + 1) / ((a + b + 1) * factorial(a) * factorial(b))
    return transition, process


def powers_on(matrix: F64, vector: F64, count: int) -> F64:
    """Columns A⁰v, A¹v, … (size, count), by doubling."""
    columns, power = vector[:, None], matrix
    while columns.shape[1] < count:
        columns, power = np.concatenate([columns, power @ columns], axis=1), power @ power
    return columns[:, :count]


def kalman_response(
    order: int, intensity: float, sigma: float, lag: int, step_s: float, length: int
) -> F64 | None:
    """Stationary fixed-lag Kalman smoother of x⁽ⁿ⁾ with white x⁽ⁿ⁺²⁾ of the given intensity, ``lag`` steps
    late.

    x̂(k−d|k) = x̂(k−d|k−d−1) + Σ_{i=0}^{d} P (Fᵀ)^i Cᵀ S⁻¹ e(k−d+i), F = A − K C (Anderson and Moore, Optimal
    Filtering, §7.3).
    """
    transition, process = chain_of_integrators(order + 2, step_s)
    observe = np.eye(order + 2)[:1]
    try:
        covariance = solve_discrete_are(transition.T, observe.T, intensity * process, np.array([[sigma**2]]))
    except np.linalg.LinAlgError:
        return None
    innovation = float(covariance[0, 0]) + sigma**2
    gain = transition @ covariance[:, 0] / innovation
    closed = transition - np.outer(gain, observe)
    predicted = np.concatenate([np.zeros((order + 2, 1)), powers_on(closed, gain, length - 1)], axis=1)
    innovations = -predicted[0]
    innovations[0] = 1.0
    weights = covariance[order] @ powers_on(closed.T, observe[0] / innovation, lag + 1)
    late = np.concatenate([np.zeros(lag), predicted[order]])[:length]
    return decayed(late + np.convolve(innovations, weights[::-1])[:length])
