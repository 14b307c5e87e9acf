"""Forms of the second report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def ridge_slope(at: At, x: float, y: float, radius: float, height: float, angle: float) -> F64:
    """Gravity along the heading on a long straight ridge through a place, steepest across it."""
    across = (at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)
    return height * across / radius * np.exp(0.5 - across**2 / (2 * radius**2)) * np.cos(at.yaw - angle)


def swell_slope(at: At, size: float, length: float, ratio: float, phase: float) -> F64:
    """Gravity along the heading on ground of two waves over y."""
    turn = 2 * np.pi * at.y / length
    return size * (np.sin(turn + phase) + 0.6 * np.sin(ratio * turn + 2 * phase)) * np.sin(at.yaw)


SECOND = {
    "knee_drag": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * np.sign(at.v) * np.maximum(np.abs(at.v) - v0, 0.0),
        c=(0.3, 0.8), v0=(0.3, 0.7),
    ),
    "field_weakening": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even",
        lambda at, v0: at.pull * (v0 / np.maximum(np.abs(at.v), v0) - 1), v0=(0.35, 0.8),
    ),
    "gain_cycle": form(
        "longitudinal", "effort_sum t", "effort_sum:odd",
        lambda at, size, period: -at.pull * size * np.sin(np.pi * at.t / period) ** 2,
        size=(0.3, 0.6), period=(80.0, 200.0),
    ),
    "push_unlike_brake": form(
        "longitudinal", "effort_sum", "effort_sum:mixed", lambda at, c: -c * np.maximum(at.pull, 0.0),
        c=(0.25, 0.6),
    ),
    "corner_drag": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even",
        lambda at, c, w0: -c * at.v * at.yaw_rate**2 / (w0**2 + at.yaw_rate**2),
        c=(0.4, 0.9), w0=(0.2, 0.5),
    ),
    "swell_y": form(
        "longitudinal", "y yaw", "", swell_slope,
        size=(0.12, 0.3), length=(4.0, 12.0), ratio=(1.5, 2.5), phase=(0.0, 6.28),
    ),
    "ridge": form(
        "longitudinal", "x y yaw", "", ridge_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.08, 0.25), height=(0.3, 0.6), angle=(0.0, 3.14),
    ),
    "speed_pull": form(
        "yaw", "v", "v:even", lambda at, c, v0: c * (np.exp(np.abs(at.v) / v0) - 1),
        c=(0.03, 0.1), v0=(0.8, 1.6),
    ),
    "lopsided_turning": form(
        "yaw", "yaw_rate", "yaw_rate:mixed", lambda at, c: -c * np.maximum(at.yaw_rate, 0.0) ** 1.5,
        c=(0.4, 1.0),
    ),
    "turn_stiffening": form(
        "yaw", "yaw_rate t", "yaw_rate:odd", lambda at, c, time: -c * at.w * at.t / (at.t + time),
        c=(1.5, 4.0), time=(30.0, 120.0),
    ),
    "turn_gain_by_speed": form(
        "yaw", "effort_diff v", "effort_diff:odd v:even",
        lambda at, v0: at.turn * (1 / np.sqrt(1 + (at.v / v0) ** 2) - 1), v0=(0.4, 1.2),
    ),
}  # fmt: skip
