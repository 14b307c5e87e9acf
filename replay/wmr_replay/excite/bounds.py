"""What a robot may do on a drive: speeds, torques, and an area to stay in."""

from dataclasses import dataclass, field

import numpy as np

from wmr_replay.excite.profile import Profile, Reached
from wmr_replay.excite.settings import ExciteSettings
from wmr_replay.gap.model.dynamics import Base
from wmr_schemas.arrays import F64
from wmr_schemas.errors import InvalidSetting

ROUNDING = 1e-3


@dataclass(frozen=True)
class Area:
    """A disc of ``radius_m`` about the start, or a box of ``box_m`` (ahead, across) centred at it; the robot
    starts along the box's first side.
    """

    radius_m: float = 4.0
    box_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        sides = (self.radius_m,) if self.box_m is None else self.box_m
        if not all(0 < side < np.inf for side in sides):
            raise InvalidSetting("an area needs a size above 0 m")

    @property
    def reach_m(self) -> float:
        """From the start to the nearest edge."""
        return self.radius_m if self.box_m is None else min(self.box_m) / 2

    def holds(self, x_m: F64, y_m: F64, margin_m: float = 0.0) -> bool:
        """Whether a path (n,) stays inside, ``margin_m`` from the edge."""
        if self.box_m is None:
            return bool(np.all(np.hypot(x_m, y_m) <= self.radius_m - margin_m))
        half_x, half_y = (side / 2 - margin_m for side in self.box_m)
        return bool(np.all(np.abs(x_m) <= half_x) and np.all(np.abs(y_m) <= half_y))


@dataclass(frozen=True)
class Bounds:
    """Largest speed, yaw rate, and torque of a wheel (None: what accelerates by 1.5 m/s²), the area, and
    whether the robot may drive in reverse. Raises InvalidSetting for a bound that leaves nothing to drive.
    """

    speed_mps: float = 1.5
    yaw_rate_radps: float = 1.5
    torque_nm: float | None = None
    area: Area = field(default_factory=Area)
    reverse: bool = True

    def __post_init__(self) -> None:
        for name, value in (("speed", self.speed_mps), ("yaw rate", self.yaw_rate_radps)):
            if not 0 < value < np.inf:
                raise InvalidSetting(f"the largest {name} must be above 0, not {value:g}")
        if self.torque_nm is not None and not 0 < self.torque_nm < np.inf:
            raise InvalidSetting(f"the largest torque must be above 0 N·m, not {self.torque_nm:g}")


@dataclass(frozen=True)
class Limits:
    """The bounds of one robot, with what a drive keeps in reserve."""

    bounds: Bounds
    base: Base
    settings: ExciteSettings

    @property
    def torque_nm(self) -> float:
        """Largest torque of a wheel."""
        given = self.bounds.torque_nm
        return given or self.settings.usual_acceleration_mps2 / (2 * self.base.alpha)

    @property
    def ahead_mps2(self) -> float:
        """Largest acceleration straight ahead."""
        return 2 * self.base.alpha * self.torque_nm * self.settings.torque_share

    @property
    def turning_radps2(self) -> float:
        """Largest angular acceleration on the spot."""
        share = self.settings.torque_share
        return 2 * self.base.alpha_yaw * self.torque_nm * share / self.base.half_track_m

    @property
    def margin_m(self) -> float:
        """What a nominal path keeps from the area's edge."""
        return min(self.settings.slack_m, self.settings.least_margin_share * self.bounds.area.reach_m)

    @property
    def reach_m(self) -> float:
        """How far a nominal path may go from the start; rounding of a path's sum stays below the rest."""
        return (1 - ROUNDING) * (self.bounds.area.reach_m - self.margin_m)

    def allow(self, profile: Profile) -> bool:
        """Whether a profile from the start on keeps to every bound."""
        reached, own, tiny = Reached.of(profile, self.settings.step_s), self.bounds, 1e-9
        left, right = reached.torques(self.base)
        most_nm = self.torque_nm * self.settings.torque_share + tiny
        return (
            float(np.max(np.abs(reached.v_mps))) <= own.speed_mps + tiny
            and float(np.max(np.abs(reached.yaw_rate_radps))) <= own.yaw_rate_radps + tiny
            and max(float(np.max(np.abs(left))), float(np.max(np.abs(right)))) <= most_nm
            and (own.reverse or float(np.min(reached.v_mps)) >= -tiny)
            and own.area.holds(reached.x_m, reached.y_m, self.margin_m)
        )
