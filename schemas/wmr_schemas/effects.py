"""The effects that a model can carry beyond the base: names, forms, parameters and units.

One catalogue for ``model.toml``, ``gap.json`` and ``--hide``; terms after ISO 8855. ``v`` is the longitudinal
speed, ``u`` the effort, both in robot conventions.
"""

from dataclasses import dataclass
from typing import Literal

Channel = Literal["longitudinal", "lateral", "yaw", "both", "input", "measurement"]


@dataclass(frozen=True)
class EffectForm:
    """One entry of the catalogue: where it acts, its formula, and the unit of each parameter."""

    name: str
    channel: Channel
    formula: str
    parameters: dict[str, str]


_RATIO = "1"
_FORMS = (
    EffectForm("payload", "longitudinal", "alpha / (1 + mass_ratio)", {"mass_ratio": _RATIO}),
    EffectForm("yaw_inertia", "yaw", "alpha_yaw / (1 + ratio)", {"ratio": _RATIO}),
    EffectForm("drive_gain", "both", "alpha·(1 + ratio), alpha_yaw·(1 + ratio)", {"ratio": _RATIO}),
    EffectForm("rolling_resistance", "longitudinal", "−c0·tanh(v/v0)", {"c0_mps2": "m/s²"}),
    EffectForm("viscous_drag", "longitudinal", "−c1·v", {"c1_per_s": "1/s"}),
    EffectForm("aerodynamic_drag", "longitudinal", "−c2·v·|v|", {"c2_per_m": "1/m"}),
    EffectForm("scrub_torque", "yaw", "−d0·sgn(yaw_rate) on l·yaw_acc", {"d0_mps2": "m/s²"}),
    EffectForm("yaw_damping", "yaw", "−d1·l·yaw_rate", {"d1_per_s": "1/s"}),
    EffectForm("wheel_coulomb", "both", "u − torque·sgn(wheel speed), each wheel", {"torque_nm": "N·m"}),
    EffectForm("wheel_viscous", "both", "u − c·wheel speed, each wheel", {"nm_per_radps": "N·m/(rad/s)"}),
    EffectForm(
        "slope",
        "both",
        "grade_x·cos(yaw) + grade_y·sin(yaw)",
        {"grade_x_mps2": "m/s²", "grade_y_mps2": "m/s²"},
    ),
    EffectForm("torque_imbalance", "input", "right·(1 + ratio), left·(1 − ratio)", {"ratio": _RATIO}),
    EffectForm("torque_bias_common", "input", "u + bias on both wheels", {"bias_nm": "N·m"}),
    EffectForm("torque_bias_differential", "input", "right + bias, left − bias", {"bias_nm": "N·m"}),
    EffectForm("actuator_lag", "input", "u / (T·s + 1)", {"time_constant_s": "s"}),
    EffectForm("input_delay", "input", "u(t − delay)", {"delay_s": "s"}),
    EffectForm("torque_deadzone", "input", "sgn(u)·max(|u| − threshold, 0)", {"threshold_nm": "N·m"}),
    EffectForm("torque_saturation", "input", "clip(u, −limit, limit)", {"limit_nm": "N·m"}),
    EffectForm(
        "com_offset",
        "both",
        "d·yaw_rate² on dv_long/dt, −(l·m·d/I)·v·yaw_rate on l·yaw_acc",
        {"offset_m": "m"},
    ),
    EffectForm("heading_misalignment", "measurement", "yaw + angle", {"angle_rad": "rad"}),
    EffectForm("pose_lever_arm", "measurement", "position + R(yaw)·(x, y)", {"x_m": "m", "y_m": "m"}),
    EffectForm("cornering_stiffness", "lateral", "G_x·(1 + ratio)", {"ratio": _RATIO}),
    EffectForm("load_step", "longitudinal", "as payload, from t0 on", {"mass_ratio": _RATIO, "t0_s": "s"}),
    EffectForm(
        "low_friction_patch",
        "both",
        "alpha·(1 − loss), G_x·(1 − loss) inside a disc",
        {"x_m": "m", "y_m": "m", "radius_m": "m", "loss": _RATIO},
    ),
    EffectForm(
        "slip_interval",
        "both",
        "alpha·(1 − loss) in an interval",
        {"start_s": "s", "end_s": "s", "loss": _RATIO},
    ),
    EffectForm(
        "undeclared_skid",
        "lateral",
        "the skidding dynamics while the mode says ideal",
        {"stiffness_ratio": _RATIO},
    ),
    EffectForm(
        "yaw_drift", "measurement", "yaw + rate·t, t from the log's first pose", {"rate_radps": "rad/s"}
    ),
)

EFFECTS: dict[str, EffectForm] = {form.name: form for form in _FORMS}
BEYOND: dict[str, EffectForm] = {
    "wheel_eccentricity": EffectForm(
        "wheel_eccentricity", "both", "½·amplitude·sin(wheel angle), each wheel", {"amplitude_mps2": "m/s²"}
    ),
}
"""Effects that only the simulator has: no candidate names them, no model file holds them."""
UNNAMED_PREFIX = "unnamed:"
"""Prefix of an effect that only a dictionary term describes, ``unnamed:<channel>:<term>``; see :mod:`.terms`.
"""
