"""Coefficients of the effects, as the compiled plant reads them."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.effects import catalogue, declared
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect
from wmr_schemas.robot import RobotParameters

Parameters = Mapping[str, float]


class Hidden(NamedTuple):
    """Coefficients of the effects in the plant; the defaults are those of no effect at all."""

    plain: bool = False
    gain_long: float = 1.0
    gain_yaw: float = 1.0
    right_gain: float = 1.0
    left_gain: float = 1.0
    bias_right_nm: float = 0.0
    bias_left_nm: float = 0.0
    deadzone_nm: float = 0.0
    saturation_nm: float = math.inf
    delay_ns: int = 0
    lag_s: float = 0.0
    rolling_mps2: float = 0.0
    viscous_per_s: float = 0.0
    drag_per_m: float = 0.0
    drag_yaw_per_m: float = 0.0
    scrub_mps2: float = 0.0
    damping_per_s: float = 0.0
    swivel_mps2: float = 0.0
    support_mps2: float = 0.0
    support_yaw_mps2: float = 0.0
    wheel_coulomb_nm: float = 0.0
    wheel_viscous_nm_per_mps: float = 0.0
    grade_x_mps2: float = 0.0
    grade_y_mps2: float = 0.0
    com_offset_m: float = 0.0
    com_yaw: float = 0.0
    weight_by_inertia: float = 1.0
    eccentricity_mps2: float = 0.0
    stiffness: float = 1.0
    undeclared_stiffness: float = 0.0
    load_ratio: float = 0.0
    load_s: float = 0.0
    slip_loss: float = 0.0
    slip_start_s: float = 0.0
    slip_end_s: float = 0.0
    patch_loss: float = 0.0
    patch_x_m: float = 0.0
    patch_y_m: float = 0.0
    patch_radius_m: float = 0.0


Change = Callable[[Hidden, Parameters, RobotParameters], Hidden]


def com_offset(h: Hidden, p: Parameters, robot: RobotParameters) -> Hidden:
    """D ω² ahead, −(l m d/I) v ω on l·yaw_acc."""
    l, m, inertia = needed("com_offset", robot, "half_track_m", "mass_kg", "yaw_inertia_kgm2")
    return h._replace(com_offset_m=p["offset_m"], com_yaw=l * m * p["offset_m"] / inertia)


def payload(h: Hidden, p: Parameters, _: RobotParameters) -> Hidden:
    """A mass m (1 + ratio) by α, l m d/I and the scrub of tyres: the weight sits at the centre of mass."""
    carried = 1 + p["mass_ratio"]
    return h._replace(gain_long=h.gain_long / carried, weight_by_inertia=h.weight_by_inertia * carried)


def yaw_inertia(h: Hidden, p: Parameters, _: RobotParameters) -> Hidden:
    """A yaw inertia I (1 + ratio) by α_yaw, l m d/I and what a scrub turns."""
    larger = 1 + p["ratio"]
    return h._replace(gain_yaw=h.gain_yaw / larger, weight_by_inertia=h.weight_by_inertia / larger)


def wheel_viscous(h: Hidden, p: Parameters, robot: RobotParameters) -> Hidden:
    """Friction by wheel speed, which needs the wheel's radius."""
    (radius,) = needed("wheel_viscous", robot, "wheel_radius_m")
    return h._replace(wheel_viscous_nm_per_mps=p["nm_per_radps"] / radius)


def needed(effect: str, robot: RobotParameters, *keys: str) -> tuple[float, ...]:
    """The robot's parameters of those names. Raises InvalidSetting naming the ones that it lacks."""
    known = robot.known()
    missing = [key for key in keys if key not in known]
    if missing:
        raise InvalidSetting(f"the effect {effect} needs the robot's {', '.join(missing)}")
    return tuple(float(known[key]) for key in keys)


def drive_gain(h: Hidden, p: Parameters, _: RobotParameters) -> Hidden:
    """Both α (1 + ratio)."""
    return h._replace(gain_long=h.gain_long * (1 + p["ratio"]), gain_yaw=h.gain_yaw * (1 + p["ratio"]))


CHANGES: dict[str, Change] = {
    "payload": payload,
    "yaw_inertia": yaw_inertia,
    "drive_gain": drive_gain,
    "rolling_resistance": lambda h, p, _: h._replace(rolling_mps2=p["c0_mps2"]),
    "viscous_drag": lambda h, p, _: h._replace(viscous_per_s=p["c1_per_s"]),
    "aerodynamic_drag": lambda h, p, _: h._replace(
        drag_per_m=p["c2_per_m"], drag_yaw_per_m=p.get("e2_per_m", 0.0)
    ),
    "scrub_torque": lambda h, p, _: h._replace(scrub_mps2=p["d0_mps2"]),
    "swivel_friction": lambda h, p, _: h._replace(swivel_mps2=p["s0_mps2"]),
    "support_friction": lambda h, p, _: h._replace(support_mps2=p["p0_mps2"], support_yaw_mps2=p["d0_mps2"]),
    "yaw_damping": lambda h, p, _: h._replace(damping_per_s=p["d1_per_s"]),
    "wheel_coulomb": lambda h, p, _: h._replace(wheel_coulomb_nm=p["torque_nm"]),
    "wheel_viscous": wheel_viscous,
    "slope": lambda h, p, _: h._replace(grade_x_mps2=p["grade_x_mps2"], grade_y_mps2=p["grade_y_mps2"]),
    "torque_imbalance": lambda h, p, _: h._replace(right_gain=1 + p["ratio"], left_gain=1 - p["ratio"]),
    "torque_bias_common": lambda h, p, _: h._replace(
        bias_right_nm=h.bias_right_nm + p["bias_nm"], bias_left_nm=h.bias_left_nm + p["bias_nm"]
    ),
    "torque_bias_differential": lambda h, p, _: h._replace(
        bias_right_nm=h.bias_right_nm + p["bias_nm"], bias_left_nm=h.bias_left_nm - p["bias_nm"]
    ),
    "actuator_lag": lambda h, p, _: h._replace(lag_s=p["time_constant_s"]),
    "input_delay": lambda h, p, _: h._replace(delay_ns=round(p["delay_s"] * NS_PER_S)),
    "torque_deadzone": lambda h, p, _: h._replace(deadzone_nm=p["threshold_nm"]),
    "torque_saturation": lambda h, p, _: h._replace(saturation_nm=p["limit_nm"]),
    "com_offset": com_offset,
    "cornering_stiffness": lambda h, p, _: h._replace(stiffness=1 + p["ratio"]),
    "load_step": lambda h, p, _: h._replace(load_ratio=p["mass_ratio"], load_s=p["t0_s"]),
    "low_friction_patch": lambda h, p, _: h._replace(
        patch_loss=p["loss"], patch_x_m=p["x_m"], patch_y_m=p["y_m"], patch_radius_m=p["radius_m"]
    ),
    "slip_interval": lambda h, p, _: h._replace(
        slip_loss=p["loss"], slip_start_s=p["start_s"], slip_end_s=p["end_s"]
    ),
    "undeclared_skid": lambda h, p, _: h._replace(undeclared_stiffness=p["stiffness_ratio"]),
    "wheel_eccentricity": lambda h, p, _: h._replace(eccentricity_mps2=p["amplitude_mps2"]),
}
"""The coefficients that each effect of the plant sets; effects on the measured pose have none."""


def hidden_of(effects: Iterable[Effect], robot: RobotParameters, *, plain: bool) -> Hidden:
    """The plant's coefficients for effects that stand at most once each. Raises InvalidSetting for a
    parameter that they have on wheel speeds alone.
    """
    hidden = Hidden(plain=plain)
    for effect in effects:
        if effect.name in CHANGES:
            check_on_torques(effect)
            hidden = CHANGES[effect.name](hidden, effect.parameters, robot)
    return hidden


def check_on_torques(effect: Effect) -> None:
    """Raises InvalidSetting for a parameter that no plant has which torques drive."""
    known = declared(effect.name).parameters if effect.name in catalogue() else {}
    for key in effect.parameters:
        if key in known and "torque" not in known[key].models:
            raise InvalidSetting(f"{effect.name} has {key} only where wheel speeds drive the robot")
