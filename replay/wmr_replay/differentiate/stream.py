"""The differentiator as a stage: rows in, derivatives of order 0, 1 and 2 out, one row for each.

Uniform windows take taps computed once, the others are solved on their actual stamps. The backend of a row
depends on its own window alone, so neither the batches nor later rows change a bit.
"""

from dataclasses import dataclass, fields

import numpy as np

from wmr_replay.differentiate.backends import make_backend
from wmr_replay.differentiate.blocks import Signals
from wmr_replay.differentiate.design import KernelSpec
from wmr_replay.differentiate.windows import UNIFORM_TOLERANCE_NS, WindowRules, find_windows
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.status import Status


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Estimates (s, 3, n) of the instants t − ``delay_s``, filtered inputs (k, n), covariance factors Σ h_a
    h_b (3, 3, n), state (n,), coverage (n,) – samples in the window over the nominal number – and delay (n,).
    """

    estimates: F64
    inputs: F64
    gains: F64
    state: I8
    coverage: F64
    delay_s: F64

    def sd(self, sigma: F64 | float) -> F64:
        """Standard deviations (s, 3, n) of the estimates, for white noise of sd ``sigma``: a number, (s,) or
        (s, n).
        """
        factors = np.sqrt(np.diagonal(self.gains, axis1=0, axis2=1).T)
        per_signal = np.asarray(sigma, np.float64)
        if per_signal.ndim < 2:
            per_signal = np.broadcast_to(per_signal, len(self.estimates))[:, None]
        return np.asarray(per_signal[:, None, :] * factors)


def concatenate_derivatives(parts: list[Derivatives]) -> Derivatives:
    """Consecutive batches of derivatives as one."""
    names = [field.name for field in fields(Derivatives)]
    return Derivatives(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names))


class Differentiator:
    """Stage: ``push(t_ns, samples, inputs)``; NaN until a window is full and while a hole lies in it.

    ``window_s`` is rounded to whole steps of ``step_s`` (the nominal sampling step). ``folds`` (k,) says how
    often the kernel is integrated for each input: 2 for accelerations, 1 for velocities; those of fold f are
    filtered with the kernel of order f. The gap policy is that of ``windows.WindowRules``, with holes above
    max(T/4, 1.5 steps) and half of the samples at least. Memory: one window of samples; nothing is
    accumulated. Rows are warming up for a window's length from ``start_ns`` on (None: from the first row).
    """

    def __init__(
        self,
        spec: KernelSpec,
        *,
        window_s: float,
        step_s: float,
        folds: tuple[int, ...] = (),
        start_ns: int | None = None,
    ) -> None:
        n_taps = round(window_s / step_s) + 1
        least = spec.top_degree + 2
        if spec.degree < 2:
            raise InvalidSetting(f"second derivatives need a degree of 2 or more, not {spec.degree}")
        if n_taps < least:
            raise InvalidSetting(
                f"a window of {window_s:g} s holds {n_taps} samples at {1 / step_s:g} Hz; degree "
                f"{spec.top_degree} needs {least} or more: lengthen the window to {(least - 1) * step_s:g} s "
                "at least"
            )
        self.spec, self.n_taps, self.step_s = spec, n_taps, step_s
        self.window_s = (n_taps - 1) * step_s
        self.delay_s = spec.delay_s(self.window_s)
        self.n_gaps = 0
        self._folds = np.array(folds, np.int64)
        window_ns, step_ns = round(self.window_s * NS_PER_S), step_s * NS_PER_S
        self.hole_ns = max(window_ns // 4, round(1.5 * step_ns))
        """Longer steps are holes."""
        self._rules = WindowRules(window_ns, step_ns, self.hole_ns, n_taps, max((n_taps + 1) // 2, least))
        self._backend = make_backend(spec, n_taps, step_s, folds)
        self._t_ns = np.empty(0, np.int64)
        self._samples: F64 | None = None
        self._inputs = np.empty((len(folds), 0))
        self._restarts = np.empty(0, bool)
        self._start_ns = start_ns

    def push(self, t_ns: I64, samples: F64, inputs: F64, restarts: Bool | None = None) -> Derivatives:
        """Rows of strictly increasing stamps: ``samples`` (s, n), ``inputs`` (k, n).

        No window reaches back behind a row where ``restarts`` (n,) is set, as none does over a hole.
        """
        if self._start_ns is None and t_ns.size:
            self._start_ns = int(t_ns[0])
        n_old = len(self._t_ns)
        held = self._append(t_ns, samples, inputs)
        new = np.zeros(len(t_ns), bool) if restarts is None else restarts
        self._restarts = np.concatenate([self._restarts, new])
        start_ns = self._start_ns or 0
        windows = find_windows(self._t_ns, self._restarts, n_old, start_ns, self._rules)
        self.n_gaps += windows.n_holes
        block_ns = self._rules.window_ns + UNIFORM_TOLERANCE_NS
        signals = Signals(self._t_ns, held, self._inputs, self._folds, start_ns, block_ns)
        answer = self._backend.rows(signals, windows, n_old)
        delay_s = np.where(answer.state == Status.OK, self.delay_s, np.nan)
        coverage = windows.coverage[n_old:]
        self._forget(windows.first)
        return Derivatives(answer.estimates, answer.inputs, answer.gains, answer.state, coverage, delay_s)

    def finish(self) -> Derivatives:
        """An empty batch: no rows are held back."""
        n_signals = 0 if self._samples is None else len(self._samples)
        return self.push(np.empty(0, np.int64), np.empty((n_signals, 0)), np.empty((len(self._inputs), 0)))

    def _append(self, t_ns: I64, samples: F64, inputs: F64) -> F64:
        """Append to the buffers; returns the samples held, (s, n)."""
        before = self._samples if self._samples is not None and len(self._t_ns) else samples[:, :0]
        self._samples = np.concatenate([before, samples], axis=1)
        self._inputs = np.concatenate([self._inputs, inputs], axis=1)
        self._t_ns = np.concatenate([self._t_ns, t_ns])
        return self._samples

    def _forget(self, first: I64) -> None:
        """Keep what later windows can reach: the last window and a full set of taps."""
        if not first.size or self._samples is None:
            return
        keep = max(0, min(int(first[-1]), len(self._t_ns) - self.n_taps) - 1)
        self._t_ns, self._inputs = self._t_ns[keep:], self._inputs[:, keep:]
        self._samples, self._restarts = self._samples[:, keep:], self._restarts[keep:]
