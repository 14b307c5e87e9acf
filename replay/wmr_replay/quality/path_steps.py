"""The path in steps: how far it is turned against the heading, and how both turn.

Steps are of length, a little longer for a quicker robot: a robot at rest says nothing. All sums run on from
the log's first row, so that no batch changes a bit of them.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.interface import Observed
from wmr_schemas.arrays import F64, I64

LEAST_SPEED_MPS = 0.05
"""Slower motion has no direction: trackers creep as fast."""
LEAST_SPEED_SD = 10.0
"""A slower velocity, in its own standard deviations, has a direction known to .1 rad at best."""
REST_MPS, REST_SD = 0.03, 3.0
"""At rest: slower than that, or than so many standard deviations."""
STEP_M, STEP_S = 0.15, 0.2
"""A step is .15 m and the way of .2 s: a tenth of a small robot's turning circle, and quicker robots steer in
time rather than in length."""
LONGEST_STEP_S = 2.0
"""Over longer holes no path is known."""

N_SUMS, STEP_NUMBER = 12, 11


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
    """Stage: rows → the steps that they complete."""

    def __init__(self) -> None:
        self._sums = np.zeros((N_SUMS, 1))
        self._at_step = np.zeros((N_SUMS, 1))
        self._last_s = np.nan

    def push(self, rows: Observed) -> Steps:
        """The next rows, n of them."""
        sums = np.cumsum(np.concatenate([self._sums, self._amounts(rows)], axis=1), axis=1)
        ends = np.flatnonzero(np.diff(np.floor(sums[STEP_NUMBER])) > 0)
        at = sums[:, ends + 1]
        whole = np.diff(np.concatenate([self._at_step, at], axis=1), axis=1)
        self._sums = sums[:, -1:]
        if len(ends):
            self._at_step = at[:, -1:]
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

    def _amounts(self, rows: Observed) -> F64:
        """What every row adds to the sums (N_SUMS, n)."""
        m = rows.motion
        step_s = self._durations(rows.t_s)
        speed = np.hypot(m.v_long_mps, m.v_lat_mps)
        known = np.isfinite(speed) & np.isfinite(m.yaw_rate_radps)
        moving = known & (speed >= np.maximum(LEAST_SPEED_MPS, LEAST_SPEED_SD * m.v_long_mps_sd))
        resting = known & (speed < np.maximum(REST_MPS, REST_SD * m.v_long_mps_sd))
        safe = np.where(moving, speed, 1.0)
        wheels = np.nan_to_num(rows.smoothed[2] + rows.smoothed[3])
        per_m = np.stack([
            np.ones_like(speed),
            m.v_long_mps < 0,
            m.v_long_mps * wheels < 0,
            wheels != 0,
            (m.v_long_mps**2 - m.v_lat_mps**2) / safe**2,
            2 * m.v_long_mps * m.v_lat_mps / safe**2,
            rows.smoothed_pose[2],
            (m.v_lat_mps_sd / safe) ** 2,
            m.yaw_rate_radps * speed,
        ])  # fmt: skip
        added = np.where(moving, per_m * (speed * step_s), 0.0)
        turned = np.where(known, m.yaw_rate_radps * step_s, 0.0)
        rest_s = np.where(resting, step_s, 0.0)
        return np.concatenate([added, [turned, rest_s, added[0] / (STEP_M + STEP_S * safe)]])

    def _durations(self, t_s: F64) -> F64:
        """Time (n,) since the row before, 0 for the log's first."""
        before = t_s[:1] if np.isnan(self._last_s) else np.array([self._last_s])
        if len(t_s):
            self._last_s = float(t_s[-1])
        return np.minimum(np.diff(np.concatenate([before, t_s])), LONGEST_STEP_S)
