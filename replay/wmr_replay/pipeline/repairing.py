"""Repair of the pose and its noise level, both chosen again where the pose's rate changes."""

from dataclasses import replace

import numpy as np

from wmr_replay.align import PoseRepair, SampleBatch, concatenate
from wmr_replay.differentiate import NoiseTracker
from wmr_replay.pipeline.rate_watch import MOST, WATCHED, RateWatch
from wmr_replay.pipeline.stretch import InitialLevels, initial_levels
from wmr_schemas.arrays import F64


class Repairing:
    """Stage: measured rows → the same rows with outliers marked and jumps taken out.

    A caller pushes at most ``rows_left`` rows, and calls ``change_rate`` where none are left.
    """

    def __init__(self, levels: InitialLevels, stretch: SampleBatch, noise_time_constant_s: float) -> None:
        self._levels, self._time_constant_s = levels, noise_time_constant_s
        self._repair = PoseRepair(
            step_s=levels.step_s, position_sd_m=levels.position_sd_m, yaw_sd_rad=levels.yaw_sd_rad
        )
        self._noise = self._tracker(levels)
        self._rate, self.recent = RateWatch(levels.step_s), stretch.part(slice(0))
        """``recent``: the last rows that are no outliers."""

    def _tracker(self, levels: InitialLevels) -> NoiseTracker:
        return NoiseTracker(levels.sigma, step_s=levels.step_s, time_constant_s=self._time_constant_s)

    @property
    def step_s(self) -> float:
        """Step of the pose, as its rate is now."""
        return self._rate.step_s

    @property
    def n_jumps(self) -> int:
        """Jumps of the pose so far."""
        return self._repair.n_jumps

    @property
    def n_outliers(self) -> int:
        """Outliers among the poses so far."""
        return self._repair.n_outliers

    def rows_left(self, rows: SampleBatch) -> int:
        """How many of the rows come before the pose's next change of rate."""
        return self._rate.rows_left(rows.t_ns, rows.kept)

    def change_rate(self, t_ns: int) -> InitialLevels:
        """The row at ``t_ns`` shows another rate: the levels, with step and noise of the rows just before."""
        step_s, recent = self._rate.restart(t_ns), self.recent.part(slice(-MOST, None))
        levels = replace(initial_levels(recent), step_s=step_s, start_ns=self._levels.start_ns)
        self._repair.change_rate(step_s, levels.position_sd_m, levels.yaw_sd_rad)
        self._noise = self._tracker(levels)
        return levels

    def push(self, rows: SampleBatch) -> SampleBatch:
        """The rows, repaired."""
        self._rate.push(rows.t_ns[rows.kept])
        rows = self._repair.push(rows)
        both = concatenate([self.recent, rows.without_outliers().part(slice(-WATCHED, None))])
        self.recent = both.part(slice(-WATCHED, None))
        return rows

    def variances(self, kept: SampleBatch) -> F64:
        """Variances (2, n) of position and yaw at repaired rows without outliers."""
        x, y, yaw = self._noise.push(kept.t_ns, kept.pose) ** 2
        return np.stack([(x + y) / 2, yaw])
