"""Resistances on the body: accelerations against the motion, ahead and in yaw."""

from dataclasses import replace

from wmr_schemas.effects.declaration import (
    INFINITE,
    Domain,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre


def _resisting(unit: str) -> Parameter:
    """A coefficient of a resistance."""
    return Parameter(unit, 1e-4, 0.0, INFINITE, "a resistance takes energy away: never below 0")


EFFECTS = (
    EffectDeclaration(
        "rolling_resistance",
        "longitudinal",
        "−c0·tanh(v/v0)",
        {"c0_mps2": _resisting("m/s²")},
        acts_on="acceleration",
        number=3,
        ranges={"c0_mps2": Range(0.05, 0.3)},
        separable=(
            Separable(("torque_bias_common",), Manoeuvre.REVERSING),
            Separable(("slope",), Manoeuvre.HEADINGS),
            Separable(("viscous_drag", "aerodynamic_drag"), Manoeuvre.SPEEDS),
            Separable(("wheel_coulomb",), Manoeuvre.TURNING),
        ),
        relevant=0.15,
    ),
    EffectDeclaration(
        "viscous_drag",
        "longitudinal",
        "−c1·v",
        {"c1_per_s": _resisting("1/s")},
        acts_on="acceleration",
        number=4,
        ranges={"c1_per_s": Range(0.05, 0.3)},
        exact=(Exact(("viscous_drag", "yaw_damping", "wheel_viscous", "back_emf"), beside=("yaw_damping",)),),
        separable=(Separable(("wheel_viscous",), Manoeuvre.TURNING),),
        relevant=0.2,
    ),
    EffectDeclaration(
        "aerodynamic_drag",
        "both",
        "−c2·v·|v| on dv_long/dt, −e2·w·V on dw/dt, w = l·yaw_rate, V² = v² + w²",
        {
            "c2_per_m": _resisting("1/m"),
            "e2_per_m": replace(
                _resisting("1/m"),
                absent=0.0,
                domain=Domain.NOT_NEGATIVE,
                most_times=("c2_per_m", 8.0),
                why="a medium that brakes turns brakes the way ahead: wheels at the track by 2·α_yaw/α, "
                "which is 1 to 6, a long hull by a little more",
            ),
        },
        acts_on="acceleration",
        number=5,
        ranges={"c2_per_m": Range(0.05, 0.3)},
        relevant=0.2,
    ),
    EffectDeclaration(
        "scrub_torque",
        "yaw",
        "−d0·sgn(yaw_rate) on l·yaw_acc",
        {"d0_mps2": _resisting("m/s²")},
        acts_on="acceleration",
        number=6,
        ranges={"d0_mps2": Range(0.05, 0.2)},
        separable=(
            Separable(("wheel_coulomb",), Manoeuvre.TURNING),
            Separable(("yaw_damping",), Manoeuvre.SLOW_AND_FAST_TURNS),
        ),
        relevant=0.15,
    ),
    EffectDeclaration(
        "yaw_damping",
        "yaw",
        "−d1·l·yaw_rate",
        {"d1_per_s": _resisting("1/s")},
        acts_on="acceleration",
        number=7,
        ranges={"d1_per_s": Range(0.3, 1.0)},
        separable=(Separable(("wheel_viscous",), Manoeuvre.TURNING),),
        relevant=0.6,
    ),
    EffectDeclaration(
        "swivel_friction",
        "yaw",
        "−s0·(v/V)·sgn(v·dw/dt − w·dv/dt) on dw/dt, w = l·yaw_rate, V² = v² + w²",
        {"s0_mps2": _resisting("m/s²")},
        acts_on="acceleration",
        number=45,
        ranges={"s0_mps2": Range(0.05, 0.15)},
        relevant=0.15,
        held_only=True,
    ),
    EffectDeclaration(
        "support_friction",
        "both",
        "−p0·v/V on dv_long/dt, −d0·w/V on dw/dt, w = l·yaw_rate, V² = v² + w² + v0²",
        {"p0_mps2": _resisting("m/s²"), "d0_mps2": _resisting("m/s²")},
        acts_on="acceleration",
        number=46,
        ranges={"p0_mps2": Range(0.05, 0.3), "d0_mps2": Range(0.05, 0.3)},
        relevant=0.15,
        held_only=True,
    ),
)
