"""Effects between the wheel speeds and the motion, of robots whose base model wheel speeds drive.

    v_long = r (φ̇_R + φ̇_L)/2      l·yaw_rate = r (φ̇_R − φ̇_L)/2      v_lat = 0

Instantaneous centres of rotation after Mandow et al. 2007 and Martínez et al. 2005.
"""

from wmr_schemas.effects.declaration import (
    INFINITE,
    WHEEL_SPEED,
    Domain,
    DrivenBy,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre
from wmr_schemas.effects.places import LOSS_APART
from wmr_schemas.modes import ContactMode

_DRIVEN: tuple[DrivenBy, ...] = ("wheel_speed", "command")
_RESISTING = "slip loses way and never gains it: not below 0"
_RADIUS = Parameter(
    "m",
    0.05,
    0.1,
    50.0,
    "smaller than a wheel's print is no region, 50 m is the whole ground",
    "place",
    Domain.NOT_NEGATIVE,
)
_LOSS = Parameter(
    "1", 1e-3, 0.0, 0.999, "at 1 the wheels turn on the spot and say no more", domain=Domain.SHARE
)
_POSITION = Parameter("m", 0.05, why="anywhere in the world", role="place")


def _ratio(least: float, most: float, why: str) -> Parameter:
    """A relative error of a length or of a pair of wheels."""
    return Parameter("1", 1e-4, least, most, why, domain=Domain.ABOVE_MINUS_ONE)


EFFECTS = (
    EffectDeclaration(
        "wheel_scale",
        "longitudinal",
        "both wheel speeds·(1 + ratio)",
        {"ratio": _ratio(-0.8, 4.0, "a wheel of a fifth or five times the radius is a wrong unit")},
        acts_on="rolling",
        number=28,
        models=WHEEL_SPEED,
        search=Search(clipped=True),
        ranges={"ratio": Range(0.02, 0.1, signed=True)},
        exact=(Exact(("wheel_scale", "wheel_radius", "constant_slip_ratio"), driven_by=_DRIVEN),),
        separable=(
            Separable(("turning_slip",), Manoeuvre.TURNING),
            Separable(("slope_slip",), Manoeuvre.HEADINGS),
        ),
        relevant=0.02,
    ),
    EffectDeclaration(
        "wheel_scale_difference",
        "yaw",
        "right wheel speed·(1 + ratio), left·(1 − ratio)",
        {"ratio": _ratio(-0.5, 0.5, "a wheel three times as large as the other is a broken encoder")},
        acts_on="rolling",
        number=29,
        models=WHEEL_SPEED,
        ranges={"ratio": Range(0.004, 0.02, signed=True)},
        separable=(Separable(("yaw_drift",), Manoeuvre.SPEEDS),),
        relevant=0.005,
    ),
    EffectDeclaration(
        "effective_track",
        "yaw",
        "half_track_m·(1 + ratio)",
        {"ratio": _ratio(-0.8, 9.0, "a track of a fifth or ten times the geometric one is a wrong unit")},
        acts_on="rolling",
        number=30,
        models=WHEEL_SPEED,
        search=Search(clipped=True),
        ranges={"ratio": Range(0.05, 0.25, signed=True)},
        exact=(Exact(("effective_track", "half_track", "slip_in_turning"), driven_by=_DRIVEN),),
        separable=(Separable(("turning_slip",), Manoeuvre.TURNING),),
        relevant=0.03,
    ),
    EffectDeclaration(
        "icr_offset",
        "lateral",
        "v_lat = −offset·yaw_rate",
        {"offset_m": Parameter("m", 1e-4, -3.0, 3.0, "centres of rotation lie near the robot")},
        acts_on="rolling",
        number=31,
        models=WHEEL_SPEED,
        ranges={"offset_m": Range(0.03, 0.15, signed=True)},
        exact=(Exact(("icr_offset", "pose_lever_arm"), driven_by=_DRIVEN),),
        separable=(Separable(("lateral_slip",), Manoeuvre.TURNING),),
        relevant=0.03,
    ),
    EffectDeclaration(
        "lateral_slip",
        "lateral",
        "v_lat = −k·v_long·yaw_rate",
        {"seconds": Parameter("s", 1e-4, -5.0, 5.0, "beyond 5 s a robot slides more than it turns")},
        acts_on="rolling",
        number=32,
        models=WHEEL_SPEED,
        ranges={"seconds": Range(0.05, 0.2)},
        separable=(
            Separable(("icr_offset", "pose_lever_arm"), Manoeuvre.TURNING),
            Separable(("pose_delay",), Manoeuvre.STRAIGHT_THEN_SPOT),
        ),
        relevant=0.05,
    ),
    EffectDeclaration(
        "turning_slip",
        "longitudinal",
        "v_long·(1 − k·|yaw_rate|·l)",
        {"s_per_m": Parameter("s/m", 1e-3, 0.0, INFINITE, _RESISTING, domain=Domain.NOT_NEGATIVE)},
        acts_on="rolling",
        number=33,
        models=WHEEL_SPEED,
        ranges={"s_per_m": Range(0.1, 0.5)},
        relevant=0.1,
    ),
    EffectDeclaration(
        "slip_ratio",
        "longitudinal",
        "v_long − k·dv_long/dt",
        {"seconds": Parameter("s", 1e-4, 0.0, 2.0, _RESISTING, domain=Domain.NOT_NEGATIVE)},
        acts_on="rolling",
        number=34,
        models=WHEEL_SPEED,
        ranges={"seconds": Range(0.02, 0.06)},
        separable=(Separable(("pose_delay",), Manoeuvre.TURNING),),
        relevant=0.03,
    ),
    EffectDeclaration(
        "pose_delay",
        "measurement",
        "the pose describes t − delay",
        {
            "delay_s": Parameter(
                "s", 1e-3, -0.5, 1.0, "clocks that differ by more are found before; negative: the wheels' lag"
            )
        },
        acts_on="pose",
        number=35,
        models=WHEEL_SPEED,
        ranges={"delay_s": Range(0.03, 0.15)},
        exact=(
            Exact(("pose_delay", "pose_clock_offset", "encoder_delay"), driven_by=("wheel_speed",)),
            Exact(("pose_delay", "input_delay", "pose_clock_offset"), driven_by=("command",)),
        ),
        relevant=0.03,
    ),
    EffectDeclaration(
        "slope_slip",
        "both",
        "velocity + (x, y) in the world while the wheels turn",
        {"x_mps": Parameter("m/s", 1e-4), "y_mps": Parameter("m/s", 1e-4)},
        acts_on="rolling",
        number=36,
        models=WHEEL_SPEED,
        ranges={"x_mps": Range(0.02, 0.08), "y_mps": Range(0.02, 0.08)},
        vector=("x_mps", "y_mps"),
    ),
    EffectDeclaration(
        "low_grip_patch",
        "both",
        "wheel speeds·(1 − loss) inside a disc, right − loss_apart, left + loss_apart",
        {"x_m": _POSITION, "y_m": _POSITION, "radius_m": _RADIUS, "loss": _LOSS, "loss_apart": LOSS_APART},
        acts_on="traction",
        number=37,
        models=WHEEL_SPEED,
        extent="space",
        followed=True,
        taken_for=ContactMode.SLIPPING,
        ranges={"radius_m": Range(0.5, 1.2), "loss": Range(0.3, 0.7)},
        separable=(Separable(("slip_interval",), Manoeuvre.TWICE),),
    ),
    EffectDeclaration(
        "wide_turn_scrub",
        "yaw",
        "half_track_m·(1 + ratio·(g − ½)), g = |v|/(|v| + 3·|w|), w half the difference of the rims' speeds",
        {"ratio": _ratio(-1.0, 1.9, "a track that turns double or take away has another form")},
        acts_on="rolling",
        number=47,
        models=WHEEL_SPEED,
        ranges={"ratio": Range(0.05, 0.2)},
        relevant=0.1,
        held_only=True,
    ),
)
