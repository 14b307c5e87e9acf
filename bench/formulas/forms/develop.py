"""Forms of the part that is for development from the start."""

import numpy as np

from formulas.forms.base import WAVE, At, form
from wmr_schemas.arrays import F64


def dome_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """Gravity along the heading on a bell-shaped dome; ``height`` in m/s² at the steepest place."""
    dx, dy = at.x - x, at.y - y
    bell = np.exp(0.5 - (dx**2 + dy**2) / (2 * radius**2))
    return height * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / radius * bell


DEVELOP = {
    "droop_rational": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even",
        lambda at, v0: at.pull * (1 / (1 + np.abs(at.v) / v0) - 1), v0=(0.8, 2.5),
    ),
    "drift_linear": form(
        "longitudinal", "effort_sum t", "effort_sum:odd",
        lambda at, rate: -at.pull * rate * at.t, rate=(0.003, 0.007),
    ),
    "bumps_x": form(
        "longitudinal", "x yaw", "",
        lambda at, size, length, phase: size * np.sin(2 * np.pi * at.x / length + phase) * np.cos(at.yaw),
        **WAVE,
    ),
    "cubic_drag": form(
        "longitudinal", "v", "v:odd", lambda at, c: -c * at.v**3, c=(0.06, 0.2),
    ),
    "tanh_drag": form(
        "longitudinal", "v", "v:odd", lambda at, c, v0: -c * np.tanh(at.v / v0), c=(0.15, 0.4), v0=(0.4, 1.0),
    ),
    "even_drag": form(
        "longitudinal", "v", "v:even", lambda at, c: -c * at.v**2, c=(0.08, 0.25),
    ),
    "cross": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:odd",
        lambda at, c: c * at.v * at.yaw_rate, c=(0.3, 0.7),
    ),
    "scrub_by_speed": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd", lambda at, c: -c * np.abs(at.v) * at.w, c=(0.8, 2.0),
    ),
    "dome": form(
        "longitudinal", "x y yaw", "", dome_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.12, 0.25), height=(0.3, 0.6),
    ),
}  # fmt: skip
