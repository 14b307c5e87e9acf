"""Effects on how the robot responds to its torques: α and α_yaw times a factor."""

from wmr_schemas.effects.declaration import (
    BOTH,
    Domain,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre

_LIGHTER = "−0.8 leaves a fifth of the inertia, 10 is eleven times as much; beyond lies a wrong base model"
_WEAKER = "−0.9 leaves a tenth of the drive, 10 is eleven times as much; beyond lies a wrong base model"
_THREE = ("payload", "yaw_inertia", "drive_gain")

EFFECTS = (
    EffectDeclaration(
        "payload",
        "longitudinal",
        "alpha / (1 + mass_ratio)",
        {"mass_ratio": Parameter("1", 1e-3, -0.8, 10.0, _LIGHTER, domain=Domain.ABOVE_MINUS_ONE)},
        acts_on="robot",
        number=0,
        search=Search(clipped=True),
        ranges={"mass_ratio": Range(0.15, 0.5)},
        exact=(Exact(_THREE, beside=("yaw_inertia",)), Exact(_THREE, beside=("drive_gain",))),
        separable=(
            Separable(("torque_deadzone", "torque_saturation", "drive_gain"), Manoeuvre.GENTLE_AND_HARD),
            Separable(("drive_gain", "yaw_inertia"), Manoeuvre.SPOT_AND_STRAIGHT),
        ),
        relevant=0.3,
    ),
    EffectDeclaration(
        "yaw_inertia",
        "yaw",
        "alpha_yaw / (1 + ratio)",
        {"ratio": Parameter("1", 1e-3, -0.8, 10.0, _LIGHTER, domain=Domain.ABOVE_MINUS_ONE)},
        acts_on="robot",
        number=1,
        search=Search(clipped=True),
        ranges={"ratio": Range(0.15, 0.5)},
        exact=(Exact(("yaw_inertia", "half_track")), Exact(_THREE, beside=("drive_gain",))),
        relevant=0.4,
    ),
    EffectDeclaration(
        "drive_gain",
        "both",
        "alpha·(1 + ratio), alpha_yaw·(1 + ratio)",
        {"ratio": Parameter("1", 1e-3, -0.9, 10.0, _WEAKER, domain=Domain.ABOVE_MINUS_ONE)},
        acts_on="robot",
        models=BOTH,
        needs_commands=True,
        wheel_speed_formula="commanded wheel speeds·(1 + ratio)",
        number=2,
        search=Search(clipped=True),
        ranges={"ratio": Range(0.12, 0.35, signed=True)},
        exact=(
            Exact(("drive_gain", "wheel_radius", "wheel_inertia", "torque_constant"), driven_by=("torque",)),
            Exact(("drive_gain", "wheel_scale", "wheel_radius"), driven_by=("command",)),
        ),
        relevant=0.25,
    ),
)
