"""Forms of a twenty-first report, looked at since."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def eddy_brake(at: At, size: float, critical: float) -> F64:
    """A magnet hung over a copper plate on the axle brakes by eddy currents, most at its critical speed."""
    ratio = at.v / critical
    return -2.0 * size * ratio / (1.0 + ratio**2)


def filling_rake(at: At, size: float, period: float, phase: float, soft: float = 0.05) -> F64:
    """A leaf rake drags the harder the fuller it gets, and is lifted to drop its heap at even intervals."""
    return -size * np.tanh(at.v / soft) * np.mod(at.t / period + phase, 1.0)


def coil_gaps(at: At, size: float, spacing: float, phase: float, angle: float, quarter: float) -> F64:
    """Rows of coils in the floor feed the motors by induction; between two rows some pull is lost."""
    way = aslant(angle, quarter)
    along = at.x * np.cos(way) + at.y * np.sin(way)
    return -size * at.pull * np.sin(np.pi * along / spacing + phase) ** 2


def rollover_guard(at: At, size: float, limit: float) -> F64:
    """A tall robot's guard cuts the pull as the sideways acceleration v·yaw_rate nears its limit."""
    return -size * at.pull * np.tanh((at.v * at.yaw_rate / limit) ** 2)


def slipway(at: At, size: float, shore: float, angle: float, quarter: float, length: float = 2.0) -> F64:
    """A slipway's water deepens evenly from shore to its flat foot; drag by depth and speed squared."""
    way = aslant(angle, quarter)
    depth = np.clip((at.x * np.cos(way) + at.y * np.sin(way) + shore) / length, 0.0, 1.0)
    return -size * depth * at.v * np.abs(at.v)


def counterweight(
    at: At, size: float, distance: float, angle: float, quarter: float, soft: float = 0.3
) -> F64:
    """A line over a pulley to a hanging weight draws the robot with even force towards the pulley's post."""
    way = aslant(angle, quarter)
    dx, dy = distance * np.cos(way) - at.x, distance * np.sin(way) - at.y
    return size * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / np.sqrt(dx**2 + dy**2 + soft**2)


def scanning_dish(at: At, size: float, period: float, phase: float, sharp: float = 1.5) -> F64:
    """A heavy dish on the roof pans evenly to and fro; its turning about at either end kicks the body."""
    swing = 2.0 * np.pi * at.t / period + phase
    return size * np.sin(swing) / np.cosh(sharp * np.cos(swing)) ** 2


def kingpin_under_pull(at: At, size: float, soft: float = 0.04) -> F64:
    """The kingpin of a towed dolly rubs against turning, the harder the more pull or push it passes on."""
    return -size * np.tanh(at.w / soft) * np.abs(at.pull)


def gravel_ring(at: At, size: float, radius: float, width: float, soft: float = 0.04) -> F64:
    """A round path of deep gravel about the middle of the site grips the wheels against turning on it."""
    off = (np.hypot(at.x, at.y) - radius) / width
    return -size * np.tanh(at.w / soft) * np.exp(-(off**2))


def squashed_downhill_tyre(at: At, size: float, angle: float, quarter: float) -> F64:
    """Across a slope the lower, loaded wheel grips and the upper one slips: pulling turns the robot."""
    return size * at.pull * np.sin(at.yaw - aslant(angle, quarter))


def iron_chassis(at: At, size: float, angle: float) -> F64:
    """By a scanner's big magnet the long iron chassis is turned in line with the field, either end first."""
    return -size * np.sin(2.0 * (at.yaw - angle))


ANGLE = {"angle": (0.2, 1.37), "quarter": (0.0, 4.0)}

TWENTYFIRST = {
    "eddy_brake": form("longitudinal", "v", "v:odd", eddy_brake, size=(0.2, 0.45), critical=(0.2, 0.5)),
    "filling_rake": form(
        "longitudinal", "v t", "v:odd", filling_rake, size=(0.3, 0.6), period=(18.0, 35.0), phase=(0.0, 1.0)
    ),
    "coil_gaps": form(
        "longitudinal",
        "x y effort_sum",
        "effort_sum:odd",
        coil_gaps,
        size=(0.5, 0.9),
        spacing=(1.5, 3.5),
        phase=(0.0, 3.14),
        **ANGLE,
    ),
    "rollover_guard": form(
        "longitudinal",
        "effort_sum v yaw_rate",
        "effort_sum:odd v:even yaw_rate:even",
        rollover_guard,
        size=(0.5, 0.9),
        limit=(0.08, 0.2),
    ),
    "slipway": form("longitudinal", "x y v", "v:odd", slipway, size=(0.5, 1.2), shore=(0.7, 1.7), **ANGLE),
    "counterweight": form(
        "longitudinal", "x y yaw", "", counterweight, size=(0.15, 0.4), distance=(1.0, 3.0), **ANGLE
    ),
    "scanning_dish": form(
        "yaw", "t", "", scanning_dish, size=(0.25, 0.6), period=(5.0, 14.0), phase=(0.0, 6.28)
    ),
    "kingpin_under_pull": form(
        "yaw",
        "yaw_rate effort_sum",
        "yaw_rate:odd effort_sum:even",
        kingpin_under_pull,
        size=(0.4, 0.8),
    ),
    "gravel_ring": form(
        "yaw",
        "x y yaw_rate",
        "yaw_rate:odd",
        gravel_ring,
        size=(0.3, 0.6),
        radius=(1.2, 2.5),
        width=(0.6, 1.2),
    ),
    "squashed_downhill_tyre": form(
        "yaw", "yaw effort_sum", "effort_sum:odd", squashed_downhill_tyre, size=(0.4, 0.8), **ANGLE
    ),
    "iron_chassis": form("yaw", "yaw", "", iron_chassis, size=(0.15, 0.4), angle=(0.2, 2.94)),
}
