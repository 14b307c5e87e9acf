"""How large a hidden effect is: the sizes that are given, the others drawn from the declared ranges."""

from collections.abc import Mapping
from zlib import crc32

import numpy as np

from wmr_schemas.effects import EffectDeclaration, Range, declared
from wmr_schemas.effects.declaration import Scale
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters
from wmr_synth.hidden.parameters import needed

SCALE_MEANING: dict[Scale, str] = {
    "": "",
    "both_wheels": " m/s² / (2 alpha)",
    "turning": " m/s² / (2 alpha_yaw)",
    "wheel_speed": " 1/s · wheel_radius_m / (2 alpha)",
    "duration": " of the duration",
}


def describe_range(within: Range) -> str:
    """The range in words."""
    sign = "±" if within.signed else ""
    return f"{sign}{within.low:g} … {within.high:g}{SCALE_MEANING[within.scale]}"


def stream_number(name: str) -> int:
    """The random stream of an effect: its number, or a hash of a user's effect's name."""
    effect = declared(name)
    return effect.number if effect.number >= 0 else crc32(name.encode())


def draw_effect(
    name: str, given: Mapping[str, float], rng: np.random.Generator, robot: RobotParameters, duration_s: float
) -> Effect:
    """The effect with the parameters ``given``, and the others drawn; a vector is drawn whole or not at all.

    A place, which has no range, is NaN until the path decides it; what need not be is not drawn.
    """
    effect = declared(name)
    values = {
        key: draw(name, effect.ranges[key], rng, robot, duration_s)
        for key in effect.parameters
        if key in effect.ranges
    }
    if effect.vector is not None:
        values.update(draw_vector(effect, effect.vector, rng, given))
    for key, within in effect.ranges.items():
        if within.after:
            values[key] += given.get(within.after, values[within.after])
    said = [key for key in effect.parameters if key in given or key not in effect.absent]
    return Effect(name, {key: float(given.get(key, values.get(key, np.nan))) for key in said})


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
    effect: EffectDeclaration, keys: tuple[str, str], rng: np.random.Generator, given: Mapping[str, float]
) -> dict[str, float]:
    """Both components of a uniform direction, or 0 for one that stands beside a given one."""
    length = effect.ranges[keys[0]]
    magnitude, direction = rng.uniform(length.low, length.high), rng.uniform(0, 2)
    if given:
        return dict.fromkeys(keys, 0.0)
    return {
        keys[0]: float(magnitude * np.cos(np.pi * direction)),
        keys[1]: float(magnitude * np.sin(np.pi * direction)),
    }


def check_sizes(effect: Effect) -> None:
    """Parameters with which the plant's equations make sense. Raises InvalidSetting naming others."""
    known = declared(effect.name)
    for key, value in effect.parameters.items():
        domain = known.parameters[key].domain
        if not domain.holds(value):
            raise InvalidSetting(f"{effect.name}: {key} must {domain.words}, not {value:g}")
    for key, within in known.ranges.items():
        if within.after and effect.parameters[key] <= effect.parameters[within.after]:
            raise InvalidSetting(f"{effect.name}: {key} must come after {within.after}")
