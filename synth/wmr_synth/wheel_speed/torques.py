"""Wheel torques of a robot that wheel speeds drive: what its motors give so that its wheels turn as they do.

    τ_i = r m f_i + I_φ dφ̇_i/dt + r c g m (carried/2) sign(φ̇_i)

f_i is the specific traction of a wheel out of the contact, I_φ the inertia of the wheel with its drive, and c
the resistance to rolling, which the wheel has and the robot's base model has not. Nothing here moves the
robot: the motion of a log is the same with and without torques.
"""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters
from wmr_synth.plants.limited_traction import GRAVITY_MPS2
from wmr_synth.wheel_speed.chassis import WheelRobot

TorquesAs: TypeAlias = Literal["together", "apart", "none"]
"""How a log holds torques: in the messages of the wheel speeds, in a channel of their own, or not at all."""
MASS_KG = 40.0
"""Stated mass where a robot has none."""
MASS_ERROR, INERTIA_ERROR = 0.2, 0.3
"""A stated mass, and a stated inertia, is off by up to this share: loads, batteries, gears."""
SPINNING = (0.02, 0.12)
"""2 I_φ/(m r²): what of a robot's inertia against accelerating is that of its wheels and gears."""
RESISTANCE = (0.0, 0.03)
"""Coefficient of rolling resistance, from steel on steel to soft tyres on carpet."""
STANDS_MPS = 0.02
"""Resistance changes its sign over this rim speed."""


@dataclass(frozen=True)
class Drivetrain:
    """What is true of a robot's drive: mass, inertia of a wheel, and resistance to rolling."""

    mass_kg: float
    wheel_inertia_kgm2: float
    resistance: float


def drawn_drivetrain(
    robot: WheelRobot, stated: RobotParameters, rng: np.random.Generator
) -> tuple[Drivetrain, RobotParameters]:
    """A drivetrain about the ``stated`` parameters, and these with what they lack of mass and inertias."""
    mass_error, inertia_error = rng.uniform(-1, 1, 2) * (MASS_ERROR, INERTIA_ERROR)
    spinning, resistance = rng.uniform(*SPINNING), rng.uniform(*RESISTANCE)
    mass_kg = stated.mass_kg or MASS_KG
    inertia = stated.wheel_inertia_kgm2 or spinning * mass_kg * robot.stated_radius_m**2 / 2
    true = Drivetrain(
        float(mass_kg * (1 + mass_error)), float(inertia * (1 + inertia_error)), float(resistance)
    )
    yaw_inertia = stated.yaw_inertia_kgm2 or mass_kg * robot.gyration_m**2
    alpha = stated.alpha or 1 / (robot.stated_radius_m * (mass_kg + 2 * inertia / robot.stated_radius_m**2))
    stated = replace(
        stated, alpha=alpha, mass_kg=mass_kg, wheel_inertia_kgm2=inertia, yaw_inertia_kgm2=yaw_inertia
    )
    return true, stated


def true_alpha(drivetrain: Drivetrain, robot: WheelRobot) -> float:
    """dv_long/dt over Σeffort of wheels that grip, without resistance."""
    radius = robot.wheel_radius_m
    return 1 / (radius * (drivetrain.mass_kg + 2 * drivetrain.wheel_inertia_kgm2 / radius**2))


def effort_nm(
    traction_mps2: F64, spin_radps2: F64, speed_radps: F64, of: Drivetrain, robot: WheelRobot
) -> F64:
    """Torque (n,) of one wheel by its specific traction, its angular acceleration and its speed."""
    radius = robot.wheel_radius_m
    load = GRAVITY_MPS2 * robot.carried / 2
    against = of.resistance * load * np.tanh(speed_radps * (radius / STANDS_MPS))
    torque: F64 = radius * of.mass_kg * (traction_mps2 + against) + of.wheel_inertia_kgm2 * spin_radps2
    return torque
