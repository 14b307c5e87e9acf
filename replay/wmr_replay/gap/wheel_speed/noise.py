"""Errors of the unrolled path: white noise of the pose, and slip velocities that are integrated.

    covariance(tᵢ, tⱼ) = s² δᵢⱼ + q² min(tᵢ, tⱼ) + OU²(tᵢ, tⱼ) + a free start

for each of ahead, left and yaw, with OU the integral of an Ornstein–Uhlenbeck process of standard deviation σ
and time τ. Bins are evenly spaced, so that every block has the same matrix, and a shorter block its leading
part, whose Cholesky factor is the leading part of the whole one.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from wmr_replay.gap.settings.wheel_speed import FitSettings
from wmr_replay.gap.wheel_speed.bins import Bins
from wmr_schemas.arrays import F64

START_SHARE = 1e3
"""Standard deviation of a block's free start in those of everything else. Numerics."""


class Noise(NamedTuple):
    """One channel: white sd of a bin [m or rad], random walk [m/√s], slip velocity sd [m/s], its time [s]."""

    white: float
    walk: float
    slip: float
    time_s: float

    @property
    def density(self) -> float:
        """Slip velocity's density at low frequency, (m/s)/√Hz: √(q² + 2σ²τ)."""
        return float(np.sqrt(self.walk**2 + 2 * self.slip**2 * self.time_s))

    @property
    def without_slip(self) -> "Noise":
        """The same without a slip velocity."""
        return self._replace(slip=0.0)


def covariance(noise: Noise, step_s: float, n: int) -> F64:
    """Covariance (n, n) of a block's bins."""
    t = step_s * np.arange(n)
    earlier, apart = np.minimum.outer(t, t), np.abs(np.subtract.outer(t, t))
    tau = noise.time_s
    fading = np.exp(-t / tau)
    ou = tau * (2 * earlier - tau * (1 - fading[:, None] - fading[None, :] + np.exp(-apart / tau)))
    found = noise.white**2 * np.eye(n) + noise.walk**2 * earlier + noise.slip**2 * ou
    return np.asarray(found + START_SHARE**2 * found[-1, -1])


class Whitening(NamedTuple):
    """Cholesky factor (B, B) of one channel."""

    factor: F64

    @classmethod
    def of(cls, noise: Noise, bins: Bins) -> "Whitening":
        """For the blocks of ``bins``. Raises LinAlgError where the covariance is singular."""
        return cls(
            np.asarray(np.linalg.cholesky(covariance(noise, bins.step_s, bins.table.shape[1])), np.float64)
        )

    def __call__(self, blocks: F64, bins: Bins) -> F64:
        """Whitened blocks (…, K, B); 0 behind the end of a block and at its free start."""
        flat = blocks.reshape(-1, blocks.shape[-1])
        white = solve_triangular(self.factor, flat.T, lower=True, check_finite=False).T
        out = np.where(bins.inside, white.reshape(blocks.shape), 0.0)
        out[..., 0] = 0.0
        return out

    def log_determinant(self, bins: Bins) -> float:
        """Σ log of the diagonal over all blocks, without their free starts."""
        logs = np.log(np.diag(self.factor))
        return float((bins.inside[:, 1:] * logs[1:]).sum())


def deviance(errors: F64, clip: float, reject: float) -> F64:
    """Huber's −log likelihood of whitened errors, constant beyond ``reject``."""
    if np.isinf(clip):
        return errors**2 / 2
    size = np.minimum(np.abs(errors), reject)
    return np.where(size < clip, size**2 / 2, clip * size - clip**2 / 2)


def weights_of(errors: F64, clip: float, reject: float) -> F64:
    """Weights of whitened errors in least squares."""
    if np.isinf(clip):
        return np.ones_like(errors)
    size = np.abs(errors)
    return np.where(size < clip, 1.0, np.where(size < reject, clip / np.maximum(size, clip), 0.0))


def fit_noise(errors: F64, bins: Bins, settings: FitSettings, start: Noise | None = None) -> Noise:
    """The noise of one channel by maximum likelihood; ``errors`` (K, B) are measured − predicted."""
    first = start or rough(errors, bins)
    scale = max(first.white, 1e-6)

    def objective(logs: F64) -> float:
        try:
            whitening = Whitening.of(noise_from(logs), bins)
        except np.linalg.LinAlgError:
            return 1e12
        white = whitening(errors, bins)
        return float(deviance(white, settings.clip, settings.reject).sum()) + whitening.log_determinant(bins)

    at = np.log([max(v, 1e-3 * scale) for v in first])
    simplex = np.vstack([at, *(at + (0.7 if start is None else 0.3) * np.eye(4))])
    found = minimize(
        objective,
        at,
        method="Nelder-Mead",
        options={
            "initial_simplex": simplex,
            "maxfev": settings.noise_evaluations // (1 if start is None else 3),
            "xatol": 0.05,
            "fatol": 0.2,
        },
    )
    return noise_from(found.x)


def noise_from(logs: F64) -> Noise:
    """Noise of logarithms; the time between 0.2 and 5 s."""
    white, walk, slip, time_s = np.exp(np.clip(logs, -20.0, 5.0))
    return Noise(float(white), float(walk), float(slip), float(np.clip(time_s, 0.2, 5.0)))


def rough(errors: F64, bins: Bins) -> Noise:
    """A first guess: white noise from second differences, slip from what is left over a second."""
    second = np.diff(errors, 2, axis=1)[bins.inside[:, 2:]]
    white = float(np.median(np.abs(second))) / 0.6745 / np.sqrt(6)
    lag = max(1, min(round(1.0 / bins.step_s), errors.shape[1] - 1))
    far = (errors[:, lag:] - errors[:, :-lag])[bins.inside[:, lag:]]
    spread = float(np.median(np.abs(far))) / 0.6745 / np.sqrt(lag * bins.step_s) if far.size else white
    white = max(white, 1e-6)
    return Noise(white, max(spread / 2, 1e-5), max(spread / 2, 1e-5), 1.0)
