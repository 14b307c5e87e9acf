"""What happens in a scenario of a robot that wheel speeds drive: chassis, floor and driver."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_synth.driving.drivers import Profile
from wmr_synth.wheel_speed.chassis import NOMINAL_ERROR, Chassis
from wmr_synth.wheel_speed.drive import Tracking
from wmr_synth.wheel_speed.ground import ICY, Floor
from wmr_synth.wheel_speed.loop import Reference
from wmr_synth.wheel_speed.torques import TorquesAs

CommandsAs: TypeAlias = Literal["wheels", "twist", "none"]
"""How a log holds the commands: as wheel speeds, as a twist by the stated lengths, or not at all."""
OPEN_LOOP = Tracking()
Driver: TypeAlias = Callable[[float, np.random.Generator], Profile]
"""References of speed in m/s and yaw rate in rad/s for a duration in s."""


@dataclass(frozen=True)
class RollingPlan:
    """The plan; ``nominal_error`` is the share by which the stated lengths may be wrong, ``textbook`` leaves
    out what the base model of wheel speeds has not (see :meth:`.Chassis.drawn`).
    """

    chassis: Chassis
    driver: Driver
    floor: Floor = ICY
    tracking: Tracking = OPEN_LOOP
    nominal_error: float = NOMINAL_ERROR
    textbook: bool = False
    commands: CommandsAs = "wheels"
    torques: TorquesAs = "none"

    def reference(self, duration_s: float, command_ns: I64, rng: np.random.Generator) -> Reference:
        """The driver's references at the command stamps."""
        t_s = command_ns / NS_PER_S
        v_mps, yaw_rate_radps = self.driver(duration_s, rng)(t_s)
        path = path_of(t_s, v_mps, yaw_rate_radps)
        return Reference(command_ns, np.column_stack([v_mps, yaw_rate_radps, *path]), self.tracking)


def path_of(t_s: F64, v_mps: F64, yaw_rate_radps: F64) -> tuple[F64, F64, F64]:
    """(x, y, yaw) of rolling at the given speeds from the origin, by the trapezoidal rule."""
    yaw = integral(t_s, yaw_rate_radps)
    return integral(t_s, v_mps * np.cos(yaw)), integral(t_s, v_mps * np.sin(yaw)), yaw


def integral(t_s: F64, rate: F64) -> F64:
    """∫ rate dt from the first instant on."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t_s))])
