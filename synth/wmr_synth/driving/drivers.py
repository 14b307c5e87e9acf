"""Drivers: torque profiles fixed beforehand, and a closed loop on speed and yaw rate.

Both come down to columns on the torque grid that the compiled loop reads: a feedforward effort for each
wheel, two references, and the gains of a PI controller (zero in open loop). Robot conventions, N·m, m/s,
rad/s.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from wmr_schemas.arrays import F64

Profile: TypeAlias = Callable[[F64], tuple[F64, F64]]
"""Two columns as functions of the time since the start in s, shape (n,) in and out."""


class Gains(NamedTuple):
    """PI gains towards an acceleration, in 1/s and 1/s², and the effort limit of a wheel in N·m.

    The others correct the references by the distance from a path (Kanayama et al., 1990); 0: nobody does.
    """

    proportional_per_s: float
    integral_per_s2: float
    limit_nm: float
    ahead_per_s: float = 0.0
    across_per_m2: float = 0.0
    heading_per_s: float = 0.0


MODERATE = Gains(proportional_per_s=2.0, integral_per_s2=0.5, limit_nm=40.0)


@dataclass(frozen=True, eq=False)
class Commands:
    """What the driver wants at each torque stamp; every column has shape (n,)."""

    left_nm: F64
    right_nm: F64
    v_long_mps: F64
    yaw_rate_radps: F64
    gains: Gains
    path: F64 | None = None
    """x, y, yaw (3, n) in m and rad where the references lead; None: nobody looks."""

    def rows(self, yaw_offset_rad: float = 0.0) -> F64:
        """What the compiled loops read, (n, 9): efforts left and right, both references; of the path x, y,
        cos yaw, sin yaw and the angle that the plant has there, yaw + ``yaw_offset_rad``.
        """
        x, y, yaw = np.zeros((3, len(self.left_nm))) if self.path is None else self.path
        columns = (self.left_nm, self.right_nm, self.v_long_mps, self.yaw_rate_radps)
        placed = (x, y, np.cos(yaw), np.sin(yaw), yaw + yaw_offset_rad)
        return np.ascontiguousarray(np.stack((*columns, *placed), axis=1))


@dataclass(frozen=True)
class OpenLoop:
    """Efforts (left, right) as functions of time, whatever the robot does."""

    efforts_nm: Profile

    def commands(self, t_s: F64) -> Commands:
        """The efforts at ``t_s``, with the loop left open."""
        left_nm, right_nm = self.efforts_nm(t_s)
        nothing = np.zeros_like(t_s)
        return Commands(left_nm, right_nm, nothing, nothing, Gains(0.0, 0.0, np.inf))


@dataclass(frozen=True)
class ClosedLoop:
    """References (v_long, yaw_rate), followed by PI control through the nominal α, within an effort limit.

        effort_right ± effort_left = (1/α) (k_p e + k_i ∫e dt)

    with e the speed error for the sum, l times the yaw rate error (and α_yaw) for the difference. Integrators
    hold while a wheel is at its limit.
    """

    references: Profile
    gains: Gains = MODERATE

    def commands(self, t_s: F64) -> Commands:
        """The references at ``t_s``."""
        v_long_mps, yaw_rate_radps = self.references(t_s)
        nothing = np.zeros_like(t_s)
        return Commands(nothing, nothing, v_long_mps, yaw_rate_radps, self.gains)


@dataclass(frozen=True)
class FollowedSpeeds:
    """As :class:`ClosedLoop`, with the acceleration that the references ask for as feedforward:

        effort_right ± effort_left = (1/α) (da/dt + k_p e + k_i ∫e dt)

    with a the reference speed for the sum, l times the yaw rate (and α_yaw) for the difference. ``responses``
    are α and α_yaw of the nominal robot. With the gains for it, the references are corrected towards the path
    that they lead along from the origin.
    """

    references: Profile
    responses: tuple[float, float]
    half_track_m: float
    gains: Gains = MODERATE

    def commands(self, t_s: F64) -> Commands:
        """The references at ``t_s``; the feedforward of a step is its mean acceleration."""
        v_long_mps, yaw_rate_radps = self.references(t_s)
        total = slopes(t_s, v_long_mps) / self.responses[0]
        difference = slopes(t_s, self.half_track_m * yaw_rate_radps) / self.responses[1]
        left_nm, right_nm = (total - difference) / 2, (total + difference) / 2
        path = led_to(t_s, v_long_mps, yaw_rate_radps)
        return Commands(left_nm, right_nm, v_long_mps, yaw_rate_radps, self.gains, path)


def led_to(t_s: F64, v_long_mps: F64, yaw_rate_radps: F64) -> F64:
    """x, y, yaw (3, n) of a robot that follows the references exactly from the origin on (midpoint rule)."""
    step_s = np.diff(t_s)
    v, yaw_rate = ((column[1:] + column[:-1]) / 2 for column in (v_long_mps, yaw_rate_radps))
    yaw = np.concatenate([[0.0], np.cumsum(yaw_rate * step_s)])
    middle = (yaw[1:] + yaw[:-1]) / 2
    steps = v * step_s * np.stack([np.cos(middle), np.sin(middle)])
    return np.stack([*np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1), yaw])


def slopes(t_s: F64, column: F64) -> F64:
    """Slope (n,) of each step ahead; 0 in the last row."""
    return np.append(np.diff(column) / np.diff(t_s), 0.0)


Driver: TypeAlias = OpenLoop | ClosedLoop | FollowedSpeeds


def constant_effort(per_wheel_nm: float) -> OpenLoop:
    """The same constant effort on both wheels."""

    def efforts_nm(t_s: F64) -> tuple[F64, F64]:
        column = np.full_like(t_s, per_wheel_nm)
        return column, column

    return OpenLoop(efforts_nm)


@dataclass(frozen=True)
class Waypoints:
    """References given at knots and joined by straight lines; ``period_s`` repeats them."""

    t_s: tuple[float, ...]
    v_long_mps: tuple[float, ...]
    yaw_rate_radps: tuple[float, ...]
    period_s: float | None = None

    def __call__(self, t_s: F64) -> tuple[F64, F64]:
        """The references at ``t_s``."""
        at = t_s if self.period_s is None else np.mod(t_s, self.period_s)
        return np.interp(at, self.t_s, self.v_long_mps), np.interp(at, self.t_s, self.yaw_rate_radps)
