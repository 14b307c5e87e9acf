"""How large a hidden effect is when nobody says so, and the form in which the plant has it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wmr_schemas.effects import BEYOND, EFFECTS
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters
from wmr_synth.hidden.parameters import needed

Scale = Literal["", "both_wheels", "turning", "wheel_speed", "duration"]


@dataclass(frozen=True)
class Range:
    """Uniform between ``low`` and ``high``, with either sign where ``signed``.

    ``scale`` says what is drawn: an acceleration in m/s², of which the torque at a wheel follows through 2α
    (``both_wheels``) or 2α_yaw (``turning``); one at 1 m/s (``wheel_speed``); a share of the duration.
    """

    low: float
    high: float
    signed: bool = False
    scale: Scale = ""


@dataclass(frozen=True)
class Size:
    """The ranges of an effect's parameters and its hidden form, as a person reads it.

    Of a ``vector``'s two components the first range is the magnitude; its direction is uniform.
    """

    form: str
    ranges: dict[str, Range]
    vector: tuple[str, str] | None = None


_PLAIN = "as its candidate"
_FRICTION = "sgn(v) as v/√(v² + .005²)"
SIZES: dict[str, Size] = {
    "payload": Size(_PLAIN, {"mass_ratio": Range(0.15, 0.5)}),
    "yaw_inertia": Size(_PLAIN, {"ratio": Range(0.15, 0.5)}),
    "drive_gain": Size(_PLAIN, {"ratio": Range(0.12, 0.35, signed=True)}),
    "rolling_resistance": Size(
        f"Stribeck: −c0·sgn(v)·(1 + .25·exp(−(v/.15)²)), {_FRICTION}", {"c0_mps2": Range(0.05, 0.3)}
    ),
    "viscous_drag": Size(_PLAIN, {"c1_per_s": Range(0.05, 0.3)}),
    "aerodynamic_drag": Size("−c2·sgn(v)·|v|^1.9", {"c2_per_m": Range(0.05, 0.3)}),
    "scrub_torque": Size(_FRICTION.replace("v", "l·yaw_rate"), {"d0_mps2": Range(0.05, 0.2)}),
    "yaw_damping": Size(_PLAIN, {"d1_per_s": Range(0.3, 1.0)}),
    "wheel_coulomb": Size(_FRICTION, {"torque_nm": Range(0.08, 0.3, scale="both_wheels")}),
    "wheel_viscous": Size(_PLAIN, {"nm_per_radps": Range(0.08, 0.3, scale="wheel_speed")}),
    "slope": Size(
        "bumpy: on each world axis + .25·|grade|·sin(2π·x/3 m + phase)",
        {"grade_x_mps2": Range(0.1, 0.5), "grade_y_mps2": Range(0.1, 0.5)},
        vector=("grade_x_mps2", "grade_y_mps2"),
    ),
    "torque_imbalance": Size(_PLAIN, {"ratio": Range(0.05, 0.2, signed=True)}),
    "torque_bias_common": Size(_PLAIN, {"bias_nm": Range(0.06, 0.25, signed=True, scale="both_wheels")}),
    "torque_bias_differential": Size(_PLAIN, {"bias_nm": Range(0.05, 0.2, signed=True, scale="turning")}),
    "actuator_lag": Size("two poles of half the time constant each", {"time_constant_s": Range(0.05, 0.25)}),
    "input_delay": Size(_PLAIN, {"delay_s": Range(0.05, 0.2)}),
    "torque_deadzone": Size("soft: u − δ·tanh(u/δ)", {"threshold_nm": Range(0.1, 0.4, scale="both_wheels")}),
    "torque_saturation": Size(
        "soft: u/(1 + (|u|/limit)⁶)^(1/6)", {"limit_nm": Range(0.5, 0.9, scale="both_wheels")}
    ),
    "com_offset": Size(_PLAIN, {"offset_m": Range(0.01, 0.03, signed=True)}),
    "heading_misalignment": Size(_PLAIN, {"angle_rad": Range(0.02, 0.1, signed=True)}),
    "pose_lever_arm": Size(_PLAIN, {"x_m": Range(0.05, 0.3), "y_m": Range(0.05, 0.3)}, vector=("x_m", "y_m")),
    "cornering_stiffness": Size(_PLAIN, {"ratio": Range(0.25, 0.5, signed=True)}),
    "load_step": Size(
        "linear from t0 − 1 s to t0 + 1 s",
        {"mass_ratio": Range(0.2, 0.5), "t0_s": Range(0.2, 0.45, scale="duration")},
    ),
    "low_friction_patch": Size(
        "soft edge: ½·(1 − tanh((distance − radius)/.1 m))",
        {
            "radius_m": Range(0.5, 1.2),
            "loss": Range(0.3, 0.7),
        },
    ),
    "slip_interval": Size(
        "edges of .2 s",
        {
            "start_s": Range(0.2, 0.4, scale="duration"),
            "end_s": Range(0.05, 0.12, scale="duration"),
            "loss": Range(0.3, 0.7),
        },
    ),
    "undeclared_skid": Size(_PLAIN, {"stiffness_ratio": Range(0.4, 1.2)}),
    "yaw_drift": Size(_PLAIN, {"rate_radps": Range(0.002, 0.01, signed=True)}),
    "wheel_eccentricity": Size("½·A·sin(wheel angle) of each wheel", {"amplitude_mps2": Range(0.1, 0.3)}),
}
"""By effect. A slip interval's ``end_s`` is drawn as a length; where a patch lies, ``world`` says."""


def describe_range(within: Range) -> str:
    """The range as a person reads it."""
    sign = "±" if within.signed else ""
    return f"{sign}{within.low:g} … {within.high:g}{SCALE_MEANING[within.scale]}"


SCALE_MEANING: dict[Scale, str] = {
    "": "",
    "both_wheels": " m/s² / (2 alpha)",
    "turning": " m/s² / (2 alpha_yaw)",
    "wheel_speed": " 1/s · wheel_radius_m / (2 alpha)",
    "duration": " of the duration",
}


def draw_effect(
    name: str, given: Mapping[str, float], rng: np.random.Generator, robot: RobotParameters, duration_s: float
) -> Effect:
    """The effect with the parameters ``given``, and the others drawn; a vector is drawn whole or not at all.

    A drawn patch has NaN for its place, which the path decides.
    """
    size, form = SIZES[name], (EFFECTS | BEYOND)[name]
    drawn = {
        key: draw(name, size.ranges[key], rng, robot, duration_s)
        for key in form.parameters
        if key in size.ranges
    }
    if size.vector is not None:
        drawn.update(draw_vector(size, size.vector, rng, given))
    if name == "slip_interval":
        drawn["end_s"] += given.get("start_s", drawn["start_s"])
    if name == "low_friction_patch":
        drawn["x_m"] = drawn["y_m"] = np.nan
    return Effect(name, {key: float(given.get(key, drawn[key])) for key in form.parameters})


def draw(
    name: str, within: Range, rng: np.random.Generator, robot: RobotParameters, duration_s: float
) -> float:
    """A value of the range, in the parameter's unit."""
    value = float(rng.uniform(within.low, within.high)) * (rng.choice((-1.0, 1.0)) if within.signed else 1.0)
    if within.scale == "duration":
        return value * duration_s
    if within.scale == "wheel_speed":
        alpha, radius = needed(name, robot, "alpha", "wheel_radius_m")
        return value * radius / (2 * alpha)
    if within.scale:
        (alpha,) = needed(name, robot, "alpha")
        return value / (2 * (alpha if within.scale == "both_wheels" else robot.alpha_yaw or alpha))
    return value


def draw_vector(
    size: Size, keys: tuple[str, str], rng: np.random.Generator, given: Mapping[str, float]
) -> dict[str, float]:
    """Both components of a uniform direction, or 0 for one that stands beside a given one."""
    magnitude, direction = rng.uniform(size.ranges[keys[0]].low, size.ranges[keys[0]].high), rng.uniform(0, 2)
    if given:
        return dict.fromkeys(keys, 0.0)
    return {
        keys[0]: float(magnitude * np.cos(np.pi * direction)),
        keys[1]: float(magnitude * np.sin(np.pi * direction)),
    }


def check_sizes(effect: Effect) -> None:
    """Parameters with which the plant's equations make sense. Raises InvalidSetting naming others."""
    above_minus_one = {"payload", "yaw_inertia", "drive_gain", "cornering_stiffness", "load_step"}
    for key, value in effect.parameters.items():
        if key in ("ratio", "mass_ratio") and effect.name in above_minus_one and value <= -1:
            raise InvalidSetting(f"{effect.name}: {key} must be above −1, not {value:g}")
        if key in NOT_NEGATIVE and value < 0:
            raise InvalidSetting(f"{effect.name}: {key} must not be negative, not {value:g}")
        if key in ABOVE_ZERO and value <= 0:
            raise InvalidSetting(f"{effect.name}: {key} must be above 0, not {value:g}")
        if key == "loss" and not 0 <= value < 1:
            raise InvalidSetting(f"{effect.name}: loss must lie in [0, 1), not {value:g}")
    if effect.name == "slip_interval" and effect.parameters["end_s"] <= effect.parameters["start_s"]:
        raise InvalidSetting("slip_interval: end_s must come after start_s")


NOT_NEGATIVE = ("time_constant_s", "delay_s", "threshold_nm", "radius_m")
ABOVE_ZERO = ("limit_nm", "stiffness_ratio")
