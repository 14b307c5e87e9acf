"""Coefficients of the effects of robots that wheel speeds drive, as their compiled plant reads them."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.model_file import Effect

Parameters = Mapping[str, float]


class RollingHidden(NamedTuple):
    """Coefficients of the effects in the plant; the defaults are those of no effect at all."""

    plain: bool = False
    right_scale: float = 1.0
    left_scale: float = 1.0
    track: float = 1.0
    wide_turns: float = 0.0
    icr_offset_m: float = 0.0
    lateral_slip_s: float = 0.0
    turning_slip_s_per_m: float = 0.0
    slip_ratio_s: float = 0.0
    drift_x_mps: float = 0.0
    drift_y_mps: float = 0.0
    slip_loss: float = 0.0
    slip_apart: float = 0.0
    slip_start_s: float = 0.0
    slip_end_s: float = 0.0
    patch_loss: float = 0.0
    patch_apart: float = 0.0
    patch_x_m: float = 0.0
    patch_y_m: float = 0.0
    patch_radius_m: float = 0.0
    gain: float = 1.0
    turn_gain: float = 1.0
    deadzone_mps: float = 0.0
    saturation_mps: float = math.inf
    turn_saturation_radps: float = math.inf
    desaturation_mps: float = math.inf
    turn_acceleration_radps2: float = math.inf
    acceleration_mps2: float = math.inf
    lag_s: float = 0.0
    delay_ns: int = 0


def wheel_scale(h: RollingHidden, p: Parameters) -> RollingHidden:
    """Both wheels (1 + ratio)."""
    factor = 1 + p["ratio"]
    return h._replace(right_scale=h.right_scale * factor, left_scale=h.left_scale * factor)


def wheel_scale_difference(h: RollingHidden, p: Parameters) -> RollingHidden:
    """Right (1 + ratio), left (1 − ratio)."""
    right, left = 1 + p["ratio"], 1 - p["ratio"]
    return h._replace(right_scale=h.right_scale * right, left_scale=h.left_scale * left)


def slip_interval(h: RollingHidden, p: Parameters) -> RollingHidden:
    """A loss in an interval of time."""
    h = h._replace(slip_loss=p["loss"], slip_apart=p.get("loss_apart", 0.0))
    return h._replace(slip_start_s=p["start_s"], slip_end_s=p["end_s"])


def low_grip_patch(h: RollingHidden, p: Parameters) -> RollingHidden:
    """A loss inside a disc."""
    h = h._replace(patch_loss=p["loss"], patch_apart=p.get("loss_apart", 0.0), patch_radius_m=p["radius_m"])
    return h._replace(patch_x_m=p["x_m"], patch_y_m=p["y_m"])


ROLLING_CHANGES: dict[str, Callable[[RollingHidden, Parameters], RollingHidden]] = {
    "wheel_scale": wheel_scale,
    "wheel_scale_difference": wheel_scale_difference,
    "effective_track": lambda h, p: h._replace(track=1 + p["ratio"]),
    "wide_turn_scrub": lambda h, p: h._replace(wide_turns=p["ratio"]),
    "icr_offset": lambda h, p: h._replace(icr_offset_m=p["offset_m"]),
    "lateral_slip": lambda h, p: h._replace(lateral_slip_s=p["seconds"]),
    "turning_slip": lambda h, p: h._replace(turning_slip_s_per_m=p["s_per_m"]),
    "slip_ratio": lambda h, p: h._replace(slip_ratio_s=p["seconds"]),
    "slope_slip": lambda h, p: h._replace(drift_x_mps=p["x_mps"], drift_y_mps=p["y_mps"]),
    "slip_interval": slip_interval,
    "low_grip_patch": low_grip_patch,
    "drive_gain": lambda h, p: h._replace(gain=1 + p["ratio"]),
    "turn_gain": lambda h, p: h._replace(turn_gain=1 + p["ratio"]),
    "speed_deadzone": lambda h, p: h._replace(deadzone_mps=p["threshold_mps"]),
    "speed_saturation": lambda h, p: h._replace(saturation_mps=p["limit_mps"]),
    "turn_acceleration_limit": lambda h, p: h._replace(turn_acceleration_radps2=p["limit_radps2"]),
    "speed_desaturation": lambda h, p: h._replace(desaturation_mps=p["limit_mps"]),
    "turn_saturation": lambda h, p: h._replace(turn_saturation_radps=p["limit_radps"]),
    "acceleration_limit": lambda h, p: h._replace(acceleration_mps2=p["limit_mps2"]),
    "actuator_lag": lambda h, p: h._replace(lag_s=p["time_constant_s"]),
    "input_delay": lambda h, p: h._replace(delay_ns=round(p["delay_s"] * NS_PER_S)),
}
"""The coefficients that each effect of the plant sets; effects on the measured pose have none."""


def rolling_hidden(effects: Iterable[Effect], *, plain: bool) -> RollingHidden:
    """The plant's coefficients for effects that stand at most once each."""
    hidden = RollingHidden(plain=plain)
    for effect in effects:
        if effect.name in ROLLING_CHANGES:
            hidden = ROLLING_CHANGES[effect.name](hidden, effect.parameters)
    return hidden
