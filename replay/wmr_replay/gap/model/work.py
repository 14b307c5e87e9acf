"""How much an analysis has worked on a log, in rows that a filter went through, and how much it may.

Work is counted and not timed, so that a log has the same answer on every machine.
"""

from weakref import WeakKeyDictionary

import numpy as np

from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.signals import PoseTrack


class Work:
    """Work on one log: ``rows`` so far, of at most ``most``."""

    def __init__(self, most: float = np.inf) -> None:
        self.rows, self.most = 0.0, most
        self.left_out: dict[str, None] = {}

    def add(self, rows: float) -> None:
        """Count some more."""
        self.rows += rows

    def allows(self, what: str) -> bool:
        """Whether something more may be tried; what may not is remembered as left out."""
        if self.rows < self.most:
            return True
        self.left_out[what] = None
        return False


WORK: WeakKeyDictionary[PoseTrack, Work] = WeakKeyDictionary()
"""The work on the logs that are analysed, by their poses, which all their forms share."""


def work_on(pose: PoseTrack) -> Work:
    """The work on a log; without a limit where none was set."""
    return WORK.setdefault(pose, Work())


def n_bins(pose: PoseTrack, settings: GateSettings) -> float:
    """How many rows the bins of a log make."""
    return (int(pose.t_ns[-1]) - int(pose.t_ns[0])) / NS_PER_S / settings.bins.bin_s


def begin_work(pose: PoseTrack, most: float) -> Work:
    """Count the work on a log from here on, up to ``most`` rows."""
    work = WORK[pose] = Work(most)
    return work
