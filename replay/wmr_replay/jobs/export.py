"""A calibrated model as the parameters of another tool: ROS 2's diff_drive_controller.

    wheel_separation_multiplier    1 + effective_track
    left_wheel_radius_multiplier   (1 + wheel_scale)·(1 − wheel_scale_difference)
    right_wheel_radius_multiplier  (1 + wheel_scale)·(1 + wheel_scale_difference)

The controller multiplies the nominal wheel separation and radius by them.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect, Model

FORMATS = ("ros2-diff-drive", "mjcf")
NORMAL_95 = 1.96
CONTROLLER = "diff_drive_controller"
HELD = ("wheel_scale", "wheel_scale_difference", "effective_track")
"""The effects that the controller's parameters hold."""
CLOCKS = ("pose_delay", "input_delay", "actuator_lag")
"""Effects that no parameter of the odometry needs to hold."""


class Multiplier(NamedTuple):
    """A parameter with its standard deviation, NaN where unknown."""

    name: str
    value: float
    sd: float


def multipliers(model: Model) -> tuple[Multiplier, ...]:
    """The three multipliers. Raises InvalidSetting for a model that wheel speeds do not drive."""
    effects = {effect.name: effect for effect in model.effects}
    if not any(name in effects for name in HELD):
        raise InvalidSetting(
            f"the model holds none of {', '.join(HELD)}: `wmr-replay fit LOG` calibrates them on wheel speeds"
        )
    scale, scale_sd = ratio(effects.get("wheel_scale"))
    apart, apart_sd = ratio(effects.get("wheel_scale_difference"))
    track, track_sd = ratio(effects.get("effective_track"))
    sides = (("left", -1.0), ("right", 1.0))
    return (
        Multiplier("wheel_separation_multiplier", 1 + track, track_sd),
        *(
            Multiplier(
                f"{side}_wheel_radius_multiplier",
                (1 + scale) * (1 + sign * apart),
                math.hypot(scale_sd * (1 + sign * apart), apart_sd * (1 + scale)),
            )
            for side, sign in sides
        ),
    )


def ratio(effect: Effect | None) -> tuple[float, float]:
    """An effect's ratio and its standard deviation; none and 0 where the model does not have it."""
    if effect is None:
        return 0.0, 0.0
    return effect.parameters["ratio"], effect.sd.get("ratio", math.nan)


def ros2_diff_drive(model: Model) -> str:
    """YAML of the controller's parameters, with 95 % intervals and the odometry's error as comments."""
    return "\n".join(yaml_lines(model)) + "\n"


def yaml_lines(model: Model) -> Iterator[str]:
    """The lines of the file."""
    yield "# Written by wmr-replay export; the comments give 95 % intervals."
    yield from odometry_lines(model)
    yield from beyond_lines(model)
    yield f"{CONTROLLER}:"
    yield "  ros__parameters:"
    if model.robot.half_track_m is not None:
        yield f"    wheel_separation: {2 * model.robot.half_track_m:.6g}  # nominal, m"
    if model.robot.wheel_radius_m is not None:
        yield f"    wheel_radius: {model.robot.wheel_radius_m:.6g}  # nominal, m"
    for name, value, sd in multipliers(model):
        yield f"    {name}: {value:.5f}  # {interval(value, sd)}"


def interval(value: float, sd: float) -> str:
    """The 95 % interval in words."""
    if not math.isfinite(sd):
        return "no interval: given, not fitted"
    if sd == 0.0:
        return "not fitted"
    return f"{value - NORMAL_95 * sd:.5f} to {value + NORMAL_95 * sd:.5f}"


def odometry_lines(model: Model) -> Iterator[str]:
    """The error of dead reckoning before and after."""
    o = model.odometry
    if o is None:
        return
    yield f"# Odometry after {o.seconds:.3g} s, {o.windows:.0f} windows that were held out:"
    yield (
        f"#   position {1e3 * o.position_rms_before_m:.0f} -> {1e3 * o.position_rms_after_m:.0f} mm rms, "
        f"median {1e3 * o.position_median_before_m:.0f} -> {1e3 * o.position_median_after_m:.0f} mm"
    )
    yield f"#   yaw      {1e3 * o.yaw_rms_before_rad:.0f} -> {1e3 * o.yaw_rms_after_rad:.0f} mrad rms"


def beyond_lines(model: Model) -> Iterator[str]:
    """Effects that the controller has no parameter for."""
    beyond = [effect.name for effect in model.effects if effect.name not in (*HELD, *CLOCKS)]
    if beyond:
        yield f"# The model also holds {', '.join(beyond)}, for which the controller has no parameter."
