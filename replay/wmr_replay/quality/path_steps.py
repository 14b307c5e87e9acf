"""The path in steps: how far it is turned against the heading, and how both turn.

Steps are of length, a little longer for a quicker robot: a robot at rest says nothing. All sums run on from
the log's first row, so that no batch changes a bit of them.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.interface import Observed
from wmr_replay.quality.sum_rules import N_SUMS
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_replay.quality.thinning import Thinning
from wmr_schemas.arrays import F64, I64

LONGEST_STEP_S = 2.0
"""Over longer holes no path is known."""


class Steps(NamedTuple):
    """k steps of the path. ``row`` (k,) ends each; ``length_m`` (k,) is its length.

    ``backwards_m`` (k,) is the length over which heading and wheels say different signs of the speed,
    ``compared_m`` (k,) that over which both are known, ``reversed_m`` (k,) that with v_long < 0.
    ``double`` (2, k): mean cosine and sine of twice the sideslip, course minus yaw: reversing is no
    sideslip. ``yaw_rad`` (k,) the mean yaw, unwrapped; ``variance`` (k,) of the sideslip by the pose's noise;
    ``lateral_mps2`` (k,) the mean of speed times yaw rate; ``turned_rad`` (k,) by how much the yaw turned;
    ``rest_s`` (k,) how long the robot rested during the step.
    """

    row: I64
    length_m: F64
    reversed_m: F64
    backwards_m: F64
    compared_m: F64
    double: F64
    yaw_rad: F64
    variance: F64
    lateral_mps2: F64
    turned_rad: F64
    rest_s: F64

    @property
    def sideslip_rad(self) -> F64:
        """Course minus yaw (k,), within ± π/2."""
        return np.asarray(np.arctan2(self.double[1], self.double[0]) / 2)


class PathSteps:
    """Stage: rows → the steps that they complete, by every few rows of a fast log."""

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._add_rows, self._thinning = sums.add_rows, Thinning()
        self._sums = np.zeros(N_SUMS)
        self._at_step = np.zeros((N_SUMS, 1))
        self._last_s = np.nan

    def push(self, rows: Observed) -> Steps:
        """The next rows, n of them."""
        at = self._thinning.push(rows.t_ns)
        found, ends = np.empty((len(at), N_SUMS)), np.empty(len(at), np.int64)
        k = self._add_rows(
            self._measured(rows, at), np.take(rows.smoothed[2:], at, axis=1), self._sums, ends, found
        )
        sums, ends = np.ascontiguousarray(found[:k].T), at[ends[:k]]
        whole = np.diff(np.concatenate([self._at_step, sums], axis=1), axis=1)
        if len(ends):
            self._at_step = sums[:, -1:]
        mean = whole[4:9] / whole[0]
        return Steps(
            ends,
            whole[0],
            whole[1],
            whole[2],
            whole[3],
            mean[:2],
            mean[2],
            mean[3],
            mean[4],
            whole[9],
            whole[10],
        )

    def _measured(self, rows: Observed, at: I64) -> F64:
        """What is summed up of the rows ``at`` (k,), (8, k)."""
        m = rows.motion
        v_long, v_lat, *others = (
            column.take(at)
            for column in (m.v_long_mps, m.v_lat_mps, m.yaw_rate_radps, m.v_long_mps_sd, m.v_lat_mps_sd)
        )
        yaw = rows.smoothed_pose[2].take(at)
        durations = self._durations(rows.t_s.take(at))
        return np.stack([durations, np.hypot(v_long, v_lat), v_long, v_lat, *others, yaw])

    def _durations(self, t_s: F64) -> F64:
        """Time (n,) since the row before, 0 for the log's first."""
        before = t_s[:1] if np.isnan(self._last_s) else np.array([self._last_s])
        if len(t_s):
            self._last_s = float(t_s[-1])
        return np.minimum(np.diff(np.concatenate([before, t_s])), LONGEST_STEP_S)
