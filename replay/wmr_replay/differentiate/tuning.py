"""Choice of (T, N, κ, μ, shares) from a stretch of the signal: the least expected error at a bounded delay.

Butterworth filters and Kalman smoothers are rated by the same rule (``expected_error``): where a recursive
filter has less expected error, the result says so.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, product

import numpy as np

from wmr_replay.differentiate.baselines import butterworth_response, delay_of, kalman_response
from wmr_replay.differentiate.design import KernelSpec, uniform_taps
from wmr_replay.differentiate.expected_error import MIN_ROWS, ErrorModel, Expectation
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

DEGREES = (2, 3, 4, 5)
WEIGHTS = ((0, 0), (0, 1), (1, 0), (1, 1))
WINDOWS_PER_OCTAVE = 4
LONGEST_IN_DELAYS = 8.0
N_SHARES = 3


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
        """Kernel of the chosen design."""
        assert self.choice.spec is not None
        return self.choice.spec

    @property
    def window_s(self) -> float:
        """Window of the chosen design, in s."""
        assert self.choice.window_s is not None
        return self.choice.window_s


def shared_kernels(
    model: ErrorModel, max_delay_s: float, longest_s: float
) -> Iterator[tuple[KernelSpec, int]]:
    """Kernels exact to degree 2 that take of the degrees 3 to 5 what lowers the error most."""
    for base, n_taps in candidate_kernels(max_delay_s, model.step_s, longest_s):
        roomy = model.n - n_taps >= 2 * MIN_ROWS and n_taps >= 2 + N_SHARES + 3
        if base.degree == 2 and base.kappa == 0 and roomy:
            yield replace(base, shares=model.best_shares(base, n_taps, N_SHARES)), n_taps


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
    model = ErrorModel(np.asarray(signal, np.float64), sigma, order, step_s)
    longest_s = (len(signal) - MIN_ROWS) * step_s
    rated = []
    kernels = chain(
        candidate_kernels(max_delay_s, step_s, longest_s), shared_kernels(model, max_delay_s, longest_s)
    )
    for spec, n_taps in kernels:
        window_s = (n_taps - 1) * step_s
        taps = uniform_taps(spec, n_taps, step_s)[order]
        rated.append(model.expect(taps, spec.delay_s(window_s), label_of(spec, window_s), spec, window_s))
    ranked = sorted((e for e in rated if e is not None), key=lambda e: e.rmse)
    ranked = [e for e in ranked if e.delay_s <= max_delay_s + step_s / 1000]
    best = [best_of(peers) for peers in (butterworths(model, max_delay_s), kalmans(model, max_delay_s))]
    return TuningResult(order, ranked[0], tuple(ranked), *best)


def label_of(spec: KernelSpec, window_s: float) -> str:
    """A design in words, for reports."""
    label = f"T = {window_s:.4g} s, N = {spec.degree}, kappa = {spec.kappa}, mu = {spec.mu}"
    return label + "".join(f"{', shares' if k == 0 else ''} {s:.2f}" for k, s in enumerate(spec.shares))


def best_of(rated: Iterator[Expectation | None]) -> Expectation | None:
    """The expectation with the least rmse; None without any."""
    return min((e for e in rated if e is not None), key=lambda e: e.rmse, default=None)


def butterworths(model: ErrorModel, max_delay_s: float) -> Iterator[Expectation | None]:
    """Butterworth filters of n + 1 and n + 2 poles, each at its own delay at low frequency."""
    cutoffs_hz = np.geomspace(0.05 / max_delay_s, 0.4 / model.step_s, 40)
    for poles, cutoff_hz in product((model.order + 1, model.order + 2), cutoffs_hz):
        taps = butterworth_response(model.order, poles, cutoff_hz, model.step_s, model.n)
        if taps is None:
            continue
        delay_s = delay_of(taps, model.order, model.step_s)
        if delay_s <= max_delay_s:
            yield model.expect(taps, delay_s, f"Butterworth, {poles} poles, {cutoff_hz:.3g} Hz")


def kalmans(model: ErrorModel, max_delay_s: float) -> Iterator[Expectation | None]:
    """Fixed-lag Kalman smoothers at the whole delay."""
    lag = int(max_delay_s / model.step_s + 1e-9)
    unit = model.sigma**2 / model.step_s ** (2 * model.order + 2)
    for ratio in 10.0 ** np.arange(-14, 1, 0.5):
        taps = kalman_response(model.order, ratio * unit, model.sigma, lag, model.step_s, model.n)
        if taps is not None:
            yield model.expect(taps, lag * model.step_s, f"Kalman, lag {lag}, intensity {ratio * unit:.3g}")
