"""Forms of the third report."""

import numpy as np

from formulas.forms.base import WAVE, At, form
from wmr_schemas.arrays import F64


def bowl_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """Gravity along the heading in a round bowl, flat at its middle and from its rim on; steepest between."""
    dx, dy = at.x - x, at.y - y
    out = np.minimum((dx**2 + dy**2) / radius**2, 1.0)
    steep = 0.5 * np.sqrt(27.0) * (1 - out)
    return -height * steep * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / radius


THIRD = {
    "stiction_tail": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * np.tanh(at.v / 0.02) * np.exp(-np.abs(at.v) / v0),
        c=(0.2, 0.5), v0=(0.3, 0.8),
    ),
    "fan_drag": form(
        "longitudinal", "v", "v:odd", lambda at, c: -c * np.sign(at.v) * np.abs(at.v) ** 1.5,
        c=(0.1, 0.3),
    ),
    "progressive_gain": form(
        "longitudinal", "effort_sum", "effort_sum:odd",
        lambda at, c, a0: -c * at.pull / (1 + (at.pull / a0) ** 2), c=(0.3, 0.6), a0=(0.3, 0.8),
    ),
    "weak_backwards": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:mixed",
        lambda at, c: -c * at.pull * (at.v < 0), c=(0.3, 0.6),
    ),
    "turning_drag": form(
        "longitudinal", "yaw_rate", "yaw_rate:even", lambda at, c: -c * np.abs(at.yaw_rate) ** 1.5,
        c=(0.3, 0.8),
    ),
    "ageing_drag": form(
        "longitudinal", "v t", "v:odd", lambda at, c, time: -c * at.v * at.t / (at.t + time),
        c=(0.4, 0.9), time=(30.0, 120.0),
    ),
    "washboard": form(
        "longitudinal", "x yaw", "",
        lambda at, size, length, phase: (
            size * np.sin(2 * np.pi * at.x / length + phase) ** 3 * np.cos(at.yaw)
        ),
        **WAVE,
    ),
    "bowl": form(
        "longitudinal", "x y yaw", "", bowl_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.25, 0.5), height=(0.3, 0.6),
    ),
    "cable_twist": form(
        "yaw", "yaw", "", lambda at, c, angle: c * np.sin(at.yaw - angle), c=(0.1, 0.3), angle=(0.0, 6.28),
    ),
    "turn_gain_cycle": form(
        "yaw", "effort_diff t", "effort_diff:odd",
        lambda at, size, period: -at.turn * size * np.sin(np.pi * at.t / period) ** 2,
        size=(0.3, 0.6), period=(80.0, 200.0),
    ),
    "turn_gain_saturating": form(
        "yaw", "effort_diff", "effort_diff:odd",
        lambda at, c, a0: -c * at.turn * np.abs(at.turn) / (a0 + np.abs(at.turn)),
        c=(0.4, 0.8), a0=(0.1, 0.4),
    ),
}  # fmt: skip
