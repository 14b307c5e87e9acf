"""Where an effect shows: the channel of the residual, and the quantity that the residual follows.

A drag is a line in the residual ahead over the speed; a scrub torque a step in that of the yaw over the yaw
rate. Of the traces, the two columns say this best.
"""

from typing import NamedTuple

from wmr_schemas.effects import UNNAMED_PREFIX, declared
from wmr_schemas.slip_terms import SLIP_FACTORS, is_slip_term, parse_slip_term
from wmr_schemas.terms import parse_term


class ShownBy(NamedTuple):
    """``residual``: longitudinal, lateral or yaw; ``variable``: a column of the traces, or ``distance_m``."""

    residual: str
    variable: str


SPEED, TURNING, SUM, DIFFERENCE = "v_mps", "yaw_rate_radps", "effort_sum_nm", "effort_diff_nm"
DISTANCE = "distance_m"
"""Distance from the centre of the disc in which the effect acts: of the traces and its parameters."""
TIME, HEADING, SIDEWAYS, RATE = "t_s", "yaw_rad", "v_lat_mps", "effort_sum_rate_nmps"
PLACES = X, Y = "x_m", "y_m"
AHEAD, ASIDE, YAW = "longitudinal", "lateral", "yaw"
EFFECTS = {
    "payload": ShownBy(AHEAD, SUM),
    "drive_gain": ShownBy(AHEAD, SUM),
    "yaw_inertia": ShownBy(YAW, DIFFERENCE),
    "scrub_torque": ShownBy(YAW, TURNING),
    "yaw_damping": ShownBy(YAW, TURNING),
    "swivel_friction": ShownBy(YAW, DIFFERENCE),
    "support_friction": ShownBy(YAW, TURNING),
    "slope": ShownBy(AHEAD, HEADING),
    "torque_imbalance": ShownBy(YAW, SUM),
    "torque_bias_common": ShownBy(AHEAD, SUM),
    "torque_bias_differential": ShownBy(YAW, DIFFERENCE),
    "actuator_lag": ShownBy(AHEAD, RATE),
    "input_delay": ShownBy(AHEAD, RATE),
    "torque_deadzone": ShownBy(AHEAD, SUM),
    "torque_saturation": ShownBy(AHEAD, SUM),
    "com_offset": ShownBy(AHEAD, TURNING),
    "heading_misalignment": ShownBy(ASIDE, SPEED),
    "yaw_drift": ShownBy(ASIDE, TIME),
    "pose_lever_arm": ShownBy(ASIDE, TURNING),
    "cornering_stiffness": ShownBy(ASIDE, SIDEWAYS),
    "undeclared_skid": ShownBy(ASIDE, TURNING),
    "load_step": ShownBy(AHEAD, TIME),
    "slip_interval": ShownBy(AHEAD, TIME),
    "low_friction_patch": ShownBy(AHEAD, DISTANCE),
    "wheel_scale_difference": ShownBy(YAW, SPEED),
    "effective_track": ShownBy(YAW, TURNING),
    "icr_offset": ShownBy(ASIDE, TURNING),
    "lateral_slip": ShownBy(ASIDE, TURNING),
    "turning_slip": ShownBy(AHEAD, TURNING),
    "pose_delay": ShownBy(AHEAD, SPEED),
    "slope_slip": ShownBy(AHEAD, HEADING),
    "low_grip_patch": ShownBy(AHEAD, DISTANCE),
    "turn_gain": ShownBy(YAW, TURNING),
    "speed_deadzone": ShownBy(AHEAD, SPEED),
    "speed_saturation": ShownBy(AHEAD, SPEED),
    "turn_acceleration_limit": ShownBy(YAW, TURNING),
    "speed_desaturation": ShownBy(AHEAD, SPEED),
    "turn_saturation": ShownBy(YAW, TURNING),
    "acceleration_limit": ShownBy(AHEAD, SPEED),
}
"""What differs from :data:`BY_CHANNEL`."""
BY_CHANNEL = {
    "lateral": ShownBy(ASIDE, SPEED),
    "yaw": ShownBy(YAW, TURNING),
    "input": ShownBy(AHEAD, SUM),
    "measurement": ShownBy(ASIDE, SPEED),
}
OF_FACTOR = {
    "v": SPEED,
    "v_lat": SIDEWAYS,
    "yaw": HEADING,
    "yaw_rate": TURNING,
    "effort_sum": SUM,
    "effort_diff": DIFFERENCE,
    "a": SPEED,
    "t": TIME,
    "x": X,
    "y": Y,
    "s": SPEED,
}
OF_SLIP = {"v_long": AHEAD, "v_lat": ASIDE, "yaw_rate": YAW}


def shown_by(name: str) -> ShownBy:
    """The residual and the quantity that show the effect ``name``; a resistance by its speed."""
    if is_slip_term(name):
        slip = parse_slip_term(name)
        return ShownBy(OF_SLIP[slip.channel], OF_FACTOR[SLIP_FACTORS[slip.factors[-1]][0]])
    if name.startswith(UNNAMED_PREFIX):
        term = parse_term(name)
        return ShownBy(term.channel, OF_FACTOR[(*term.columns, "v")[max(len(term.columns) - 1, 0)]])
    if name in EFFECTS:
        return EFFECTS[name]
    return BY_CHANNEL.get(declared(name).channel, ShownBy(AHEAD, SPEED))
