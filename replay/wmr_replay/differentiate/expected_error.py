"""Expected error of a linear differentiator on a stretch of a signal.

The noise follows from the taps: σ² Σ h². The bias needs the true derivative, which is unknown: a smooth guess
stands in for it (``smoother``). Noise that is left in the guess adds to the apparent bias. A realisation of
noise through the same smoother measures that part, which is subtracted.
"""

from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.differentiate.design import KernelSpec, uniform_taps
from wmr_replay.differentiate.smoother import smooth
from wmr_schemas.arrays import F64

MIN_ROWS = 20
SHARE_LIMIT = 2.5
SEED = 20090706


def convolved(signal: F64, taps: F64) -> F64:
    """Σ_k taps[k]·signal[i − k] where all of it lies within the signal."""
    size = 1 << (len(signal) + len(taps) - 2).bit_length()
    spectrum = np.fft.rfft(signal, size) * np.fft.rfft(taps, size)
    return np.fft.irfft(spectrum, size)[len(taps) - 1 : len(signal)]


@dataclass(frozen=True)
class Expectation:
    """Expected error of differentiator ``label`` in units of the derivative: noise ``sd`` and ``bias``."""

    label: str
    delay_s: float
    sd: float
    bias: float
    spec: KernelSpec | None = None
    window_s: float | None = None

    @property
    def rmse(self) -> float:
        """Root mean square error, √(sd² + bias²)."""
        return float(np.hypot(self.sd, self.bias))


class ErrorModel:
    """Expected error of any linear differentiator on a stretch (n,), sampled every ``step_s``, noise of sd
    ``sigma``.
    """

    def __init__(self, signal: F64, sigma: float, order: int, step_s: float) -> None:
        noise = np.random.default_rng(SEED).standard_normal(len(signal))
        (guess,) = smooth(signal[None] - signal[0], noise, np.array([sigma]), step_s)
        self.order, self.step_s, self.sigma, self.n = order, step_s, sigma, len(signal)
        self._t_s = np.arange(len(signal), dtype=np.float64) * step_s
        self._splines = list(guess)
        self._guesses = [spline(self._t_s) for spline in guess]

    def expect(
        self,
        taps: F64,
        delay_s: float,
        label: str,
        spec: KernelSpec | None = None,
        window_s: float | None = None,
    ) -> Expectation | None:
        """None when fewer than 20 windows fit into the stretch."""
        if self.n - len(taps) + 1 < MIN_ROWS:
            return None
        squares = [float(np.mean(self._errors(k, taps, delay_s) ** 2)) for k in (0, 1)]
        bias = float(np.sqrt(max(squares[0] - squares[1], 0.0)))
        sd = float(self.sigma * np.sqrt(np.sum(taps**2)))
        return Expectation(label, delay_s, sd, bias, spec, window_s)

    def _errors(self, k: int, taps: F64, delay_s: float) -> F64:
        """Error on the guess (k = 0) or on what is left of noise in it (k = 1) at every window."""
        at = self._t_s[len(taps) - 1 :] - delay_s
        return np.asarray(convolved(self._guesses[k], taps) - self._splines[k](at, self.order))

    def residuals(self, taps: F64, delay_s: float) -> F64:
        """A vector whose squared norm is bias² + σ² Σ h², linear in ``taps``: for least squares."""
        errors = self._errors(0, taps, delay_s)
        return np.concatenate([errors / np.sqrt(len(errors)), self.sigma * taps])

    def best_shares(self, base: KernelSpec, n_taps: int, n_extra: int) -> tuple[float, ...]:
        """Shares of the next ``n_extra`` degrees that minimise bias² + σ² Σ h²."""
        delay_s = base.delay_s((n_taps - 1) * self.step_s)
        nested = nested_taps(base, n_taps, self.step_s, n_extra)
        return least_shares(np.stack([self.residuals(taps[self.order], delay_s) for taps in nested]))


def nested_taps(base: KernelSpec, n_taps: int, step_s: float, n_extra: int) -> list[F64]:
    """Taps (3, L) of the degrees N, N + 1, … N + ``n_extra``, each whole."""
    specs = (replace(base, degree=base.degree + k) for k in range(n_extra + 1))
    return [uniform_taps(spec, n_taps, step_s) for spec in specs]


def least_shares(residuals: F64) -> tuple[float, ...]:
    """Shares by which the steps between the rows of ``residuals`` (k + 1, m) shorten its first row most."""
    shares, *_ = np.linalg.lstsq(np.diff(residuals, axis=0).T, -residuals[0], rcond=1e-9)
    return tuple(float(share) for share in np.clip(shares, -SHARE_LIMIT, SHARE_LIMIT))
