"""One design for several signals and orders, which replaces a given one at the same delay.

A stretch of a log holds few of the sudden changes to come. On it alone, long windows win that blur the next
switch of mode. So steps are added to what the stretch shows (``expected_error``): steps of x⁽ⁿ⁾, as
frequent as gives the old design as much error from them as it has from noise. That is where a window's length
is in balance: noise falls and blur rises with it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil

import numpy as np

from wmr_replay.differentiate.backends import in_blocks
from wmr_replay.differentiate.design import KernelSpec
from wmr_replay.differentiate.expected_error import MIN_ROWS, SEED, least_shares
from wmr_replay.differentiate.family import ORDERS, Family, Guesses
from wmr_replay.differentiate.smoother import smooth
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

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


class JointErrorModel:
    """Expected error of a design in the derivatives of all signals (s, n) beside that of an ``old`` one: its
    kernel and window. Noise ``sigma`` (s,).

    As in ``expected_error``, a smooth guess stands in for the true signals, and its own noise is subtracted.
    """

    def __init__(self, signals: F64, sigma: F64, step_s: float, old: tuple[KernelSpec, float]) -> None:
        group = ceil(signals.shape[1] / MOST_ROWS)
        n = signals.shape[1] // group
        means = signals[:, : n * group].reshape(len(signals), n, group).mean(axis=2)
        self.n, self.step_s, self.sigma = n, group * step_s, sigma / np.sqrt(group)
        noise = np.random.default_rng(SEED).standard_normal(n)
        self.guesses = Guesses(smooth(means - means[:, :1], noise, self.sigma, self.step_s), n, self.step_s)
        family = Family(old[0], max(round(old[1] / self.step_s), old[0].degree + 2) + 1, self.guesses)
        self.old_delay_s = family.delay_s
        kernels = family.kernels(old[0].all_shares)
        self._scale = np.ones((len(ORDERS), len(sigma)))
        self._step = np.array([np.linalg.norm(family.step_error(kernels, n)) for n in ORDERS])
        self._sd = np.sqrt(np.array([family.gain(kernels, n) for n in ORDERS]))[:, None] * self.sigma
        self._scale = np.sqrt(self._squares(family, old[0].all_shares))

    def _squares(self, family: Family, shares: F64) -> F64:
        """Expected square errors by order and signal (2, s) over the old design's; NaN in a short stretch."""
        kernels, squares = family.kernels(shares), np.full(self._scale.shape, np.nan)
        for k, order in enumerate(ORDERS if family.n_windows >= MIN_ROWS else ()):
            blur = np.linalg.norm(family.step_error(kernels, order)) / self._step[k] * self._sd[k]
            seen = np.mean(family.errors(kernels, order) ** 2, axis=2)
            bias = np.maximum(seen[:, 0] - seen[:, 1], 0.0)
            squares[k] = bias + self.sigma**2 * family.gain(kernels, order) + blur**2
        return squares / self._scale**2

    def _residuals(self, family: Family, shares: F64) -> F64:
        """A vector whose squared norm is the sum of the scaled square errors, linear in the taps."""
        kernels, parts = family.kernels(shares), []
        for k, order in enumerate(ORDERS):
            errors = family.errors(kernels, order, slice(1))[:, 0] / np.sqrt(family.n_windows)
            noise = self.sigma[:, None] * family.taps(kernels, order)
            blur = self._sd[k][:, None] * family.step_error(kernels, order) / self._step[k]
            parts += [part / self._scale[k][:, None] for part in (errors, noise, blur)]
        return np.concatenate([part.ravel() for part in parts])

    def nested_residuals(self, family: Family) -> F64:
        """Those of the kernels of degree 2 to the top, one a row, turned into as few columns: from them
        follow shares of the degrees.
        """
        whole = (np.arange(family.size) <= degree for degree in range(2, family.size))
        residuals = np.stack([self._residuals(family, shares.astype(np.float64)) for shares in whole], axis=1)
        triangle: F64 = np.linalg.qr(residuals)[1]
        return triangle.T

    def rate(self, spec: KernelSpec, n_taps: int, family: Family | None = None) -> JointChoice:
        """Its expected error beside the old design's; ``family``, if given, holds it."""
        within = family or Family(spec, n_taps, self.guesses)
        shares = np.zeros(within.size)
        shares[: spec.top_degree + 1] = spec.all_shares
        ratios = np.sqrt(self._squares(within, shares))
        mean, worst = float(np.sqrt(np.mean(ratios**2))), float(np.max(ratios))
        return JointChoice(spec, (n_taps - 1) * self.step_s, mean, worst)


def window_steps(old_delay_s: float, max_delay_s: float, step_s: float) -> list[int]:
    """Windows in steps, from twice the shorter delay to four times the longest allowed."""
    shortest_s = 2 * min(old_delay_s, max_delay_s)
    octaves = np.log2(LONGEST_IN_DELAYS * max_delay_s / shortest_s)
    lengths_s = shortest_s * 2 ** np.arange(0, octaves + 1e-9, 1 / WINDOWS_PER_OCTAVE)
    return list(dict.fromkeys(ceil(length_s / step_s - 1e-6) for length_s in lengths_s))


def rated_candidates(model: JointErrorModel, max_delay_s: float) -> Iterator[JointChoice]:
    """Kernels of the block backend, of whole degrees and with shares. Windows up to 2 δ_max are read in their
    middle, longer ones at δ_max.
    """
    windows = window_steps(model.old_delay_s, max_delay_s, model.step_s)
    for steps, (kappa, mu) in product(windows, WEIGHTS):
        theta = max(0.0, 1 - 2 * max_delay_s / (steps * model.step_s))
        base = KernelSpec(2, kappa, mu, theta)
        largest = max(extra for extra in range(4) if extra == 0 or steps >= extra + 5)
        family = Family(replace(base, degree=2 + largest), steps + 1, model.guesses)
        roomy = model.n - steps >= 2 * MIN_ROWS
        nested = model.nested_residuals(family) if roomy else np.empty((0, 0))
        for spec in (replace(base, degree=degree) for degree in DEGREES if steps >= degree + 3):
            if in_blocks(spec):
                yield model.rate(spec, steps + 1, family)
        for n_extra in (1, 2, 3):
            top = replace(base, degree=2 + n_extra)
            if roomy and in_blocks(top) and steps >= n_extra + 6:
                shared = replace(base, shares=least_shares(nested[: n_extra + 1]))
                yield model.rate(shared, steps + 1, family)


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
    model = JointErrorModel(stretch, np.maximum(sigma, 1e-9), step_s, old)
    good = [choice for choice in rated_candidates(model, max_delay_s) if choice.worst_ratio <= 1.0]
    return min(good, key=lambda choice: choice.ratio, default=None)
