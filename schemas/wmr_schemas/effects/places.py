"""Effects that act in a stretch of time or a region: a load taken on, traction lost."""

from wmr_schemas.effects.declaration import (
    BOTH,
    INFINITE,
    Domain,
    EffectDeclaration,
    Parameter,
    Range,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre
from wmr_schemas.modes import ContactMode

_TIME = Parameter("s", 0.05, 0.0, INFINITE, "counted from the log's start", "time")
_POSITION = Parameter("m", 0.05, why="anywhere in the world", role="place")
_LOSS = Parameter(
    "1", 1e-3, 0.0, 0.999, "at 1 nothing drives the robot and its motion says no more", domain=Domain.SHARE
)
LOSS_APART = Parameter(
    "1",
    1e-3,
    -0.999,
    0.999,
    "at 1 one wheel loses all, and the other none",
    domain=Domain.SIGNED_SHARE,
    absent=0.0,
    models=("wheel_speed",),
)
"""What the right wheel loses more than both do, and the left one less."""

EFFECTS = (
    EffectDeclaration(
        "load_step",
        "longitudinal",
        "as payload, from t0 on",
        {
            "mass_ratio": Parameter(
                "1",
                1e-3,
                -0.8,
                10.0,
                "−0.8 leaves a fifth of the mass, 10 is eleven times as much",
                domain=Domain.ABOVE_MINUS_ONE,
            ),
            "t0_s": _TIME,
        },
        acts_on="traction",
        number=22,
        extent="time",
        followed=True,
        ranges={"mass_ratio": Range(0.2, 0.5), "t0_s": Range(0.2, 0.45, scale="duration")},
        separable=(Separable(("slip_interval",), Manoeuvre.GO_ON),),
    ),
    EffectDeclaration(
        "slip_interval",
        "both",
        "alpha·(1 − loss) in an interval",
        {"start_s": _TIME, "end_s": _TIME, "loss": _LOSS, "loss_apart": LOSS_APART},
        acts_on="traction",
        models=BOTH,
        wheel_speed_formula="wheel speeds·(1 − loss) in an interval, right − loss_apart, left + loss_apart",
        number=24,
        extent="time",
        followed=True,
        taken_for=ContactMode.SLIPPING,
        ranges={
            "start_s": Range(0.2, 0.4, scale="duration"),
            "end_s": Range(0.05, 0.12, scale="duration", after="start_s"),
            "loss": Range(0.3, 0.7),
        },
    ),
    EffectDeclaration(
        "low_friction_patch",
        "both",
        "alpha·(1 − loss), G_x·(1 − loss) inside a disc",
        {
            "x_m": _POSITION,
            "y_m": _POSITION,
            "radius_m": Parameter(
                "m",
                0.05,
                0.1,
                50.0,
                "smaller than a wheel's print is no region, 50 m is the whole ground",
                "place",
                Domain.NOT_NEGATIVE,
            ),
            "loss": _LOSS,
        },
        acts_on="traction",
        number=23,
        extent="space",
        followed=True,
        taken_for=ContactMode.SLIPPING,
        ranges={"radius_m": Range(0.5, 1.2), "loss": Range(0.3, 0.7)},
        separable=(Separable(("slip_interval",), Manoeuvre.TWICE),),
    ),
)
