"""Whether the pose comes at another rate than the one that the present design was made for."""

import numpy as np

from wmr_schemas.arrays import I64, NS_PER_S, Bool

CHANGED = 1.5
"""Steps longer or shorter by this factor are of another rate; a window works with half of its samples."""
WATCHED, MOST = 40, 30
"""Of the last 40 steps so many: 45 % of lost messages reach it once in 10⁴ times, a lasting change soon."""


class RateWatch:
    """``rows_left(t_ns, measured)`` rows before the next change; ``push`` those that were used up."""

    def __init__(self, step_s: float) -> None:
        self.step_s = step_s
        self._recent: I64 = np.empty(0, np.int64)

    def rows_left(self, t_ns: I64, measured: Bool) -> int:
        """How many of the rows (n,) come before the one at which most of the last steps of the ``measured``
        ones are of another rate.
        """
        steps = np.diff(np.concatenate([self._recent, t_ns[measured]]))
        if len(steps) < WATCHED:
            return len(t_ns)
        nominal_ns = self.step_s * NS_PER_S
        if steps.min() >= nominal_ns / CHANGED and steps.max() <= CHANGED * nominal_ns:
            return len(t_ns)
        n_old = max(len(self._recent) - 1, 0)
        changed = most(steps > CHANGED * nominal_ns) | most(steps < nominal_ns / CHANGED)
        ends = np.arange(WATCHED - 1, len(steps))
        found = ends[changed & (ends >= n_old)]
        if not found.size:
            return len(t_ns)
        row = int(found[0]) - n_old + (0 if len(self._recent) else 1)
        return int(np.flatnonzero(measured)[row])

    def push(self, t_ns: I64) -> None:
        """Stamps of measured rows that were used up."""
        self._recent = np.concatenate([self._recent, t_ns])[-(WATCHED + 1) :]

    def restart(self, t_ns: int) -> float:
        """A change at the row stamped ``t_ns``: the new step in s, the median of the last ``MOST`` ones."""
        steps = np.diff(np.append(self._recent, t_ns))[-MOST:]
        self.step_s = float(np.median(steps)) / NS_PER_S
        self._recent = self._recent[-1:]
        return self.step_s


def most(other: Bool) -> Bool:
    """Whether at least ``MOST`` of each ``WATCHED`` steps in a row (n,) are marked, (n − WATCHED + 1,)."""
    count = np.concatenate([[0], np.cumsum(other)])
    return np.asarray(count[WATCHED:] - count[:-WATCHED] >= MOST)
