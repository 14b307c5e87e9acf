"""Jumps of the pose that the identifier tells, besides those that the repair took out."""

import numpy as np

from wmr_schemas.arrays import Bool


class JumpsTold:
    """``push(told, taken_out)`` rows in order; ``n`` runs of rows told as jumps, none of them taken out.

    A count of jumps that is zero beside rows with the status ``pose_jump`` would contradict them.
    """

    def __init__(self) -> None:
        self.n = 0
        self._open = False

    def push(self, told: Bool, taken_out: Bool) -> None:
        """Which rows (n,) have the status ``pose_jump``, and which lie within a window after a jump that was
        taken out.
        """
        if not len(told):
            return
        if told.any():
            begins = told & ~np.concatenate([[self._open], told[:-1]])
            self.n += int(np.count_nonzero(begins & ~taken_out))
        self._open = bool(told[-1])
