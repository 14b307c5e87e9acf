"""Which effects the second plant hides, and how large: small to clear, drawn on a logarithmic scale.

Sizes are in the units of the effects' declarations. Where the plant's form differs from the declared one, the
size is that of the declared form which it comes closest to: at speeds well above the friction's, at 1 m/s for
the drags, on average for slope and drift, half-way for ramps and edges.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wmr_schemas.robot import RobotParameters
from worlds.plant_two.equations import Hidden

Rng = np.random.Generator
Sizes = dict[str, float]


@dataclass(frozen=True)
class Size:
    """An effect of one size: the declared parameter, the plant's field, and the range that is drawn from.

    ``unit`` turns the drawn number into the parameter's unit. ``same_form`` says that the plant has the
    declared form.
    """

    parameter: str
    low: float
    high: float
    signed: bool = False
    unit: Callable[[RobotParameters], float] = lambda _: 1.0
    same_form: bool = False


def both_wheels(robot: RobotParameters) -> float:
    """Torque of a wheel by acceleration: 1/(2α)."""
    return 1 / (2 * robot.alpha)


def turning(robot: RobotParameters) -> float:
    """Torque of a wheel by l·yaw_acc: 1/(2α_yaw)."""
    return 1 / (2 * robot.alpha_yaw)


def wheel_speed(robot: RobotParameters) -> float:
    """Torque of a wheel over its speed, by acceleration at 1 m/s."""
    return robot.wheel_radius_m / (2 * robot.alpha)


SIZES = {
    "payload": Size("mass_ratio", 0.05, 0.5),
    "yaw_inertia": Size("ratio", 0.08, 0.5, same_form=True),
    "drive_gain": Size("ratio", 0.05, 0.35, signed=True),
    "rolling_resistance": Size("c0_mps2", 0.03, 0.3),
    "viscous_drag": Size("c1_per_s", 0.03, 0.3),
    "aerodynamic_drag": Size("c2_per_m", 0.03, 0.3),
    "scrub_torque": Size("d0_mps2", 0.03, 0.2),
    "yaw_damping": Size("d1_per_s", 0.15, 1.0, same_form=True),
    "wheel_coulomb": Size("torque_nm", 0.04, 0.3, unit=both_wheels),
    "wheel_viscous": Size("nm_per_radps", 0.04, 0.3, unit=wheel_speed, same_form=True),
    "torque_imbalance": Size("ratio", 0.03, 0.2, signed=True, same_form=True),
    "torque_bias_common": Size("bias_nm", 0.03, 0.25, signed=True, unit=both_wheels, same_form=True),
    "torque_bias_differential": Size("bias_nm", 0.03, 0.2, signed=True, unit=turning, same_form=True),
    "actuator_lag": Size("time_constant_s", 0.03, 0.25),
    "input_delay": Size("delay_s", 0.03, 0.2, same_form=True),
    "torque_deadzone": Size("threshold_nm", 0.05, 0.4, unit=both_wheels),
    "torque_saturation": Size("limit_nm", 0.4, 0.9, unit=both_wheels),
    "com_offset": Size("offset_m", 0.006, 0.03, signed=True, same_form=True),
    "cornering_stiffness": Size("ratio", 0.15, 0.5, signed=True, same_form=True),
    "heading_misalignment": Size("angle_rad", 0.01, 0.1, signed=True, same_form=True),
    "yaw_drift": Size("rate_radps", 0.001, 0.01, signed=True),
}
VECTORS = {
    "slope": ("grade_x_mps2", "grade_y_mps2", 0.05, 0.5),
    "pose_lever_arm": ("x_m", "y_m", 0.03, 0.3),
}
LOCAL = ("load_step", "slip_interval", "low_friction_patch")
EFFECTS = (*SIZES, *VECTORS, *LOCAL)
"""All declared effects of the torque base but ``undeclared_skid``, which needs labels that miss a skid."""
SAME_FORM = frozenset(name for name, size in SIZES.items() if size.same_form) | {"pose_lever_arm"}


def log_uniform(low: float, high: float, rng: Rng) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def drawn(name: str, robot: RobotParameters, duration_s: float, rng: Rng) -> Sizes:
    """The effect's parameters by their declared names; a patch still lacks its place."""
    if name in SIZES:
        size = SIZES[name]
        sign = rng.choice((-1.0, 1.0)) if size.signed else 1.0
        return {size.parameter: float(sign * log_uniform(size.low, size.high, rng) * size.unit(robot))}
    if name in VECTORS:
        first, second, low, high = VECTORS[name]
        length, angle = log_uniform(low, high, rng), rng.uniform(0, 2 * np.pi)
        return {first: float(length * np.cos(angle)), second: float(length * np.sin(angle))}
    if name == "load_step":
        return {
            "mass_ratio": log_uniform(0.1, 0.5, rng),
            "t0_s": float(rng.uniform(0.2, 0.6) * duration_s),
        }
    if name == "slip_interval":
        start_s = float(rng.uniform(0.15, 0.8) * duration_s)
        return {
            "start_s": start_s,
            "end_s": start_s + float(rng.uniform(0.04, 0.12) * duration_s),
            "loss": float(rng.uniform(0.2, 0.7)),
        }
    if name == "low_friction_patch":
        return {"radius_m": float(rng.uniform(0.5, 1.5)), "loss": float(rng.uniform(0.2, 0.7))}
    raise KeyError(name)


def hidden_of(name: str, sizes: Sizes) -> Hidden:
    """The plant's sizes of one effect; those of the pose's errors are not the plant's."""
    if name in ("", "heading_misalignment", "yaw_drift", "pose_lever_arm"):
        return Hidden()
    if name == "slope":
        return Hidden(slope_x=sizes["grade_x_mps2"], slope_y=sizes["grade_y_mps2"])
    if name == "load_step":
        return Hidden(load_ratio=sizes["mass_ratio"], load_t0_s=sizes["t0_s"])
    if name == "slip_interval":
        return Hidden(
            interval_start_s=sizes["start_s"],
            interval_end_s=sizes["end_s"],
            interval_loss=sizes["loss"],
        )
    if name == "low_friction_patch":
        return Hidden(
            patch_x_m=sizes["x_m"],
            patch_y_m=sizes["y_m"],
            patch_radius_m=sizes["radius_m"],
            patch_loss=sizes["loss"],
        )
    return Hidden(**{name: sizes[SIZES[name].parameter]})
