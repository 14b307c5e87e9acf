"""Which samples stand behind each row, and whether they are enough: the gap policy."""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I8, I64, Bool
from wmr_schemas.compiled.lean import lean
from wmr_schemas.status import Status

UNIFORM_TOLERANCE_NS = 2


class WindowRules(NamedTuple):
    """Constants of the windows. A row is ``WARMING_UP`` until the log is one window old. From then on it is a
    ``GAP`` when two neighbours in the window lie further apart than ``hole_ns``, when the oldest sample is
    younger than T − ``hole_ns``, or when fewer than ``least`` samples are there; else it is ``OK``. Nothing
    is carried over a hole: estimates return as soon as the window holds enough again.
    """

    window_ns: int
    step_ns: float
    hole_ns: int
    n_taps: int
    least: int


class Windows(NamedTuple):
    """By row: the window's first sample, state, uniformity and coverage; and how many holes came."""

    first: I64
    state: I8
    uniform: Bool
    coverage: F64
    n_holes: int


def find_windows(t_ns: I64, restarts: Bool, n_old: int, start_ns: int, rules: WindowRules) -> Windows:
    """The windows of the rows from ``n_old`` on; ``t_ns`` (n,) reaches back as far as the oldest of them.

    A window is uniform when it holds L samples, every step within 2 ns of the nominal one, and spans T.
    ``coverage`` is the number of samples over L. No window reaches back behind a row of ``restarts`` (n,).
    """
    n = len(t_ns)
    first, state = np.zeros(n, np.int64), np.full(n, Status.WARMING_UP, np.int8)
    uniform, coverage = np.zeros(n, np.bool_), np.zeros(n)
    n_holes = fill_windows(t_ns, restarts, n_old, start_ns, rules, first, state, uniform, coverage)
    return Windows(first, state, uniform, coverage, n_holes)


@lean
def fill_windows(  # noqa: PLR0913, PLR0917 – compiled; arrays that it fills
    t_ns: I64,
    restarts: Bool,
    n_old: int,
    start_ns: int,
    rules: WindowRules,
    first: I64,
    state: I8,
    uniform: Bool,
    coverage: F64,
) -> int:
    """Fill the columns of :class:`Windows`, whose rows are all warming up; returns the number of holes."""
    oldest, run, behind_hole, n_holes = 0, 0, 0, 0
    for i in range(len(t_ns)):
        step = t_ns[i] - t_ns[i - 1] if i > 0 else 0
        run = run + 1 if i > 0 and abs(step - rules.step_ns) <= UNIFORM_TOLERANCE_NS else 0
        if step > rules.hole_ns:
            behind_hole = i
            if i >= n_old:
                n_holes += 1
        if restarts[i]:
            behind_hole = i
        while t_ns[oldest] < t_ns[i] - rules.window_ns - UNIFORM_TOLERANCE_NS:
            oldest += 1
        first[i], count = oldest, i - oldest + 1
        coverage[i] = count / rules.n_taps
        if t_ns[i] - start_ns < rules.window_ns - rules.step_ns / 2:
            continue
        span = t_ns[i] - t_ns[oldest]
        covered = count >= rules.least and behind_hole <= oldest and rules.window_ns - span <= rules.hole_ns
        state[i] = Status.OK if covered else Status.GAP
        whole = count == rules.n_taps and run >= rules.n_taps - 1
        uniform[i] = covered and whole and abs(span - rules.window_ns) <= UNIFORM_TOLERANCE_NS
    return n_holes
