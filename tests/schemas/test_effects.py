"""The catalogue of effects against the documented list of the gap workflow, written out by hand."""

from wmr_schemas.effects import EFFECTS

DOCUMENTED = {
    "payload": ("mass_ratio",),
    "yaw_inertia": ("ratio",),
    "drive_gain": ("ratio",),
    "rolling_resistance": ("c0_mps2",),
    "viscous_drag": ("c1_per_s",),
    "aerodynamic_drag": ("c2_per_m",),
    "scrub_torque": ("d0_mps2",),
    "yaw_damping": ("d1_per_s",),
    "wheel_coulomb": ("torque_nm",),
    "wheel_viscous": ("nm_per_radps",),
    "slope": ("grade_x_mps2", "grade_y_mps2"),
    "torque_imbalance": ("ratio",),
    "torque_bias_common": ("bias_nm",),
    "torque_bias_differential": ("bias_nm",),
    "actuator_lag": ("time_constant_s",),
    "input_delay": ("delay_s",),
    "torque_deadzone": ("threshold_nm",),
    "torque_saturation": ("limit_nm",),
    "com_offset": ("offset_m",),
    "heading_misalignment": ("angle_rad",),
    "pose_lever_arm": ("x_m", "y_m"),
    "cornering_stiffness": ("ratio",),
    "load_step": ("mass_ratio", "t0_s"),
    "low_friction_patch": ("x_m", "y_m", "radius_m", "loss"),
    "slip_interval": ("start_s", "end_s", "loss"),
    "undeclared_skid": ("stiffness_ratio",),
    "yaw_drift": ("rate_radps",),
}
UNIT_BY_SUFFIX = {
    "_mps2": "m/s²",
    "_per_s": "1/s",
    "_per_m": "1/m",
    "_per_radps": "N·m/(rad/s)",
    "_nm": "N·m",
    "_rad": "rad",
    "_radps": "rad/s",
    "_s": "s",
    "_m": "m",
}


def test_the_catalogue_is_the_documented_one() -> None:
    assert {name: tuple(form.parameters) for name, form in EFFECTS.items()} == DOCUMENTED


def test_an_entry_is_filed_under_its_own_name_and_has_a_formula() -> None:
    assert all(name == form.name and form.formula for name, form in EFFECTS.items())


def test_each_parameters_unit_is_the_one_in_its_name() -> None:
    for form in EFFECTS.values():
        for key, unit in form.parameters.items():
            suffix = next((suffix for suffix in UNIT_BY_SUFFIX if key.endswith(suffix)), None)
            assert unit == UNIT_BY_SUFFIX.get(suffix or "", "1"), (form.name, key)
