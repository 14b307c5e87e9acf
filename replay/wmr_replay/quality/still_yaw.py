"""A yaw that keeps its value to the bit while the robot moves across it: never filled in, or held."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.quality.interface import Observed
from wmr_schemas.arrays import F64, I64, Bool


@dataclass(frozen=True)
class StillRules:
    """When a constant yaw is no measurement."""

    same_rad: float = 1e-9
    """Products of quaternions round to 10⁻¹⁶; no sensor is that quiet."""
    first_s: float = 0.5
    """A yaw that has never changed since the log's start."""
    later_s: float = 2.0
    """A yaw that has changed before: some compasses come once a second beside positions at 10 Hz."""
    least_m: float = 0.05
    """Way across the yaw, beyond what trackers creep."""
    least_sd: float = 8.0
    """The same in standard deviations of the position: two of them differ by 1.4, and the largest of a
    thousand lies at 3.3."""
    least_share: float = 0.15
    """Of the way across in the way along: 8.5°, what rubber tyres that grip stay below, and far beyond
    rounding of a yaw to a degree."""


RULES = StillRules()


class StillYaw:
    """Stage: rows → whether the yaw has stood still for too long at each."""

    def __init__(self) -> None:
        self._since = np.full((4, 1), np.nan)
        self._first = True
        self._found = False
        self.found_rad = np.nan
        """The yaw that stood still first."""

    def push(self, rows: Observed) -> Bool:
        """Mask (n,) of the next rows."""
        n = len(rows.t_s)
        if not n:
            return np.zeros(0, bool)
        now = np.stack([rows.t_s, *rows.pose_raw])
        first_row = np.isnan(self._since[0, 0])
        if not first_row and self._turns(rows):
            self._since, self._first, self._found = now[:, -1:], False, False
            return np.zeros(n, bool)
        columns = np.concatenate([now[:, :1] if first_row else self._since, now], axis=1)
        origin = self._origins(columns[3])
        still = self._still(columns, origin, rows.variances[0])
        found = self._carried(still, origin)
        self._since = columns[:, origin[-1:]]
        self._first = self._first and int(origin[-1]) == 0
        if found.any() and np.isnan(self.found_rad):
            self.found_rad = float(rows.pose_raw[2, int(np.argmax(found))])
        return found

    def _turns(self, rows: Observed) -> bool:
        """Whether the yaw changes from each row to the next, soon enough to be seen nowhere for long."""
        yaw = np.abs(np.diff(rows.pose_raw[2], prepend=self._since[3]))
        step_s = np.diff(rows.t_s, prepend=self._since[0])
        return bool(yaw.min() > RULES.same_rad and step_s.max() < RULES.first_s)

    @staticmethod
    def _origins(yaw: F64) -> I64:
        """For each row the column (n,) in which its yaw was first seen; column 0 is carried on."""
        changed = np.abs(np.diff(yaw)) > RULES.same_rad
        return np.maximum.accumulate(np.where(changed, np.arange(1, len(yaw)), 0))

    def _still(self, columns: F64, origin: I64, variance: F64) -> Bool:
        """Whether a row lies far enough across the yaw from where that was first seen, and late enough."""
        since_s, x, y, _ = columns[:, 1:] - columns[:, origin]
        cos, sin = np.cos(columns[3, 1:]), np.sin(columns[3, 1:])
        along, across = np.abs(x * cos + y * sin), np.abs(y * cos - x * sin)
        least_m = np.maximum(RULES.least_m, RULES.least_sd * np.sqrt(variance))
        long_s = np.where((origin == 0) & self._first, RULES.first_s, RULES.later_s)
        return np.asarray((since_s >= long_s) & (across >= least_m) & (across >= RULES.least_share * along))

    def _carried(self, still: Bool, origin: I64) -> Bool:
        """Found once, a stretch stays found until its yaw changes."""
        last = np.maximum.accumulate(np.where(still, np.arange(1, len(still) + 1), 0))
        found = np.where(origin == 0, self._found | (last > 0), last > origin)
        self._found = bool(found[-1])
        return np.asarray(found)
