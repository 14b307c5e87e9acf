"""Where something was found: runs of marked rows, carried on from batch to batch."""

import numpy as np

from wmr_schemas.arrays import F64, I64, Bool

MOST_STRETCHES = 8
"""So many are kept; a list of more is not read."""


class Stretches:
    """``push(t_s, marked)`` rows in order; ``n`` marked rows in ``n_stretches`` runs, the first kept."""

    def __init__(self) -> None:
        self.n = 0
        self.n_stretches = 0
        self.kept: list[tuple[float, float]] = []
        self._open = False

    def push(self, t_s: F64, marked: Bool) -> None:
        """The next rows (n,) and which of them are marked."""
        if not len(t_s):
            return
        if not (self._open or marked.any()):
            return
        before = np.concatenate([[self._open], marked[:-1]])
        begins = np.flatnonzero(marked & ~before)
        after = np.concatenate([marked[1:], [False]])
        ends = np.flatnonzero(marked & ~after)
        self._extend(t_s, begins, ends, continued=bool(self._open and marked[0]))
        self.n += int(np.count_nonzero(marked))
        self.n_stretches += len(begins)
        self._open = bool(marked[-1])

    def _extend(self, t_s: F64, begins: I64, ends: I64, *, continued: bool) -> None:
        """Carry the open stretch on, and keep new ones while there is room."""
        if continued:
            if self.n_stretches <= MOST_STRETCHES:
                self.kept[-1] = (self.kept[-1][0], float(t_s[ends[0]]))
            ends = ends[1:]
        room = MOST_STRETCHES - len(self.kept)
        self.kept += [(float(t_s[b]), float(t_s[e])) for b, e in zip(begins[:room], ends[:room], strict=True)]

    @property
    def where(self) -> tuple[tuple[float, float], ...]:
        """The first stretches, from and to in s."""
        return tuple(self.kept)
