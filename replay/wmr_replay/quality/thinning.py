"""Rows of fast logs that tell nothing new: what the pose does within 4 ms is noise."""

import numpy as np

from wmr_schemas.arrays import I64

STEP_NS = 4_000_000
"""A robot turns by .02 rad in it, and moves by 2 cm: less than the steps and means that are compared."""


class Thinning:
    """Stage: stamps → the rows to look at: the first in each 4 ms of their clock."""

    def __init__(self) -> None:
        self._last: int | None = None

    def push(self, t_ns: I64) -> I64:
        """Which (k,) of the next n rows."""
        steps = t_ns // STEP_NS
        if not len(steps):
            return steps
        before = steps[0] - 1 if self._last is None else self._last
        self._last = int(steps[-1])
        return np.flatnonzero(np.diff(steps, prepend=before))
