"""All kernels of one window and one weight at once: they are sums of the same few polynomials, so that the
guesses at a signal are convolved with these and no kernel by itself.
"""

import numpy as np

from wmr_replay.differentiate.design import KernelSpec, fit_factors
from wmr_replay.differentiate.smoother import Smoothed
from wmr_schemas.arrays import F64

ORDERS = (1, 2)


class Guesses:
    """Guesses at s signals, and what their smoothers leave of noise, on n samples every ``step_s``."""

    def __init__(self, smoothed: list[Smoothed], n: int, step_s: float) -> None:
        self.n, self.step_s, self._t_s = n, step_s, np.arange(n, dtype=np.float64) * step_s
        self._splines = [list(pair) for pair in smoothed]
        values = np.array([[spline(self._t_s) for spline in pair] for pair in self._splines])
        self._size = 1 << (n - 1).bit_length()  # what wraps around lies before the first whole window
        self._spectra = np.fft.rfft(values, self._size)
        self._slopes: dict[float, F64] = {}

    def slopes(self, delay_s: float) -> F64:
        """Derivatives at each sample's stamp − ``delay_s``, (orders, s, 2, n)."""
        key = round(delay_s, 12)
        if key not in self._slopes:
            at = self._t_s - delay_s
            self._slopes[key] = np.array(
                [[[spline(at, order) for spline in pair] for pair in self._splines] for order in ORDERS]
            )
        return self._slopes[key]

    def convolved(self, basis: F64) -> F64:
        """With each row of ``basis`` (p, L), newest first, where whole windows lie: (s, 2, p, n − L + 1)."""
        n_taps = basis.shape[1]
        product = self._spectra[:, :, None] * np.fft.rfft(basis, self._size)
        return np.asarray(np.fft.irfft(product, self._size)[..., n_taps - 1 : self.n])


class Family:
    """The kernels of up to ``spec.top_degree`` with its window, weight and reading point.

    A kernel is (orders, p) factors of the basis, p = top + 1: those of the whole fit times the degrees'
    shares.
    """

    def __init__(self, spec: KernelSpec, n_taps: int, guesses: Guesses) -> None:
        self.step_s, self.size = guesses.step_s, spec.top_degree + 1
        window_s = (n_taps - 1) * self.step_s
        age = np.arange(n_taps, dtype=np.float64) * self.step_s
        self._factors, self._basis = fit_factors(spec, age, window_s)
        self.delay_s, self.n_windows = spec.delay_s(window_s), guesses.n - n_taps + 1
        self._inner = self._basis @ self._basis.T
        self._steps = [self._ramps(order) for order in ORDERS]
        self._past = age >= self.delay_s - self.step_s / 1000
        if self.n_windows > 0:
            self._convolved = guesses.convolved(self._basis)
            self._slopes = guesses.slopes(self.delay_s)[..., n_taps - 1 :]

    def _ramps(self, order: int) -> F64:
        """Answers of the basis to tⁿ/n!, t ≥ 0, at the samples until the window is past it, by sums of sums:
        Σ_j h_j (k − j) and Σ_j h_j (k − j)²/2.
        """
        sums = [np.cumsum(self._basis, axis=1)]
        for _ in range(order):
            sums.append(np.cumsum(sums[-1], axis=1))
        late = [np.pad(total[:, :-1], ((0, 0), (1, 0))) for total in sums]
        return np.asarray(self.step_s * late[1] if order == 1 else self.step_s**2 * (late[2] - late[1] / 2))

    def kernels(self, shares: F64) -> F64:
        """The kernels of orders 0, 1, 2 with these shares (p,) of the degrees: (3, p)."""
        return self._factors * shares

    def taps(self, kernels: F64, order: int) -> F64:
        """Taps (L,) of one order, newest sample first."""
        return np.asarray(kernels[order] @ self._basis)

    def gain(self, kernels: F64, order: int) -> float:
        """Σ h² of one order: variance of the estimate for white noise of variance 1."""
        return float(kernels[order] @ self._inner @ kernels[order])

    def errors(self, kernels: F64, order: int, part: slice = slice(None)) -> F64:
        """On the guesses and on what is left of noise in them, at every window: (s, 2, windows)."""
        slopes = self._slopes[ORDERS.index(order)][:, part]
        return np.asarray(kernels[order] @ self._convolved[:, part] - slopes)

    def step_error(self, kernels: F64, order: int) -> F64:
        """Error of the derivative of order n of tⁿ/n!, t ≥ 0, at the samples until the window is past it."""
        return np.asarray(kernels[order] @ self._steps[ORDERS.index(order)] - self._past)
