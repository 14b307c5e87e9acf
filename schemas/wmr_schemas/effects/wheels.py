"""Torque lost at a wheel, by its speed over the ground."""

from wmr_schemas.effects.declaration import INFINITE, EffectDeclaration, Exact, Parameter, Range, Separable
from wmr_schemas.effects.manoeuvres import Manoeuvre

_LOSS = "a loss takes energy away: never below 0"

EFFECTS = (
    EffectDeclaration(
        "wheel_coulomb",
        "both",
        "u − torque·sgn(wheel speed), each wheel",
        {"torque_nm": Parameter("N·m", 1e-4, 0.0, INFINITE, _LOSS)},
        acts_on="wheel",
        number=8,
        ranges={"torque_nm": Range(0.08, 0.3, scale="both_wheels")},
        separable=(Separable(("wheel_viscous",), Manoeuvre.SPEEDS),),
    ),
    EffectDeclaration(
        "wheel_viscous",
        "both",
        "u − c·wheel speed, each wheel",
        {"nm_per_radps": Parameter("N·m/(rad/s)", 1e-5, 0.0, INFINITE, _LOSS)},
        acts_on="wheel",
        number=9,
        ranges={"nm_per_radps": Range(0.08, 0.3, scale="wheel_speed")},
        exact=(Exact(("wheel_viscous", "back_emf")),),
    ),
)
