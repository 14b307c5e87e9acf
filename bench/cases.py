"""Test signals with known derivatives, and their sampling stamps."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, I64

STEP_S = 0.01
N_ROWS = 20_000
DELAY_S = 0.14
SWITCH_S = 3.0

Signal = Callable[[F64, int], F64]
"""x⁽ⁿ⁾(t) for t (n,) in s and n = 0, 1, 2."""


def three_sines(t_s: F64, order: int) -> F64:
    """.2, .5 and .9 Hz, amplitudes 1, .5, .25."""
    radps = 2 * np.pi * np.array([[0.2], [0.5], [0.9]])
    amplitudes = np.array([1.0, 0.5, 0.25]) * radps[:, 0] ** order
    return np.asarray(amplitudes @ np.sin(radps * t_s + order * np.pi / 2))


def chirp(t_s: F64, order: int) -> F64:
    """A sine whose frequency oscillates between .1 and .9 Hz."""
    swing = 2 * np.pi * 0.05
    phase = 2 * np.pi * (0.5 * t_s - 0.4 * np.sin(swing * t_s) / swing)
    rate = 2 * np.pi * (0.5 - 0.4 * np.cos(swing * t_s))
    if order == 0:
        return np.asarray(np.sin(phase))
    if order == 1:
        return np.asarray(rate * np.cos(phase))
    return np.asarray(2 * np.pi * 0.4 * swing * np.sin(swing * t_s) * np.cos(phase) - rate**2 * np.sin(phase))


def steps_of_logistic(t_s: F64, order: int) -> F64:
    """Logistic steps of one metre every 4 s, each about a second long."""
    total = np.zeros_like(t_s)
    for centre in np.arange(2.0, t_s[-1] + 4, 4.0):
        y = 1 / (1 + np.exp(-np.clip((t_s - centre) / 0.15, -60, 60)))
        slope = y * (1 - y)
        total += (y, slope / 0.15, slope * (1 - 2 * y) / 0.15**2)[order]
    return total


def switching(t_s: F64, order: int) -> F64:
    """An acceleration of −1.5, 0 or 1.5 that switches every 3 s, as at a change of contact mode."""
    levels = np.random.default_rng(11).permutation([-1.5, 0.0, 1.5] * 40)
    k = np.minimum((t_s / SWITCH_S).astype(int), len(levels) - 1)
    since = t_s - k * SWITCH_S
    speed = np.concatenate([[0.0], np.cumsum(levels) * SWITCH_S])
    place = np.concatenate([[0.0], np.cumsum(speed[:-1] * SWITCH_S + levels * SWITCH_S**2 / 2)])
    if order == 0:
        return np.asarray(place[k] + speed[k] * since + levels[k] * since**2 / 2)
    return np.asarray(speed[k] + levels[k] * since if order == 1 else levels[k])


SIGNALS: dict[str, Signal] = {
    "three sines": three_sines,
    "chirp": chirp,
    "logistic steps": steps_of_logistic,
    "switching": switching,
}


@dataclass(frozen=True, eq=False)
class Realisation:
    """A noisy signal on its stamps, and its true derivative ``DELAY_S`` before each stamp."""

    t_ns: I64
    noisy: F64
    truth: F64
    sigma: float
    order: int

    @property
    def scored(self) -> slice:
        """Rows from the third second on, where every window is full."""
        return slice(300, None)

    def head(self, n: int) -> "Realisation":
        """The first n rows."""
        return Realisation(self.t_ns[:n], self.noisy[:n], self.truth[:n], self.sigma, self.order)

    def rmse(self, estimate: F64) -> float:
        """Root mean square error; infinite if an estimate is missing."""
        error = (estimate - self.truth)[self.scored]
        return float(np.sqrt(np.mean(error**2))) if np.isfinite(error).all() else float("inf")


def realise(signal: Signal, order: int, sigma: float, irregular: bool, seed: int) -> Realisation:
    """A realisation sampled at 100 Hz, with 10 % jitter and 5 % dropouts if ``irregular``."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(N_ROWS) * STEP_S
    if irregular:
        t_s = (t_s + 0.1 * STEP_S * rng.standard_normal(N_ROWS))[rng.random(N_ROWS) >= 0.05]
        t_s = np.sort(t_s - t_s[0])
    t_ns = np.unique(np.round(t_s * 1e9).astype(np.int64))
    t_s = t_ns * 1e-9
    noisy = signal(t_s, 0) + sigma * rng.standard_normal(len(t_s))
    return Realisation(10**18 + t_ns, noisy, signal(np.maximum(t_s - DELAY_S, 0), order), sigma, order)
