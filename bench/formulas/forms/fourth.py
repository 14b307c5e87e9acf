"""Forms of the fourth report."""

import numpy as np

from formulas.forms.base import WAVE, form

FOURTH = {
    # grease in the bearings shears as an activated flow does, its stress growing as an inverse sinh
    "grease_shear": form(
        "longitudinal", "v", "v:odd", lambda at, c, v0: -c * np.arcsinh(at.v / v0),
        c=(0.1, 0.25), v0=(0.08, 0.3),
    ),
    # the load shakes at one speed, which takes power there alone
    "resonant_drag": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0, width: -c * (
            np.exp(-(((at.v - v0) / width) ** 2)) - np.exp(-(((at.v + v0) / width) ** 2))
        ),
        c=(0.25, 0.6), v0=(0.4, 0.9), width=(0.15, 0.35),
    ),
    # the motors' iron saturates: torque grows slower than the current that is commanded as torque
    "iron_saturation": form(
        "longitudinal", "effort_sum", "effort_sum:odd",
        lambda at, a0: a0 * np.arctan(at.pull / a0) - at.pull, a0=(0.15, 0.5),
    ),
    # both motors hang on one battery, whose voltage sags with what turning draws
    "battery_sag": form(
        "longitudinal", "effort_sum effort_diff", "effort_sum:odd effort_diff:even",
        lambda at, c, a0: -c * at.pull * np.abs(at.turn) / (a0 + np.abs(at.turn)),
        c=(0.5, 0.9), a0=(0.05, 0.2),
    ),
    # strips of soft floor with soft edges, which cost rolling resistance by speed
    "striped_floor": form(
        "longitudinal", "v x", "v:odd",
        lambda at, c, length, phase: (
            -c * at.v / (1 + np.exp(-4 * np.sin(2 * np.pi * at.x / length + phase)))
        ),
        c=(0.4, 0.9), length=(3.0, 10.0), phase=(0.0, 6.28),
    ),
    # a wind from one side of the place that rises and dies away once
    "squall": form(
        "longitudinal", "yaw t", "",
        lambda at, c, angle, middle, time: (
            c * np.exp(-(((at.t - middle) / time) ** 2)) * np.cos(at.yaw - angle)
        ),
        c=(0.25, 0.5), angle=(0.0, 6.28), middle=(20.0, 70.0), time=(12.0, 30.0),
    ),
    # tyres that creep at first and let go of the ground as the robot turns faster
    "scrub_letting_go": form(
        "yaw", "yaw_rate", "yaw_rate:odd",
        lambda at, c, w0: -c * at.yaw_rate * np.exp(-np.abs(at.yaw_rate) / w0), c=(1.0, 2.5), w0=(0.2, 0.5),
    ),
    # a caster stuck askew steers as soon as it rolls, the other way in reverse
    "skewed_caster": form(
        "yaw", "v", "v:odd", lambda at, c, v0: c * at.v / (v0 + np.abs(at.v)), c=(0.1, 0.35), v0=(0.2, 0.8),
    ),
    # planks that tip to alternating sides; the weight behind the axle swings downhill
    "tilted_planks": form(
        "yaw", "y yaw", "",
        lambda at, size, length, phase: (
            size * np.tanh(2 * np.sin(2 * np.pi * at.y / length + phase)) * np.cos(at.yaw)
        ),
        **WAVE,
    ),
    # the belt of one side slips beyond a torque, so that pulling and braking turn the robot
    "slipping_belt": form(
        "yaw", "effort_sum", "effort_sum:odd",
        lambda at, c, a0: c * np.sign(at.pull) * np.maximum(np.abs(at.pull) - a0, 0.0),
        c=(0.3, 0.7), a0=(0.03, 0.15),
    ),
    # the motors' back voltage leaves less torque, the faster the robot turns
    "turn_gain_by_rate": form(
        "yaw", "effort_diff yaw_rate", "effort_diff:odd yaw_rate:even",
        lambda at, w0: at.turn * (1 / (1 + (at.yaw_rate / w0) ** 2) - 1), w0=(0.15, 0.5),
    ),
}  # fmt: skip
