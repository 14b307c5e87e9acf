"""Backends of the differentiator: sums over blocks, with constant work per row, or each window by itself, for
steep kernels.
"""

from typing import NamedTuple, Protocol

import numpy as np

from wmr_replay.differentiate.blocks import Signals
from wmr_replay.differentiate.design import KernelSpec, input_taps, uniform_taps
from wmr_replay.differentiate.direct import direct_rows
from wmr_replay.differentiate.exact import anchored_taps
from wmr_replay.differentiate.fir import apply_taps
from wmr_replay.differentiate.irregular import irregular_rows, make_fit
from wmr_replay.differentiate.uniform import anchor_powers, uniform_rows
from wmr_replay.differentiate.windows import Windows
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S, Bool
from wmr_schemas.status import Status

MAX_BLOCK_DEGREE, MAX_MOMENT = 6, 10
"""Largest D = top + κ + μ and 2 top + κ + μ in blocks: a polynomial over half of [−1, 1] loses up to a factor
5.8^D, and the normal matrix holds moments up to the latter. Within these the backends agree to 1e-9 sd.
"""
SUMS = np.array([1.0, 0.0, 0.0])
"""Of the taps of order 0, 1 and 2; an input's taps sum to 1 too."""


class Answer(NamedTuple):
    """Estimates (s, 3, n), filtered inputs (k, n), Σ h_a h_b (3, 3, n), state (n,)."""

    estimates: F64
    inputs: F64
    gains: F64
    state: I8


class Backend(Protocol):
    """Both kinds of windows of one kernel."""

    def rows(self, signals: Signals, windows: Windows, n_old: int) -> Answer:
        """The rows from ``n_old`` on."""


def in_blocks(spec: KernelSpec) -> bool:
    """Whether the block backend holds a kernel to 1e-9 standard deviations."""
    weights = spec.kappa + spec.mu
    return spec.top_degree + weights <= MAX_BLOCK_DEGREE and 2 * spec.top_degree + weights <= MAX_MOMENT


def make_backend(spec: KernelSpec, n_taps: int, step_s: float, folds: tuple[int, ...]) -> Backend:
    """The backend for a kernel of ``n_taps`` taps: blocks where :func:`in_blocks`, else direct."""
    return (BlockBackend if in_blocks(spec) else DirectBackend)(spec, n_taps, step_s, folds)


def split(windows: Windows, n_old: int) -> tuple[Bool, I64]:
    """The new rows with a uniform window, as a mask, and those with another whole window, as indices."""
    new = np.arange(len(windows.state)) >= n_old
    uniform = windows.uniform & new
    return uniform, np.flatnonzero((windows.state == Status.OK) & new & ~uniform)


def start_answer(signals: Signals, uniform: Bool, n_old: int, gains: F64) -> Answer:
    """NaN, but for the gains of uniform windows; where all rows from ``n_old`` on are uniform, estimates and
    inputs are left empty: each of them is filled.
    """
    n = len(uniform)
    shapes = (len(signals.samples), 3, n), (len(signals.inputs), n), (3, 3, n)
    estimates, inputs, known = (np.empty(shape) for shape in shapes)
    known[:] = gains[:, :, None]
    if not uniform[n_old:].all():
        estimates[:], inputs[:], known[:, :, ~uniform] = np.nan, np.nan, np.nan
    return Answer(estimates, inputs, known, np.empty(0, np.int8))


def cut(answer: Answer, windows: Windows, n_old: int) -> Answer:
    """The new rows; windows whose instants did not determine the fit are gaps."""
    state = windows.state[n_old:].copy()
    gains = answer.gains[:, :, n_old:]
    state[(state == Status.OK) & np.isnan(gains[0, 0])] = Status.GAP
    return Answer(answer.estimates[:, :, n_old:], answer.inputs[:, n_old:], gains, state)


class BlockBackend:
    """Sums over blocks: constant work per row, whatever the window's length."""

    def __init__(self, spec: KernelSpec, n_taps: int, step_s: float, folds: tuple[int, ...]) -> None:
        taps = uniform_taps(spec, n_taps, step_s)
        self._gains, self._step_s = taps @ taps.T, step_s
        anchored = anchored_taps(spec, n_taps, step_s)
        self._design = (anchor_powers(n_taps, anchored.shape[1]), anchored)
        self._fit = make_fit(spec, round((n_taps - 1) * step_s * NS_PER_S))

    def rows(self, signals: Signals, windows: Windows, n_old: int) -> Answer:
        """See :class:`Backend`."""
        uniform, irregular = split(windows, n_old)
        answer = start_answer(signals, uniform, n_old, self._gains)
        if uniform.any():
            uniform_rows(signals, self._step_s, uniform, self._design, answer[:2])
        if irregular.size:
            irregular_rows(signals, windows.first, irregular, self._fit, answer[:3])
        return cut(answer, windows, n_old)


class DirectBackend:
    """The work of a window in each row, for kernels of high degree or with steep weights."""

    def __init__(self, spec: KernelSpec, n_taps: int, step_s: float, folds: tuple[int, ...]) -> None:
        self._taps = uniform_taps(spec, n_taps, step_s)
        self._input_taps = [input_taps(self._taps[fold], step_s, fold)[None, :-1] for fold in folds]
        self._gains = self._taps @ self._taps.T
        self._exponents = (spec.kappa, spec.mu)
        self._fit = make_fit(spec, round((n_taps - 1) * step_s * NS_PER_S))

    def rows(self, signals: Signals, windows: Windows, n_old: int) -> Answer:
        """See :class:`Backend`."""
        uniform, irregular = split(windows, n_old)
        answer = start_answer(signals, uniform, n_old, self._gains)
        for s, signal in enumerate(signals.samples):
            apply_taps(self._taps, SUMS, signal, uniform, answer.estimates[s])
        for k, taps in enumerate(self._input_taps):
            apply_taps(taps, SUMS[:1], signals.inputs[k], uniform, answer.inputs[k : k + 1])
        if irregular.size:
            direct_rows(signals, windows.first, irregular, self._exponents, self._fit, answer[:3])
        return cut(answer, windows, n_old)
