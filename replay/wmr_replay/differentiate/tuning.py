"""Choice of (T, N, κ, μ, shares) from a stretch of the signal: the least expected error at a bounded delay.

Noise comes from the taps: σ² Σ h². Bias needs the true derivative, which nobody has: a smooth guess stands in
for it (``smoother``), and the part of the apparent bias that is only noise left in the guess is taken off,
measured on a noise realisation sent the same way. Butterworth filters and Kalman smoothers are judged by the
same rule, so the comparison is honest: where a recursive filter expects less error, the result says so.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, product

import numpy as np
from scipy.signal import fftconvolve

from wmr_replay.differentiate.baselines import butterworth_response, delay_of, kalman_response
from wmr_replay.differentiate.design import KernelSpec, uniform_taps
from wmr_replay.differentiate.smoother import smooth
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

DEGREES = (2, 3, 4, 5)
WEIGHTS = ((0, 0), (0, 1), (1, 0), (1, 1))
WINDOWS_PER_OCTAVE = 4
LONGEST_IN_DELAYS = 8.0
MIN_ROWS = 20
N_SHARES, SHARE_LIMIT = 3, 2.5
SEED = 20090706


@dataclass(frozen=True)
class Expectation:
    """What a differentiator is expected to do on such a signal, in units of the derivative; ``label`` names
    it.
    """

    label: str
    delay_s: float
    sd: float
    bias: float
    spec: KernelSpec | None = None
    window_s: float | None = None

    @property
    def rmse(self) -> float:
        """√(sd² + bias²)."""
        return float(np.hypot(self.sd, self.bias))


@dataclass(frozen=True)
class TuningResult:
    """The choice, the candidates by expected error, and the best Butterworth and Kalman filters (None: none
    fits).
    """

    order: int
    choice: Expectation
    candidates: tuple[Expectation, ...]
    butterworth: Expectation | None
    kalman: Expectation | None

    @property
    def spec(self) -> KernelSpec:
        """Kernel of the choice."""
        assert self.choice.spec is not None
        return self.choice.spec

    @property
    def window_s(self) -> float:
        """Window of the choice."""
        assert self.choice.window_s is not None
        return self.choice.window_s


class Judge:
    """Expected error of any linear differentiator on a stretch (n,), sampled every ``step_s``, noise of sd
    ``sigma``.
    """

    def __init__(self, signal: F64, sigma: float, order: int, step_s: float) -> None:
        noise = sigma * np.random.default_rng(SEED).standard_normal(len(signal))
        guess = smooth(signal - signal[0], noise, sigma, step_s)
        self.order, self.step_s, self.sigma, self.n = order, step_s, sigma, len(signal)
        self._t_s = np.arange(len(signal)) * step_s
        self._guesses = [spline(self._t_s) for spline in guess]
        self._slopes = [spline.derivative(order) for spline in guess]

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
        return np.asarray(fftconvolve(self._guesses[k], taps, "valid") - np.asarray(self._slopes[k](at)))

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


def shared_kernels(judge: Judge, max_delay_s: float, longest_s: float) -> Iterator[tuple[KernelSpec, int]]:
    """Kernels exact to degree 2 that take of the degrees 3 to 5 what lowers the error most."""
    for base, n_taps in candidate_kernels(max_delay_s, judge.step_s, longest_s):
        roomy = judge.n - n_taps >= 2 * MIN_ROWS and n_taps >= 2 + N_SHARES + 3
        if base.degree == 2 and base.kappa == 0 and roomy:
            yield replace(base, shares=judge.best_shares(base, n_taps, N_SHARES)), n_taps


def candidate_kernels(
    max_delay_s: float, step_s: float, longest_s: float
) -> Iterator[tuple[KernelSpec, int]]:
    """Kernels and numbers of taps. Windows up to 2 δ_max are read in their middle, longer ones at δ_max."""
    octaves = np.log2(max(min(LONGEST_IN_DELAYS * max_delay_s, longest_s) / (4 * step_s), 1.0))
    sizes = 4 * 2 ** np.arange(0, octaves + 1e-9, 1 / WINDOWS_PER_OCTAVE)
    for steps in dict.fromkeys(int(size) for size in sizes):
        theta = max(0.0, 1 - 2 * max_delay_s / (steps * step_s))
        for degree, (kappa, mu) in product(DEGREES, WEIGHTS):
            if steps + 1 >= degree + 3:
                yield KernelSpec(degree, kappa, mu, theta), steps + 1


def tune(signal: F64, sigma: float, max_delay_s: float, *, step_s: float, order: int = 1) -> TuningResult:
    """The kernel with the least expected error in x⁽ⁿ⁾, n = ``order``, at a delay of ``max_delay_s`` at most.

    ``signal`` (n,), sampled every ``step_s``, should hold motion like that to come: a stretch at rest
    recommends the longest window. Raises InvalidSetting when the stretch or the delay is too short for any
    kernel.
    """
    if len(signal) < MIN_ROWS + 4 or not max_delay_s > 0 or not sigma > 0:
        raise InvalidSetting(
            f"{len(signal)} samples are too few to tune on (24 is the least), or the delay of "
            f"{max_delay_s:g} s or the noise of {sigma:g} is not above 0"
        )
    judge = Judge(np.asarray(signal, np.float64), sigma, order, step_s)
    longest_s = (len(signal) - MIN_ROWS) * step_s
    judged = []
    kernels = chain(
        candidate_kernels(max_delay_s, step_s, longest_s), shared_kernels(judge, max_delay_s, longest_s)
    )
    for spec, n_taps in kernels:
        window_s = (n_taps - 1) * step_s
        taps = uniform_taps(spec, n_taps, step_s)[order]
        judged.append(judge.expect(taps, spec.delay_s(window_s), label_of(spec, window_s), spec, window_s))
    ranked = sorted((e for e in judged if e is not None), key=lambda e: e.rmse)
    ranked = [e for e in ranked if e.delay_s <= max_delay_s + step_s / 1000]
    best = [best_of(peers) for peers in (butterworths(judge, max_delay_s), kalmans(judge, max_delay_s))]
    return TuningResult(order, ranked[0], tuple(ranked), *best)


def label_of(spec: KernelSpec, window_s: float) -> str:
    """A design in words."""
    label = f"T = {window_s:.4g} s, N = {spec.degree}, kappa = {spec.kappa}, mu = {spec.mu}"
    return label + "".join(f"{', shares' if k == 0 else ''} {s:.2f}" for k, s in enumerate(spec.shares))


def best_of(judged: Iterator[Expectation | None]) -> Expectation | None:
    """The least expected error."""
    return min((e for e in judged if e is not None), key=lambda e: e.rmse, default=None)


def butterworths(judge: Judge, max_delay_s: float) -> Iterator[Expectation | None]:
    """Butterworth filters of n + 1 and n + 2 poles, each at its own delay at low frequency."""
    cutoffs_hz = np.geomspace(0.05 / max_delay_s, 0.4 / judge.step_s, 40)
    for poles, cutoff_hz in product((judge.order + 1, judge.order + 2), cutoffs_hz):
        taps = butterworth_response(judge.order, poles, cutoff_hz, judge.step_s, judge.n)
        if taps is None:
            continue
        delay_s = delay_of(taps, judge.order, judge.step_s)
        if delay_s <= max_delay_s:
            yield judge.expect(taps, delay_s, f"Butterworth, {poles} poles, {cutoff_hz:.3g} Hz")


def kalmans(judge: Judge, max_delay_s: float) -> Iterator[Expectation | None]:
    """Fixed-lag Kalman smoothers at the whole delay."""
    lag = int(max_delay_s / judge.step_s + 1e-9)
    unit = judge.sigma**2 / judge.step_s ** (2 * judge.order + 2)
    for ratio in 10.0 ** np.arange(-14, 1, 0.5):
        taps = kalman_response(judge.order, ratio * unit, judge.sigma, lag, judge.step_s, judge.n)
        if taps is not None:
            yield judge.expect(taps, lag * judge.step_s, f"Kalman, lag {lag}, intensity {ratio * unit:.3g}")
