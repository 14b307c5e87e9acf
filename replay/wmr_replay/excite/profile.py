"""A piece of a drive: reference speeds at knots, the path that follows, and the torques of the base model."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.model.dynamics import Base
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

GRID_S = 0.01
"""Knots lie on this grid, so that a torque step falls on a torque's stamp."""


@dataclass(frozen=True, eq=False)
class Profile:
    """Speed and yaw rate (k,) at knots ``t_s`` (k,) from 0 on, joined by straight lines."""

    t_s: F64
    v_mps: F64
    yaw_rate_radps: F64

    @classmethod
    def of(cls, legs: Iterable[tuple[float, float, float]]) -> "Profile":
        """From rest; each leg is (seconds, speed at its end, yaw rate at its end). Seconds are rounded up to
        the grid, so that no slope becomes steeper.
        """
        knots = [(0, 0.0, 0.0)]
        for seconds, v, yaw_rate in legs:
            steps = int(np.ceil(seconds / GRID_S - 1e-9))
            if steps > 0:
                knots.append((knots[-1][0] + steps, v, yaw_rate))
        t, v_mps, w = (np.array(column, np.float64) for column in zip(*knots, strict=True))
        return cls(t * GRID_S, v_mps, w)

    @property
    def duration_s(self) -> float:
        """The last knot."""
        return float(self.t_s[-1])

    def then(self, other: "Profile") -> "Profile":
        """The piece and another one behind it; both begin and end at rest."""
        return Profile(
            np.concatenate([self.t_s, self.duration_s + other.t_s[1:]]),
            np.concatenate([self.v_mps, other.v_mps[1:]]),
            np.concatenate([self.yaw_rate_radps, other.yaw_rate_radps[1:]]),
        )

    def and_back(self) -> "Profile":
        """The piece, then the same in reverse: −v(T − t), −yaw_rate(T − t) retraces the path to its start."""
        back = Profile(self.duration_s - self.t_s[::-1], -self.v_mps[::-1], -self.yaw_rate_radps[::-1])
        return self.then(back)

    def mirrored(self) -> "Profile":
        """The same with left and right exchanged."""
        return Profile(self.t_s, self.v_mps, -self.yaw_rate_radps)


def rest(seconds: float) -> Profile:
    """Standstill."""
    return Profile.of([(seconds, 0.0, 0.0)])


def joined(pieces: Iterable[Profile]) -> Profile:
    """Pieces one after the other."""
    whole, *others = pieces
    for piece in others:
        whole = whole.then(piece)
    return whole


@dataclass(frozen=True, eq=False)
class Reached:
    """A profile followed exactly from the origin on: time, speeds and pose (n,) on the grid of ``step_s``."""

    t_s: F64
    v_mps: F64
    yaw_rate_radps: F64
    x_m: F64
    y_m: F64
    yaw_rad: F64

    @classmethod
    def of(cls, profile: Profile, step_s: float) -> "Reached":
        """Speeds are exact; the path is that of the midpoint rule, as in the filter's own steps."""
        n = round(profile.duration_s / step_s)
        t_s = np.asarray(np.arange(n + 1) * step_s, np.float64)
        v = np.interp(t_s, profile.t_s, profile.v_mps)
        yaw_rate = np.interp(t_s, profile.t_s, profile.yaw_rate_radps)
        yaw = summed((yaw_rate[1:] + yaw_rate[:-1]) / 2, step_s)
        middle, mean = (yaw[1:] + yaw[:-1]) / 2, (v[1:] + v[:-1]) / 2
        x, y = summed(mean * np.cos(middle), step_s), summed(mean * np.sin(middle), step_s)
        return cls(t_s, v, yaw_rate, x, y, yaw)

    def torques(self, base: Base) -> tuple[F64, F64]:
        """Torques (n,) left and right with which the base model follows, each held from its time on."""
        step_s = np.diff(self.t_s)
        total = np.append(np.diff(self.v_mps) / step_s, 0.0) / base.alpha
        turning = base.half_track_m * np.diff(self.yaw_rate_radps) / step_s
        difference = np.append(turning, 0.0) / base.alpha_yaw
        return (total - difference) / 2, (total + difference) / 2

    def log(self, base: Base) -> Log:
        """The log of a robot that is the base model, measured without noise."""
        t_ns = np.rint(self.t_s * NS_PER_S).astype(np.int64)
        left, right = self.torques(base)
        unknown = np.full(len(t_ns), np.nan)
        pose = PoseTrack(t_ns, self.x_m, self.y_m, self.yaw_rad)
        return Log(pose, TorqueTrack(t_ns, left, right, unknown, unknown), None, RobotParameters())


def summed(rates: F64, step_s: float) -> F64:
    """The integral (n + 1,) of rates (n,), from 0 on."""
    return np.concatenate([[0.0], np.cumsum(rates) * step_s])
