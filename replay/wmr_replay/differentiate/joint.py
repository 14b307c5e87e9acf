"""One design for several signals and orders, to take the place of a given one at the same delay.

A stretch of a log holds few of the sudden changes to come. Judged on it alone, long windows win that blur the
next switch of mode. So steps are added to what the stretch shows (``judge``): steps of x⁽ⁿ⁾, as
frequent as gives the old design as much error from them as it has from noise. That is where a window's length
is in balance: noise falls and blur rises with it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, factorial

import numpy as np

from wmr_replay.differentiate.design import KernelSpec, uniform_taps
from wmr_replay.differentiate.judge import MIN_ROWS, Judge, least_shares, nested_taps
from wmr_replay.differentiate.roads import in_blocks
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

ORDERS = (1, 2)
DEGREES = (2, 3, 4)
WEIGHTS = ((0, 0), (0, 1))
LONGEST_IN_DELAYS, WINDOWS_PER_OCTAVE = 4.0, 4
"""Windows longer than four delays fit the stretch better, and what follows worse."""
MOST_ROWS = 1500
"""Longer stretches are averaged in groups."""


@dataclass(frozen=True)
class JointChoice:
    """The design of least expected error. ``ratio`` is its root mean square over the old design's, over all
    signals and orders; ``worst_ratio`` the largest.
    """

    spec: KernelSpec
    window_s: float
    ratio: float
    worst_ratio: float


class JointJudge:
    """Expected error of a design in the derivatives of all signals (s, n) beside that of an ``old`` one: its
    kernel and window. Noise ``sigma`` (s,).
    """

    def __init__(self, signals: F64, sigma: F64, step_s: float, old: tuple[KernelSpec, float]) -> None:
        group = ceil(signals.shape[1] / MOST_ROWS)
        n = signals.shape[1] // group
        means = signals[:, : n * group].reshape(len(signals), n, group).mean(axis=2)
        self.n, self.step_s = n, group * step_s
        self._judges = [
            Judge(signal, level / np.sqrt(group), order, self.step_s)
            for signal, level in zip(means, sigma, strict=True)
            for order in ORDERS
        ]
        spec, n_taps = old[0], max(round(old[1] / self.step_s), old[0].degree + 2) + 1
        taps, delay_s = uniform_taps(spec, n_taps, self.step_s), spec.delay_s((n_taps - 1) * self.step_s)
        self.old_delay_s = delay_s
        self._blur = {n: self._step_error(taps[n], n, delay_s) for n in ORDERS}
        self._sd = [float(judge.sigma * np.linalg.norm(taps[judge.order])) for judge in self._judges]
        self._scale = np.ones(len(self._judges))
        self._scale = np.sqrt(self._squares(taps, delay_s))

    def _step_error(self, taps: F64, order: int, delay_s: float) -> F64:
        """Error of the derivative of order n of tⁿ/n!, t ≥ 0, at the samples until the window is past it."""
        t_s = np.arange(len(taps)) * self.step_s
        answer = np.convolve(taps, t_s**order / factorial(order))[: len(taps)]
        return np.asarray(answer - (t_s >= delay_s - self.step_s / 1000))

    def _step_errors(self, taps: F64, delay_s: float) -> list[F64]:
        """By signal and order, scaled so that the old design's norm is its sd."""
        error = {n: self._step_error(taps[n], n, delay_s) / np.linalg.norm(self._blur[n]) for n in ORDERS}
        return [sd * error[judge.order] for sd, judge in zip(self._sd, self._judges, strict=True)]

    def _squares(self, taps: F64, delay_s: float) -> F64:
        """Expected square error by signal and order, over the old design's. NaN for a short stretch."""
        squares = []
        for judge, blur in zip(self._judges, self._step_errors(taps, delay_s), strict=True):
            expected = judge.expect(taps[judge.order], delay_s, "")
            squares.append(np.nan if expected is None else expected.rmse**2 + float(blur @ blur))
        return np.array(squares) / self._scale**2

    def shares(self, base: KernelSpec, n_taps: int, n_extra: int) -> tuple[float, ...]:
        """Shares of the next degrees that minimise the mean of the scaled square errors."""
        delay_s, rows = base.delay_s((n_taps - 1) * self.step_s), []
        for taps in nested_taps(base, n_taps, self.step_s, n_extra):
            parts = zip(self._judges, self._step_errors(taps, delay_s), self._scale, strict=True)
            rows.append([np.append(j.residuals(taps[j.order], delay_s), blur) / s for j, blur, s in parts])
        return least_shares(np.stack([np.concatenate(row) for row in rows]))

    def judge(self, spec: KernelSpec, n_taps: int) -> JointChoice:
        """Its expected error beside the old design's."""
        window_s = (n_taps - 1) * self.step_s
        ratios = np.sqrt(self._squares(uniform_taps(spec, n_taps, self.step_s), spec.delay_s(window_s)))
        return JointChoice(spec, window_s, float(np.sqrt(np.mean(ratios**2))), float(np.max(ratios)))


def window_steps(old_delay_s: float, max_delay_s: float, step_s: float) -> list[int]:
    """Windows in steps, from twice the shorter delay to four times the longest allowed."""
    shortest_s = 2 * min(old_delay_s, max_delay_s)
    octaves = np.log2(LONGEST_IN_DELAYS * max_delay_s / shortest_s)
    lengths_s = shortest_s * 2 ** np.arange(0, octaves + 1e-9, 1 / WINDOWS_PER_OCTAVE)
    return list(dict.fromkeys(ceil(length_s / step_s - 1e-6) for length_s in lengths_s))


def joint_candidates(judge: JointJudge, max_delay_s: float) -> Iterator[tuple[KernelSpec, int]]:
    """Kernels on the fast road, of whole degrees and with shares. Windows up to 2 δ_max are read in their
    middle, longer ones at δ_max.
    """
    windows = window_steps(judge.old_delay_s, max_delay_s, judge.step_s)
    for steps, (kappa, mu) in product(windows, WEIGHTS):
        theta = max(0.0, 1 - 2 * max_delay_s / (steps * judge.step_s))
        for spec in (KernelSpec(degree, kappa, mu, theta) for degree in DEGREES if steps >= degree + 3):
            if in_blocks(spec):
                yield spec, steps + 1
        base = KernelSpec(2, kappa, mu, theta)
        for n_extra in (1, 2, 3):
            top = replace(base, degree=2 + n_extra)
            if in_blocks(top) and judge.n - steps >= 2 * MIN_ROWS and steps >= n_extra + 6:
                yield replace(base, shares=judge.shares(base, steps + 1, n_extra)), steps + 1


def tune_jointly(
    signals: Sequence[F64] | F64,
    sigma: F64,
    max_delay_s: float,
    *,
    step_s: float,
    old: tuple[KernelSpec, float],
) -> JointChoice | None:
    """The design of a delay up to ``max_delay_s`` with the least expected error in all first and second
    derivatives.

    ``signals`` (s, n), sampled every ``step_s``, noise ``sigma`` (s,); ``old`` is a kernel and its window. No
    choice is worse than ``old`` in any derivative; None when there is none. Raises InvalidSetting for a
    stretch shorter than 24 samples.
    """
    stretch = np.asarray(signals, np.float64)
    if stretch.shape[1] < MIN_ROWS + 4 or not max_delay_s > 0:
        raise InvalidSetting(
            f"{stretch.shape[1]} samples are too few to tune on (24 is the least), or the delay of "
            f"{max_delay_s:g} s is not above 0"
        )
    judge = JointJudge(stretch, np.maximum(sigma, 1e-9), step_s, old)
    judged = [judge.judge(spec, n_taps) for spec, n_taps in joint_candidates(judge, max_delay_s)]
    good = [choice for choice in judged if choice.worst_ratio <= 1.0]
    return min(good, key=lambda choice: choice.ratio, default=None)
