"""Forms of the first report."""

import numpy as np

from formulas.forms.base import WAVE, At, form
from wmr_schemas.arrays import F64


def triangle(phase: F64) -> F64:
    """A triangle wave between −1 and 1, its corners rounded."""
    return np.arcsin(0.95 * np.sin(phase)) / np.arcsin(0.95)


def round_hill_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """Gravity along the heading on a hill of half a cosine wave, flat from its foot on."""
    dx, dy = at.x - x, at.y - y
    r = np.sqrt(dx**2 + dy**2) + 1e-9
    steep = np.where(r < radius, np.sin(np.pi * r / radius), 0.0)
    return height * steep * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / r


EARLIER = {
    "droop_gaussian": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even",
        lambda at, v0: at.pull * (np.exp(-((at.v / v0) ** 2)) - 1), v0=(1.5, 2.5),
    ),
    "drift_warming": form(
        "longitudinal", "effort_sum t", "effort_sum:odd",
        lambda at, rate, time: -at.pull * rate * (1 - np.exp(-at.t / time)),
        rate=(0.3, 0.6), time=(30.0, 60.0),
    ),
    "turn_gain_drift": form(
        "yaw", "effort_diff t", "effort_diff:odd",
        lambda at, rate: -at.turn * rate * at.t, rate=(0.003, 0.007),
    ),
    "bumps_y": form(
        "longitudinal", "y yaw", "",
        lambda at, size, length, phase: size * triangle(2 * np.pi * at.y / length + phase) * np.sin(at.yaw),
        **WAVE,
    ),
    "sinh_drag": form(
        "longitudinal", "v", "v:odd", lambda at, c, v0: -c * np.sinh(at.v / v0), c=(0.04, 0.1), v0=(0.6, 0.9),
    ),
    "stribeck_hump": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * at.v / (1 + (at.v / v0) ** 2), c=(0.5, 1.0), v0=(0.5, 1.0),
    ),
    "one_sided_drag": form(
        "longitudinal", "v", "v:even", lambda at, c, v0: -c * (np.sqrt(1 + (at.v / v0) ** 2) - 1),
        c=(0.15, 0.35), v0=(0.5, 0.9),
    ),
    "turn_pull": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:odd",
        lambda at, c, w0: c * at.v * np.sin(at.yaw_rate / w0), c=(0.2, 0.4), w0=(0.8, 1.5),
    ),
    "scrub_saturating": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd",
        lambda at, c, v0: -c * (1 - np.exp(-np.abs(at.v) / v0)) * at.w, c=(1.5, 3.0), v0=(0.8, 2.0),
    ),
    "soft_deadband": form(
        "yaw", "yaw_rate", "yaw_rate:odd",
        lambda at, c, w0: -c * at.yaw_rate**3 / (w0**2 + at.yaw_rate**2), c=(0.3, 0.7), w0=(0.3, 0.7),
    ),
    "round_hill": form(
        "longitudinal", "x y yaw", "", round_hill_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.25, 0.5), height=(0.3, 0.6),
    ),
}  # fmt: skip
