"""The differentiator as a stage: rows in, derivatives of order 0, 1 and 2 out, one row for each.

On uniform stamps the taps are computed once; a window that is not uniform is solved on its actual stamps.
Which road a row takes depends on its own window alone, so neither the batches nor later rows change a bit.
"""

from dataclasses import dataclass

import numpy as np

from wmr_replay.differentiate.design import KernelSpec, input_taps, uniform_taps
from wmr_replay.differentiate.fir import apply_taps
from wmr_replay.differentiate.irregular import irregular_rows
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.errors import InvalidSetting

OK, WARMING_UP, GAP = 0, 1, 2
UNIFORM_TOLERANCE_NS = 2


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Estimates (s, 3, n) of the instants t − δ, filtered inputs (k, n), covariance factors Σ h_a h_b (3, 3,
    n), state (n,).
    """

    estimates: F64
    inputs: F64
    gains: F64
    state: I8


class Differentiator:
    """Stage: ``push(t_ns, samples, inputs)``; NaN until a window is full and while a hole lies in it.

    ``window_s`` is rounded to whole steps of ``step_s`` (the nominal sampling step). ``folds`` (k,) says how
    often the kernel is integrated for each input: 2 for accelerations, 1 for velocities; those of fold f are
    filtered with the kernel of order f. A window with a hole above ``max(T/4, 1.5 steps)``, or with fewer
    than half of its samples, is a gap.
    """

    def __init__(
        self, spec: KernelSpec, *, window_s: float, step_s: float, folds: tuple[int, ...] = ()
    ) -> None:
        n_taps = round(window_s / step_s) + 1
        if n_taps < spec.degree + 2:
            raise InvalidSetting(
                f"a window of {window_s:g} s holds {n_taps} samples at {1 / step_s:g} Hz; "
                f"degree {spec.degree} needs "
                f"{spec.degree + 2} or more: lengthen the window to {(spec.degree + 1) * step_s:g} s at least"
            )
        self.spec, self.n_taps, self.step_s = spec, n_taps, step_s
        self.window_s = (n_taps - 1) * step_s
        self.delay_s = spec.delay_s(self.window_s)
        self.n_gaps = 0
        self._folds = np.array(folds, np.int64)
        self._step_ns = step_s * NS_PER_S
        self._window_ns = round(self.window_s * NS_PER_S)
        self._hole_ns = max(self._window_ns // 4, round(1.5 * self._step_ns))
        self._taps = uniform_taps(spec, n_taps, step_s)
        self._input_taps = [input_taps(self._taps[fold], step_s, fold)[None, :] for fold in folds]
        self._gains = self._taps @ self._taps.T
        self._t_ns = np.empty(0, np.int64)
        self._samples: F64 | None = None
        self._inputs = np.empty((len(folds), 0))
        self._start_ns: int | None = None
        self._origin: F64 | None = None

    def push(self, t_ns: I64, samples: F64, inputs: F64) -> Derivatives:
        """Rows of strictly increasing stamps: ``samples`` (s, n), ``inputs`` (k, n)."""
        if self._origin is None and t_ns.size:
            self._origin, self._start_ns = samples[:, 0].copy(), int(t_ns[0])
        old = len(self._t_ns)
        self._append(t_ns, samples, inputs)
        rows = np.arange(old, len(self._t_ns))
        first, state, uniform = self._windows(rows)
        out = self._uniform(rows, uniform)
        self._irregular(rows, first, (state == OK) & ~uniform, out)
        if self._origin is not None:
            out.estimates[:, 0] += self._origin[:, None]
        self._forget(rows, first)
        return Derivatives(out.estimates, out.inputs, out.gains, state)

    def _append(self, t_ns: I64, samples: F64, inputs: F64) -> None:
        local = samples - (0.0 if self._origin is None else self._origin[:, None])
        self._samples = local if self._samples is None else np.concatenate([self._samples, local], axis=1)
        self._inputs = np.concatenate([self._inputs, inputs], axis=1)
        self._t_ns = np.concatenate([self._t_ns, t_ns])

    def _windows(self, rows: I64) -> tuple[I64, I8, Bool]:
        """First sample of each row's window, its state, and whether its stamps are uniform."""
        t, new = self._t_ns, self._t_ns[rows]
        first = np.searchsorted(t, new - self._window_ns - UNIFORM_TOLERANCE_NS)
        steps = np.diff(t)
        hole_before = np.concatenate(
            [[-1], np.maximum.accumulate(np.where(steps > self._hole_ns, np.arange(len(steps)), -1))]
        )
        if rows.size:
            self.n_gaps += int(np.count_nonzero(steps[max(rows[0] - 1, 0) :] > self._hole_ns))
        full = new - (self._start_ns or 0) >= self._window_ns - self._step_ns / 2
        enough = (rows - first + 1 >= max(self.n_taps / 2, self.spec.degree + 2)) & (
            hole_before[rows] < first
        )
        covered = enough & (t[first] - (new - self._window_ns) <= self._hole_ns)
        state = np.where(full, np.where(covered, OK, GAP), WARMING_UP).astype(np.int8)
        start = rows - (self.n_taps - 1)
        uniform = (state == OK) & (start >= 0) & (first == start)
        uniform &= self._regular_run()[rows] >= self.n_taps - 1
        uniform &= np.abs((new - t[np.maximum(start, 0)]) - self._window_ns) <= UNIFORM_TOLERANCE_NS
        return first, state, uniform

    def _regular_run(self) -> I64:
        """How many regular steps end at each stamp without a break."""
        regular = np.abs(np.diff(self._t_ns) - self._step_ns) <= UNIFORM_TOLERANCE_NS
        index = np.arange(len(self._t_ns))
        broken = np.concatenate([[0], np.where(regular, 0, index[1:])]) if len(index) else index
        return index - np.maximum.accumulate(broken)

    def _uniform(self, rows: I64, wanted: Bool) -> Derivatives:
        assert self._samples is not None
        n_signals = len(self._samples)
        n_rows = len(rows)
        gains = np.where(wanted, self._gains[:, :, None], np.nan)
        estimates = np.full((n_signals, 3, n_rows), np.nan)
        filtered = np.full((len(self._folds), n_rows), np.nan)
        if wanted.any():
            for s in range(n_signals):
                estimates[s] = apply_taps(self._taps, self._padded(self._samples[s], rows), wanted)
            for k, taps in enumerate(self._input_taps):
                filtered[k] = apply_taps(taps[:, :-1], self._padded(self._inputs[k], rows)[1:], wanted)[0]
        return Derivatives(estimates, filtered, gains, np.zeros(n_rows, np.int8))

    def _padded(self, signal: F64, rows: I64) -> F64:
        """The samples that the windows of ``rows`` reach, padded in front where the log begins later."""
        start = int(rows[0]) - (self.n_taps - 1)
        return signal[start:] if start >= 0 else np.concatenate([np.zeros(-start), signal])

    def _irregular(self, rows: I64, first: I64, wanted: Bool, out: Derivatives) -> None:
        if not wanted.any():
            return
        assert self._samples is not None
        shape = (self.spec.degree, self.spec.kappa, self.spec.mu, self.spec.theta)
        args = (
            self._t_ns,
            self._samples,
            self._inputs,
            self._folds,
            rows[wanted],
            first[wanted],
            shape,
            self._window_ns,
        )
        out.estimates[:, :, wanted], out.inputs[:, wanted], out.gains[:, :, wanted] = irregular_rows(*args)

    def _forget(self, rows: I64, first: I64) -> None:
        """Keep what later windows can reach: the last window and a full set of taps."""
        if not rows.size or self._samples is None:
            return
        keep = max(0, min(int(first[-1]), len(self._t_ns) - self.n_taps) - 1)
        self._t_ns, self._inputs = self._t_ns[keep:], self._inputs[:, keep:]
        self._samples = self._samples[:, keep:]
