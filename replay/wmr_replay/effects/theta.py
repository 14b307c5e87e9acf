"""The vector θ of everything that an effect changes in the motion or in the measured pose."""

from collections.abc import Callable, Iterable, Mapping
from enum import IntEnum

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX, own_effects

Values = Mapping[str, float]


class Theta(IntEnum):
    """Places in θ; all 0 is the base model. ``FRICTION_SPEED`` is the speed in m/s over which friction
    changes its sign, 0 for the usual one; ``HELD_SIDEWAYS`` is 1 where a slope moves no skid sideways.
    """

    MASS_RATIO = 0
    YAW_INERTIA = 1
    DRIVE_GAIN = 2
    ROLLING = 3
    VISCOUS = 4
    DRAG = 5
    SCRUB = 6
    YAW_DAMPING = 7
    WHEEL_COULOMB = 8
    WHEEL_VISCOUS = 9
    GRADE_X = 10
    GRADE_Y = 11
    COM_OFFSET = 12
    HEADING = 13
    ARM_X = 14
    ARM_Y = 15
    CORNERING = 16
    UNDECLARED = 17
    LOAD_STEP = 18
    PATCH = 19
    SLIP = 20
    EXTRA_LONG = 21
    EXTRA_YAW = 22
    YAW_DRIFT = 23
    FRICTION_SPEED = 24
    HELD_SIDEWAYS = 25
    SWIVEL = 26
    SUPPORT = 27
    SUPPORT_YAW = 28
    DRAG_YAW = 29


N_THETA = len(Theta)
PLACES: dict[tuple[str, str], Theta] = {
    ("payload", "mass_ratio"): Theta.MASS_RATIO,
    ("yaw_inertia", "ratio"): Theta.YAW_INERTIA,
    ("drive_gain", "ratio"): Theta.DRIVE_GAIN,
    ("rolling_resistance", "c0_mps2"): Theta.ROLLING,
    ("viscous_drag", "c1_per_s"): Theta.VISCOUS,
    ("aerodynamic_drag", "c2_per_m"): Theta.DRAG,
    ("aerodynamic_drag", "e2_per_m"): Theta.DRAG_YAW,
    ("scrub_torque", "d0_mps2"): Theta.SCRUB,
    ("yaw_damping", "d1_per_s"): Theta.YAW_DAMPING,
    ("swivel_friction", "s0_mps2"): Theta.SWIVEL,
    ("support_friction", "p0_mps2"): Theta.SUPPORT,
    ("support_friction", "d0_mps2"): Theta.SUPPORT_YAW,
    ("wheel_coulomb", "torque_nm"): Theta.WHEEL_COULOMB,
    ("wheel_viscous", "nm_per_radps"): Theta.WHEEL_VISCOUS,
    ("slope", "grade_x_mps2"): Theta.GRADE_X,
    ("slope", "grade_y_mps2"): Theta.GRADE_Y,
    ("com_offset", "offset_m"): Theta.COM_OFFSET,
    ("heading_misalignment", "angle_rad"): Theta.HEADING,
    ("yaw_drift", "rate_radps"): Theta.YAW_DRIFT,
    ("pose_lever_arm", "x_m"): Theta.ARM_X,
    ("pose_lever_arm", "y_m"): Theta.ARM_Y,
    ("cornering_stiffness", "ratio"): Theta.CORNERING,
    ("undeclared_skid", "stiffness_ratio"): Theta.UNDECLARED,
    ("load_step", "mass_ratio"): Theta.LOAD_STEP,
    ("low_friction_patch", "loss"): Theta.PATCH,
    ("slip_interval", "loss"): Theta.SLIP,
}
"""Where a parameter stands; parameters that act on the torques, or say when and where, stand in no place."""
LEAST_INVERSE = 1e-3
"""1/ratio is at least this where a slope is extrapolated: a skid of a thousandth of the stiffness."""
Conversion = Callable[[float, float], float]
CONVERTED: dict[Theta, tuple[Conversion, Conversion]] = {
    Theta.WHEEL_VISCOUS: (lambda value, radius: value / radius, lambda place, radius: place * radius),
    Theta.UNDECLARED: (lambda value, _: 1.0 / value, lambda place, _: 1.0 / max(place, LEAST_INVERSE)),
}
"""Parameter → place and place → parameter, beside the wheel radius in m, where the two differ."""
REPLACED = (Theta.UNDECLARED,)
"""Places at which a second effect of the name stands for the first; elsewhere the two add up."""


def theta_of(effects: Iterable[tuple[str, Values]], wheel_radius_m: float) -> F64:
    """θ (30,) of effects by name and parameters."""
    theta = np.zeros(N_THETA)
    for name, values in effects:
        for key, value in values.items():
            place = PLACES.get((name, key))
            if place is not None:
                before = 0.0 if place in REPLACED else theta[place]
                theta[place] = before + to_place(place, value, wheel_radius_m)
        if name.startswith(UNNAMED_PREFIX) or is_own_acceleration(name):
            theta[[Theta.EXTRA_LONG, Theta.EXTRA_YAW]] = 1.0
    return theta


def is_own_acceleration(name: str) -> bool:
    """Whether a user's effect of the name adds an acceleration."""
    return name in own_effects() and own_effects()[name].declaration.acts_on == "acceleration"


def to_place(place: Theta, value: float, wheel_radius_m: float) -> float:
    """A parameter's value as θ holds it."""
    return CONVERTED[place][0](value, wheel_radius_m) if place in CONVERTED else value


def from_place(place: Theta, value: float, wheel_radius_m: float) -> float:
    """The parameter of a value in θ."""
    return CONVERTED[place][1](value, wheel_radius_m) if place in CONVERTED else value


def places_of(name: str, parameters: Iterable[str]) -> tuple[Theta, ...]:
    """The places of an effect that a scan can take slopes at: all of its parameters stand in θ."""
    found = [PLACES.get((name, key)) for key in parameters]
    return () if None in found else tuple(place for place in found if place is not None)
