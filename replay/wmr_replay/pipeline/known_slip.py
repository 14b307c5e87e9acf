"""What a model knows of slip that lasts: taken out of the wheel speeds, and out of the path sideways.

With v and ω of the wheels, a slip of the wheel-speed base adds (a, b, c) to the body's velocity ahead, to the
left and in yaw. Wheel speeds then read v + a and ω + c, and the poses that the banks get are those of a robot
that does not move by b:

    turning_slip   a = −k |ω| l v              slope_slip   a = x cos ψ + y sin ψ,  b = y cos ψ − x sin ψ
    slip_ratio     v lags by k, which is v − k dv/dt to the first order
    terms          coefficient · product, on a, b or c

A factor of dv/dt is left out: wheel speeds of a row do not tell it. A row depends on earlier rows alone.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from wmr_replay.align import Lag, SampleBatch
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import ASSUMED_RADIUS_M, RobotParameters
from wmr_schemas.slip_terms import SLIP_FACTORS, is_slip_term, parse_slip_term
from wmr_schemas.terms import COEFFICIENT

MOVING_RADPS = 0.02
"""Wheels that turn no faster stand, rad/s, as in the analysis."""
LEAST_LAG_S = 1e-6
BY_NAME = ("turning_slip", "slip_ratio", "slope_slip")


def is_known_slip(name: str) -> bool:
    """Whether a replay takes the effect out of the wheel speeds."""
    if not is_slip_term(name):
        return name in BY_NAME
    return all(SLIP_FACTORS[factor][0] != "a" for factor in parse_slip_term(name).factors)


class KnownSlip:
    """Stage: rows → rows whose wheel speeds have no known slip, and the shift (2, n) of the path in m."""

    def __init__(self, robot: RobotParameters, effects: Iterable[Effect]) -> None:
        self._radius_m = robot.wheel_radius_m or ASSUMED_RADIUS_M
        self._half_track_m = robot.half_track_m or np.inf
        self._effects = [(e.name, e.parameters) for e in effects if is_known_slip(e.name)]
        lag_s = sum(p["seconds"] for name, p in self._effects if name == "slip_ratio")
        self._lag = Lag(lag_s, 1) if lag_s > LEAST_LAG_S else None
        self._start_ns: int | None = None
        self._before_ns, self._shift_m = 0, np.zeros(2)

    @property
    def any(self) -> bool:
        """Whether the model has any."""
        return bool(self._effects)

    def push(self, rows: SampleBatch) -> tuple[SampleBatch, F64]:
        """Rows in increasing time."""
        if not self._effects or not len(rows):
            return rows, np.zeros((2, len(rows)))
        if self._start_ns is None:
            self._start_ns = self._before_ns = int(rows.t_ns[0])
        left, right = rows.inputs[2:] * self._radius_m
        v_mps, w_mps = (right + left) / 2, (right - left) / 2
        ahead, aside, turning = self._slip(rows, v_mps, w_mps)
        slow = v_mps if self._lag is None else self._lag.push(rows.t_ns, v_mps[None])[0]
        v_mps, w_mps = slow + ahead, w_mps + turning
        wheels = np.stack([v_mps - w_mps, v_mps + w_mps]) / self._radius_m
        inputs = np.concatenate([rows.inputs[:2], wheels])
        return replace(rows, inputs=inputs), self._shifted(rows, np.nan_to_num(aside, nan=0.0))

    def _slip(self, rows: SampleBatch, v_mps: F64, w_mps: F64) -> tuple[F64, F64, F64]:
        """Added velocities ahead, to the left, and in yaw times the half track."""
        yaw, yaw_rate = rows.pose[2], w_mps / self._half_track_m
        columns = {"v": v_mps, "yaw_rate": yaw_rate, "yaw": yaw}
        columns["t"] = (rows.t_ns - (self._start_ns or 0)) / NS_PER_S
        none = np.zeros(len(rows))
        found = {"v_long": none, "v_lat": none, "yaw_rate": none}
        for name, p in self._effects:
            for channel, added in self._added(name, p, columns, rows.inputs[2:]).items():
                found[channel] = found[channel] + added
        scale = self._half_track_m if np.isfinite(self._half_track_m) else 0.0
        return found["v_long"], found["v_lat"], scale * found["yaw_rate"]

    def _added(
        self, name: str, p: Mapping[str, float], columns: Mapping[str, F64], wheels: F64
    ) -> dict[str, F64]:
        """What one effect adds, by channel."""
        if is_slip_term(name):
            term = parse_slip_term(name)
            return {term.channel: p[COEFFICIENT] * term.evaluate(columns)}
        if name == "turning_slip":
            share = p["s_per_m"] * np.abs(columns["yaw_rate"]) * min(self._half_track_m, 1e3)
            return {"v_long": -share * columns["v"]}
        if name == "slope_slip":
            moving = (np.abs(wheels) > MOVING_RADPS).any(axis=0)
            cos, sin = np.cos(columns["yaw"]), np.sin(columns["yaw"])
            x, y = p["x_mps"], p["y_mps"]
            return {"v_long": moving * (cos * x + sin * y), "v_lat": moving * (cos * y - sin * x)}
        return {}

    def _shifted(self, rows: SampleBatch, aside_mps: F64) -> F64:
        """How far (2, n) the robot has slid to its left until each row, in the world's axes.

        The sum runs from row to row, so that any division into batches gives the same bits.
        """
        steps_s = np.diff(rows.t_ns, prepend=self._before_ns) / NS_PER_S
        yaw = rows.pose[2]
        slid = aside_mps * steps_s * np.stack([-np.sin(yaw), np.cos(yaw)])
        shift = np.cumsum(np.concatenate([self._shift_m[:, None], slid], axis=1), axis=1)[:, 1:]
        self._before_ns, self._shift_m = int(rows.t_ns[-1]), shift[:, -1].copy()
        return shift


def without_slide(pose: F64, slid_m: F64) -> F64:
    """Poses (3, n) of a robot that has not slid by ``slid_m`` (2, n)."""
    return np.concatenate([pose[:2] - slid_m, pose[2:]])
