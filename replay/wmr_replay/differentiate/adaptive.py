"""Several windows at once: at each row the longest that the data do not contradict.

Every window gives, besides its own answer, an estimate of one common instant (the middle of the shortest
window). Going from short to long, the confidence intervals of these estimates are intersected, for every
signal and order; the window before the first empty intersection is taken (Goldenshluger and Nemirovski 1997,
Katkovnik 1999: the rule of intersecting confidence intervals). Shortly after a mode switch that is a short
window, on a steady stretch the longest.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.differentiate.design import KernelSpec
from wmr_replay.differentiate.noise import NoiseTracker
from wmr_replay.differentiate.stream import Derivatives, Differentiator
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled
from wmr_schemas.errors import InvalidSetting


@compiled
def longest_consistent(estimates: F64, half_widths: F64) -> I64:
    """Index of the window to take at each row, (n,), from ``estimates`` and ``half_widths`` (windows, q, n).

    −1 where the shortest window has no estimate; a window without one ends the search.
    """
    n_windows, n_quantities, n = estimates.shape
    out = np.full(n, -1, np.int64)
    low, high = np.empty(n_quantities), np.empty(n_quantities)
    for i in range(n):
        low[:], high[:] = -np.inf, np.inf
        for w in range(n_windows):
            agree = True
            for q in range(n_quantities):
                low[q] = max(low[q], estimates[w, q, i] - half_widths[w, q, i])
                high[q] = min(high[q], estimates[w, q, i] + half_widths[w, q, i])
                agree &= (low[q] <= high[q]) & (estimates[w, q, i] == estimates[w, q, i])
            if not agree:
                break
            out[i] = w
    return out


class AdaptiveDifferentiator:
    """Stage with the face of :class:`Differentiator`; ``delay_s`` of a row is that of the window it took.

    ``windows_s`` (rising) are the choices; ``spec.theta`` places the instant in each, or ``common_delay_s``
    fixes one delay for all. ``confidence`` is the half width of the intervals in standard deviations.
    ``sigma`` (s,) is the noise to begin with; it is tracked from there. Memory and work: those of two
    differentiators a window.
    """

    def __init__(
        self,
        spec: KernelSpec,
        *,
        windows_s: tuple[float, ...],
        step_s: float,
        sigma: F64,
        folds: tuple[int, ...] = (),
        common_delay_s: float | None = None,
        confidence: float = 3.0,
    ) -> None:
        if not windows_s or list(windows_s) != sorted(set(windows_s)):
            raise InvalidSetting(f"windows must be given, rising, and each once: not {windows_s}")
        shortest_s = Differentiator(spec, window_s=windows_s[0], step_s=step_s).window_s
        instant_s = shortest_s / 2 if common_delay_s is None else common_delay_s
        if instant_s > shortest_s:
            raise InvalidSetting(
                f"a delay of {instant_s:g} s lies outside the shortest window of {shortest_s:g} s"
            )

        def reading_at(delay_s: float, window_s: float) -> Differentiator:
            """A differentiator of that window whose estimates describe t − ``delay_s``."""
            at = replace(spec, theta=1 - 2 * delay_s / (round(window_s / step_s) * step_s))
            return Differentiator(at, window_s=window_s, step_s=step_s, folds=folds)

        self._tests = [reading_at(instant_s, window_s) for window_s in windows_s]
        self._answers = (
            [Differentiator(spec, window_s=window_s, step_s=step_s, folds=folds) for window_s in windows_s]
            if common_delay_s is None
            else self._tests
        )
        self._noise, self._confidence = NoiseTracker(sigma, step_s=step_s), confidence
        self.step_s, self.spec = step_s, spec
        self.window_s, self.delay_s = self._answers[-1].window_s, self._answers[-1].delay_s

    @property
    def n_gaps(self) -> int:
        """Holes so far, as the longest window counts them."""
        return self._answers[-1].n_gaps

    def push(self, t_ns: I64, samples: F64, inputs: F64) -> Derivatives:
        """Rows as for :meth:`Differentiator.push`; each takes the answer of one window."""
        sigma = self._noise.push(t_ns, samples)
        tests = [test.push(t_ns, samples, inputs) for test in self._tests]
        answers = (
            tests if self._answers is self._tests else [a.push(t_ns, samples, inputs) for a in self._answers]
        )
        shape = (len(tests), -1, len(t_ns))
        estimates = np.stack([test.estimates for test in tests]).reshape(shape)
        half_widths = self._confidence * np.stack([test.sd(sigma) for test in tests]).reshape(shape)
        return taken(answers, longest_consistent(estimates, half_widths))

    def finish(self) -> Derivatives:
        """Nothing is held back: no rows."""
        return self._answers[0].finish()


def taken(answers: list[Derivatives], index: I64) -> Derivatives:
    """Row i of ``answers[index[i]]``; of the shortest window where ``index`` is −1."""

    def pick(name: str) -> F64:
        """Column ``name`` of the windows taken, rows first."""
        columns = np.stack([getattr(answer, name) for answer in answers])
        return np.asarray(np.moveaxis(columns, -1, 1)[np.maximum(index, 0), np.arange(len(index))])

    estimates, inputs = np.moveaxis(pick("estimates"), 0, -1), np.moveaxis(pick("inputs"), 0, -1)
    gains = np.moveaxis(pick("gains"), 0, -1)
    state = answers[0].state
    return Derivatives(estimates, inputs, gains, state, pick("coverage"), pick("delay_s"))
