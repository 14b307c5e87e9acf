"""Chassis that wheel speeds drive: what a maker states of them, and what is true of one of them.

A differential drive rolls on two wheels, castors carry the rest of its weight. A skid-steer robot turns by
sliding its four wheels sideways: its wheels meet the ground as those of a differential drive with a longer
half-track l_e would, whose axle lies at the centre of rotation x_icr (Mandow et al. 2007, Martínez et al.
2005), and which slides outwards by k·v·yaw_rate.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.robot import RobotParameters

Kind = Literal["differential", "skid-steer"]
Between = tuple[float, float]
NOMINAL_ERROR = 0.03
"""A radius or a track differs from what its maker states by up to this share."""


@dataclass(frozen=True)
class WheelRobot:
    """What is true of a robot.

    ``half_track_m`` is l_e, ``stated_half_track_m`` the maker's l. ``gyration_m`` is √(I_θ/m), ``carried``
    the share of the weight on the driven wheels. ``slip_stiffness`` is the force by load and slip in grip,
    infinite where a wheel rolls without elastic slip. ``roughness`` is the standard deviation of the slip by
    uneven ground as a share of the rim speed. ``lag_s``, ``delay_s`` and ``acceleration_mps2`` are those of
    the drive.
    """

    kind: Kind
    wheel_radius_m: float
    half_track_m: float
    stated_radius_m: float
    stated_half_track_m: float
    icr_offset_m: float = 0.0
    lateral_slip_s: float = 0.0
    gyration_m: float = 0.25
    carried: float = 0.75
    slip_stiffness: float = 30.0
    roughness: float = 0.004
    lag_s: float = 0.08
    delay_s: float = 0.02
    acceleration_mps2: float = 3.0

    @property
    def nominal(self) -> RobotParameters:
        """What a user believes."""
        return RobotParameters(wheel_radius_m=self.stated_radius_m, half_track_m=self.stated_half_track_m)


@dataclass(frozen=True)
class Chassis:
    """A kind of robot: nominal lengths and what is drawn of one of them, each between two bounds.

    ``track_ratio`` is l_e over the stated half-track before that one's own error.
    """

    kind: Kind
    nominal: RobotParameters
    track_ratio: Between = (1.0, 1.0)
    icr_offset_m: Between = (0.0, 0.0)
    lateral_slip_s: Between = (0.0, 0.0)
    lag_s: Between = (0.05, 0.15)
    delay_s: Between = (0.01, 0.05)
    carried: float = 0.75

    def drawn(
        self,
        rng: np.random.Generator,
        nominal: RobotParameters,
        *,
        nominal_error: float = NOMINAL_ERROR,
        textbook: bool = False,
    ) -> WheelRobot:
        """One robot of the kind with the ``nominal`` lengths, each of them wrong by up to ``nominal_error``.

        A ``textbook`` one has no elastic or lateral slip of its own, no roughness and an immediate drive:
        with nothing hidden, the base model of wheel speeds is exact but for friction. The same draws are
        taken. Raises InvalidSetting where a length is missing.
        """
        radius_m, half_track_m = nominal.wheel_radius_m, nominal.half_track_m
        if radius_m is None or half_track_m is None:
            raise InvalidSetting("a robot that wheel speeds drive needs wheel_radius_m and half_track_m")
        errors = 1 + rng.uniform(-nominal_error, nominal_error, 2)
        bounds = (self.track_ratio, self.icr_offset_m, self.lateral_slip_s, self.lag_s, self.delay_s)
        ratio, icr_m, slip_s, lag_s, delay_s = (float(rng.uniform(*between)) for between in bounds)
        half_track = float(half_track_m * errors[1] * ratio)
        return WheelRobot(
            self.kind,
            float(radius_m * errors[0]),
            half_track,
            radius_m,
            half_track_m,
            icr_m,
            0.0 if textbook else slip_s,
            gyration_m=0.9 * half_track_m * (1.3 if self.kind == "skid-steer" else 1.0),
            carried=self.carried,
            slip_stiffness=np.inf if textbook else 30.0,
            roughness=0.0 if textbook else 0.004,
            lag_s=0.0 if textbook else lag_s,
            delay_s=0.0 if textbook else delay_s,
            acceleration_mps2=np.inf if textbook else 3.0,
        )

    def exact(self, nominal: RobotParameters) -> WheelRobot:
        """The robot that the base model says: nominal lengths, and nothing beyond them."""
        plain = Chassis(self.kind, self.nominal, carried=self.carried)
        return plain.drawn(np.random.default_rng(0), nominal, nominal_error=0.0, textbook=True)


DIFFERENTIAL = Chassis("differential", RobotParameters(wheel_radius_m=0.1, half_track_m=0.25))
SKID_STEER = Chassis(
    "skid-steer",
    RobotParameters(wheel_radius_m=0.165, half_track_m=0.28),
    track_ratio=(1.4, 2.2),
    icr_offset_m=(-0.08, 0.08),
    lateral_slip_s=(0.02, 0.12),
    lag_s=(0.1, 0.3),
    carried=1.0,
)
CHASSIS: dict[str, Chassis] = {chassis.kind: chassis for chassis in (DIFFERENTIAL, SKID_STEER)}
