"""Forms of the fifth report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def headwind(at: At, c: float, wind: float, angle: float) -> F64:
    """Resistance of the air that comes from ``angle`` at the speed ``wind``, along the heading."""
    against = at.v + wind * np.cos(at.yaw - angle)
    return -c * against * np.abs(against)


def mud_drag(at: At, x: float, y: float, radius: float, c: float) -> F64:
    """Rolling resistance in a place, flat inside; half of it is left at the radius."""
    r2 = ((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2
    return -c * np.tanh(at.v / 0.1) / (1 + r2**2)


FIFTH = {
    # a governor's shoes swing out and rub from one speed on
    "centrifugal_brake": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * np.sign(at.v) * np.maximum(at.v**2 - v0**2, 0.0),
        c=(0.2, 0.5), v0=(0.3, 0.7),
    ),
    # a steady wind blows over the place: the air resists the speed against it
    "headwind": form(
        "longitudinal", "v yaw", "", headwind, c=(0.06, 0.14), wind=(1.0, 2.5), angle=(0.0, 6.28),
    ),
    # a tyre loses its air and rolls hard from then on
    "puncture": form(
        "longitudinal", "v t", "v:odd",
        lambda at, c, v0, middle, time: (
            -c * at.v / (v0 + np.abs(at.v)) / (1 + np.exp((middle - at.t) / time))
        ),
        c=(0.3, 0.6), v0=(0.1, 0.3), middle=(25.0, 65.0), time=(2.0, 8.0),
    ),
    # soft ground in one place, with a soft edge
    "mud_patch": form(
        "longitudinal", "v x y", "v:odd", mud_drag,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.15, 0.35), c=(0.3, 0.6),
    ),
    # wheels creep on polished strips of the floor, and pass on less of what the motors pull
    "polished_strips": form(
        "longitudinal", "effort_sum y", "effort_sum:odd",
        lambda at, c, length, phase: (
            -0.5 * c * at.pull * (1 + np.tanh(3 * np.sin(2 * np.pi * at.y / length + phase)))
        ),
        c=(0.5, 0.8), length=(3.0, 10.0), phase=(0.0, 6.28),
    ),
    # gears pass on less of the torque that works against the motion than of the one that goes with it
    "backdriven_gear": form(
        "longitudinal", "effort_sum v", "effort_sum:mixed v:mixed",
        lambda at, c: -0.5 * c * at.pull * (1 - np.tanh(at.pull * at.v / 0.02)), c=(0.4, 0.8),
    ),
    # a trailing caster steadies the robot on its way ahead, and makes it swing round in reverse
    "trailing_caster": form(
        "yaw", "v yaw_rate", "v:odd yaw_rate:odd",
        lambda at, c, v0: -c * np.tanh(at.v / v0) * at.w, c=(1.2, 2.8), v0=(0.2, 0.8),
    ),
    # an oil that shears thinner, the faster the robot turns
    "thinning_oil": form(
        "yaw", "yaw_rate", "yaw_rate:odd",
        lambda at, c, n: -c * at.yaw_rate * (at.yaw_rate**2 + 1e-4) ** (0.5 * (n - 1)),
        c=(0.2, 0.45), n=(0.3, 0.6),
    ),
    # tyres that roll over grooved boards are led along the grooves, either way
    "grooved_boards": form(
        "yaw", "v yaw", "v:even",
        lambda at, c, v0, angle: -c * np.sin(2 * (at.yaw - angle)) * np.abs(at.v) / (v0 + np.abs(at.v)),
        c=(0.15, 0.4), v0=(0.2, 0.6), angle=(0.0, 3.14),
    ),
    # pulling loads the driven wheels and braking unloads them: they turn the robot better, or worse
    "weight_shift": form(
        "yaw", "effort_sum effort_diff", "effort_sum:odd effort_diff:odd",
        lambda at, c, a0: c * at.turn * np.tanh(at.pull / a0), c=(0.6, 0.9), a0=(0.03, 0.12),
    ),
    # a wind that comes and goes turns a tall robot round with it
    "weathercock": form(
        "yaw", "yaw t", "",
        lambda at, c, angle, period: c * np.sin(angle - at.yaw) * np.sin(np.pi * at.t / period) ** 2,
        c=(0.2, 0.5), angle=(0.0, 6.28), period=(40.0, 120.0),
    ),
}  # fmt: skip
