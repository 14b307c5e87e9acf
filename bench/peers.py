"""The peers, each as candidates: a label and a function from a realisation to estimates x̂⁽ⁿ⁾(t − δ).

Finite-window peers are used causally: the described instant lies δ before the newest sample that they use.
Recursive peers may give an estimate early and have it delayed, whichever scores better.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import product

import numpy as np
from AlgDiff import AlgebraicDifferentiator
from cases import DELAY_S, STEP_S, Realisation
from derivative import dxdt
from levant import levant
from scipy.signal import oaconvolve, savgol_coeffs
from simdkalman import KalmanFilter

from wmr_replay.differentiate.baselines import butterworth_response, chain_of_integrators, kalman_response
from wmr_schemas.arrays import F64

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it warns about its optional solver
    from pynumdiff.polynomial_fit import polydiff, savgoldiff

Estimate = Callable[[Realisation], F64]
Candidates = list[tuple[str, Estimate]]
LAG = round(DELAY_S / STEP_S)
WINDOW_STEPS = tuple(dict.fromkeys(round(w) for w in LAG * 2 ** np.arange(0.25, 3.01, 0.25)))
SLOW_STEPS = tuple(2 * LAG * k // 4 for k in (3, 4, 5, 6, 8))


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress the peers' warnings."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def filtered(taps: F64, noisy: F64) -> F64:
    """Causal convolution; NaN until the window is full."""
    out = np.full(len(noisy), np.nan)
    out[len(taps) - 1 :] = oaconvolve(noisy, taps, "valid")
    return out


def held_back(values: F64, steps: int) -> F64:
    """The estimates delayed by ``steps`` samples."""
    return values if steps == 0 else np.concatenate([np.full(steps, np.nan), values[:-steps]])


def savitzky_golay(order: int) -> Candidates:
    """Savitzky–Golay with SciPy's coefficients, evaluated δ before the newest sample."""

    def candidate(steps: int, degree: int) -> Estimate:
        taps = savgol_coeffs(steps + 1, degree, order, STEP_S, pos=steps - LAG, use="conv")
        return lambda r: filtered(taps, r.noisy)

    grid = [(s, d) for s, d in product(WINDOW_STEPS, (1, 2, 3, 4, 5)) if s >= LAG and order <= d < s]
    return [(f"window {s + 1}, degree {d}", candidate(s, d)) for s, d in grid]


def resampled(order: int) -> Candidates:
    """Savitzky–Golay after causal linear interpolation to the nominal rate, which costs one step of δ."""

    def candidate(steps: int, degree: int) -> Estimate:
        taps = savgol_coeffs(steps + 1, degree, order, STEP_S, pos=steps - (LAG - 1), use="conv")

        def estimate(r: Realisation) -> F64:
            t_s = (r.t_ns - r.t_ns[0]) * 1e-9
            grid_s = np.arange(0, t_s[-1], STEP_S)
            return np.interp(t_s - STEP_S, grid_s, filtered(taps, np.interp(grid_s, t_s, r.noisy)))

        return estimate

    grid = [(s, d) for s, d in product(WINDOW_STEPS, (1, 2, 3, 4, 5)) if s >= LAG and order <= d < s]
    return [(f"window {s + 1}, degree {d}", candidate(s, d)) for s, d in grid]


def algdiff(order: int) -> Candidates:
    """AlgDiff with its own taps; its θ may correct their delay of half a sample."""

    def candidate(steps: int, extra: int, more: float, early: float) -> Estimate:
        window_s = steps * STEP_S
        weights = {"alpha": order + more, "beta": order + more, "N": extra, "T": window_s}
        with quiet():
            peer = AlgebraicDifferentiator(ts=STEP_S, display=False, **weights)
            peer.set_theta(min(1.0, 1 - 2 * (DELAY_S - early * STEP_S) / window_s), False)
            taps = np.asarray(peer.discretize(order, "mid-point")[order]["mid-point"])
        return lambda r: filtered(taps, r.noisy)

    grid = product(WINDOW_STEPS, range(4), (0.0, 0.5, 1.0, 2.0), (0.0, 0.5, 1.0))
    return [
        (f"T {s * STEP_S:.3g}, N {extra}, weight {more:g}, early {early:g}", candidate(s, extra, more, early))
        for s, extra, more, early in grid
    ]


def derivative_package(order: int) -> Candidates:
    """Savitzky–Golay of ``derivative`` on actual stamps, δ to the right, the rest left; first order only."""

    def candidate(steps: int, degree: int) -> Estimate:
        def estimate(r: Realisation) -> F64:
            t_s = (r.t_ns - r.t_ns[0]) * 1e-9
            left = steps * STEP_S - DELAY_S
            with quiet():
                out = dxdt(r.noisy, t_s, kind="savitzky_golay", order=degree, left=left, right=DELAY_S)
            at = np.interp(t_s - DELAY_S, t_s, out)
            return np.where(t_s < DELAY_S, np.nan, at)

        return estimate

    if order != 1:
        return []
    return [(f"window {s * STEP_S:.3g}, degree {d}", candidate(s, d)) for s, d in product(SLOW_STEPS, (2, 3))]


def pynumdiff(order: int) -> Candidates:
    """PyNumDiff's centred finite windows, as wide as δ allows; first order only.

    Its other methods use the whole signal.
    """

    def centred(method: Callable[[F64], F64]) -> Estimate:
        def estimate(r: Realisation) -> F64:
            with quiet():
                return held_back(np.asarray(method(r.noisy)), LAG)

        return estimate

    def savgol(degree: int, smoothing: int) -> Estimate:
        width = 2 * (LAG - smoothing // 2) + 1
        return centred(
            lambda x: savgoldiff(x, STEP_S, degree=degree, window_size=width, smoothing_win=smoothing)[1]
        )

    def poly(degree: int) -> Estimate:
        return centred(lambda x: polydiff(x, STEP_S, degree=degree, window_size=LAG + 1)[1])

    if order != 1:
        return []
    found = [
        (f"savgoldiff, degree {d}, smoothing {w}", savgol(d, w)) for d, w in product((2, 3, 4), (1, 5, 9))
    ]
    return found + [(f"polydiff, degree {d}", poly(d)) for d in (2, 3)]


def butterworth(order: int) -> Candidates:
    """Butterworth low-pass and backward differences, delayed by up to δ."""

    def candidate(taps: F64, steps: int) -> Estimate:
        return lambda r: held_back(filtered_from_zero(taps, r.noisy), steps)

    found = []
    for poles, cutoff_hz in product((order + 1, order + 2), np.geomspace(0.3, 12, 25)):
        taps = butterworth_response(order, poles, cutoff_hz, STEP_S, 2000)
        if taps is not None:
            found += [
                (f"{poles} poles, {cutoff_hz:.2g} Hz", candidate(taps, s)) for s in range(0, LAG + 1, 2)
            ]
    return found


def filtered_from_zero(taps: F64, noisy: F64) -> F64:
    """Convolution whose initial state is rest at the first sample."""
    return np.asarray(oaconvolve(noisy - noisy[0], taps)[: len(noisy)])


def kalman(order: int) -> Candidates:
    """Stationary fixed-lag Kalman smoothers with the noise's true σ, by intensity."""

    def candidate(ratio: float) -> Estimate:
        def estimate(r: Realisation) -> F64:
            unit = r.sigma**2 / STEP_S ** (2 * order + 2)
            taps = kalman_response(order, ratio * unit, r.sigma, LAG, STEP_S, 4000)
            return np.full(len(r.noisy), np.nan) if taps is None else filtered_from_zero(taps, r.noisy)

        return estimate

    return [(f"intensity {ratio:.0e}", candidate(ratio)) for ratio in 10.0 ** np.arange(-14, 1, 0.5)]


def simdkalman(order: int) -> Candidates:
    """The filter of simdkalman: the same model without lag, its state extrapolated back by δ."""
    transition, process = chain_of_integrators(order + 2, STEP_S)
    back = chain_of_integrators(order + 2, -DELAY_S)[0]

    def candidate(ratio: float) -> Estimate:
        def estimate(r: Realisation) -> F64:
            intensity = ratio * r.sigma**2 / STEP_S ** (2 * order + 2)
            model = KalmanFilter(transition, intensity * process, np.eye(order + 2)[:1], r.sigma**2)
            x = r.noisy - r.noisy[0]
            return np.asarray(
                model.compute(x, 0, filtered=True, smoothed=False).filtered.states.mean @ back[order]
            )

        return estimate

    return [(f"intensity {ratio:.0e}", candidate(ratio)) for ratio in 10.0 ** np.arange(-13, -3, 1.5)]


def super_twisting(order: int) -> Candidates:
    """Levant's differentiator by its bound L, with ten Euler steps a sample, delayed by up to δ."""

    def candidate(bound: float, steps: int) -> Estimate:
        def estimate(r: Realisation) -> F64:
            fine = levant(np.repeat(r.noisy, 10), bound, STEP_S / 10, order + 1)[order, 9::10]
            return held_back(fine, steps)

        return estimate

    grid = product(10.0 ** np.arange(-1, 3.1, 0.5), range(0, LAG + 1, 2))
    return [(f"L {bound:.2g}, held {steps}", candidate(bound, steps)) for bound, steps in grid]


FINITE = {
    "Savitzky–Golay": savitzky_golay,
    "its resampled form": resampled,
    "AlgDiff": algdiff,
    "derivative": derivative_package,
    "PyNumDiff": pynumdiff,
}
RECURSIVE = {
    "Butterworth": butterworth,
    "Kalman": kalman,
    "simdkalman": simdkalman,
    "super-twisting": super_twisting,
}
IRREGULAR_ONLY = {"its resampled form"}
SLOW = {"derivative", "PyNumDiff", "simdkalman"}
