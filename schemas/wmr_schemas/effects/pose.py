"""Errors of the measured pose: a turned or drifting heading, a sensor away from the axle."""

from wmr_schemas.effects.declaration import (
    BOTH,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre

EFFECTS = (
    EffectDeclaration(
        "heading_misalignment",
        "measurement",
        "yaw + angle",
        {"angle_rad": Parameter("rad", 1e-4, -1.0, 1.0, "a sensor turned by more than 57° is a wrong frame")},
        acts_on="pose",
        models=BOTH,
        number=19,
        ranges={"angle_rad": Range(0.02, 0.1, signed=True)},
        separable=(
            Separable(("yaw_drift",), Manoeuvre.LONGER),
            Separable(("pose_lever_arm",), Manoeuvre.STRAIGHT_THEN_SPOT),
        ),
        relevant=0.05,
        needs_excitation=False,
    ),
    EffectDeclaration(
        "yaw_drift",
        "measurement",
        "yaw + rate·t, t from the log's first pose",
        {"rate_radps": Parameter("rad/s", 1e-5, -1.0, 1.0, "1 rad/s is a turning robot, not a drift")},
        acts_on="pose",
        models=BOTH,
        number=26,
        search=Search(starts=tuple(sign * n / 1000 for n in range(1, 12, 2) for sign in (-1, 1))),
        ranges={"rate_radps": Range(0.002, 0.01, signed=True)},
        relevant=0.002,
        needs_excitation=False,
    ),
    EffectDeclaration(
        "pose_lever_arm",
        "measurement",
        "position + R(yaw)·(x, y)",
        {"x_m": Parameter("m", 1e-4), "y_m": Parameter("m", 1e-4)},
        acts_on="pose",
        models=BOTH,
        number=20,
        ranges={"x_m": Range(0.05, 0.3), "y_m": Range(0.05, 0.3)},
        vector=("x_m", "y_m"),
        exact=(Exact(("pose_lever_arm", "icr_offset"), driven_by=("wheel_speed", "command")),),
        separable=(Separable(("undeclared_skid",), Manoeuvre.TURNING),),
    ),
)
