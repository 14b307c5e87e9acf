"""Forms of the eighth report."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def lane_loss(at: At, x: float, y: float, radius: float, c: float, angle: float, quarter: float) -> F64:
    """Pull that is lost on a straight lane through a place, flat inside, with short edges."""
    across_angle = aslant(angle, quarter)
    across = ((at.x - x) * np.cos(across_angle) + (at.y - y) * np.sin(across_angle)) / radius
    return -0.5 * c * at.pull * (np.tanh(4 * (across + 1)) - np.tanh(4 * (across - 1)))


def furrow_slope(at: At, size: float, length: float, phase: float, angle: float, quarter: float) -> F64:
    """Gravity along the heading on narrow, even ridges with flat ground between, at a slant to the axes."""
    across_angle = aslant(angle, quarter)
    turn = 2 * np.pi * (at.x * np.cos(across_angle) + at.y * np.sin(across_angle)) / length + phase
    return size * np.sin(turn) * np.exp(1.2 * np.cos(turn)) / 1.6 * np.cos(at.yaw - across_angle)


def rug_scrub(
    at: At, x: float, y: float, radius: float, c: float, w0: float, angle: float, aspect: float
) -> F64:
    """Resistance to turning on a rug: a rectangle with round corners, laid at an angle."""
    dx, dy = at.x - x, at.y - y
    along = (dx * np.cos(angle) + dy * np.sin(angle)) / radius
    across = (dy * np.cos(angle) - dx * np.sin(angle)) / (aspect * radius)
    return -c * at.yaw_rate / np.sqrt(w0**2 + at.yaw_rate**2) / (1 + along**6 + across**6)


def crown_swing(
    at: At, x: float, y: float, radius: float, height: float, angle: float, quarter: float
) -> F64:
    """What turns a robot with its weight behind the axle downhill on either side of a road's crown."""
    across_angle = aslant(angle, quarter)
    across = ((at.x - x) * np.cos(across_angle) + (at.y - y) * np.sin(across_angle)) / radius
    return height * np.tanh(across) * np.sin(at.yaw - across_angle)


def side_force_drag(at: At, c: float, a0: float) -> F64:
    """Drag of tyres that roll askew to bear the side force of a bend: by its square, then in proportion."""
    side = np.abs(at.v * at.yaw_rate)
    return -c * np.tanh(at.v / 0.1) * side**2 / (a0 + side)


EIGHTH = {
    # a scrubber's rubber lip drags flat on the floor ahead, and folds away in reverse
    "squeegee": form(
        "longitudinal", "v", "v:mixed",
        lambda at, c: -c * at.v / (at.v**2 + 0.01) ** 0.25 * np.where(at.v > 0, 1.0, 0.15),
        c=(0.2, 0.45),
    ),
    # a driver's soft current limit: torque as commanded up to it, and a part of what is asked beyond
    "current_limit": form(
        "longitudinal", "effort_sum", "effort_sum:odd",
        lambda at, c, a0: c * at.pull * ((1 + (at.pull / a0) ** 4) ** -0.25 - 1), c=(0.5, 0.8), a0=(0.1, 0.3),
    ),
    # a lane that was mopped: the wheels creep on it, and pass on less of the torques
    "mopped_lane": form(
        "longitudinal", "effort_sum x y", "effort_sum:odd", lane_loss,
        x=(0.35, 0.65), y=(0.35, 0.65), radius=(0.12, 0.25), c=(0.5, 0.8),
        angle=(0.35, 1.22), quarter=(0.0, 4.0),
    ),
    # a field's furrows, at a slant to the axes of the map
    "furrows": form(
        "longitudinal", "x y yaw", "", furrow_slope,
        size=(0.3, 0.6), length=(2.5, 8.0), phase=(0.0, 6.28), angle=(0.35, 1.22), quarter=(0.0, 4.0),
    ),
    # a wind that goes round as a front passes over
    "veering_wind": form(
        "longitudinal", "yaw t", "",
        lambda at, c, angle, middle, time: (
            c * np.cos(at.yaw - angle - np.pi / (1 + np.exp((middle - at.t) / time)))
        ),
        c=(0.2, 0.4), angle=(0.0, 6.28), middle=(30.0, 60.0), time=(5.0, 15.0),
    ),
    # tyres that bear a side force roll askew, which brakes
    "side_force_drag": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even", side_force_drag, c=(0.8, 1.5), a0=(0.03, 0.12),
    ),
    # wheels on rubber scrub hardest as they break away, and keep a part of it as the robot turns faster
    "breakaway_scrub": form(
        "yaw", "yaw_rate", "yaw_rate:odd",
        lambda at, c, w0: -c * np.tanh(at.yaw_rate / 0.04) * (0.2 + 0.8 / (1 + (at.yaw_rate / w0) ** 2)),
        c=(0.25, 0.6), w0=(0.1, 0.4),
    ),
    # worn contacts of a motor bridge: torque to the left comes through weaker than torque to the right
    "worn_bridge": form(
        "yaw", "effort_diff", "effort_diff:mixed",
        lambda at, c, a0: -c * at.turn / (1 + np.exp(-at.turn / a0)), c=(0.7, 0.9), a0=(0.02, 0.06),
    ),
    # a thick rug that lies askew in the hall
    "thick_rug": form(
        "yaw", "yaw_rate x y", "yaw_rate:odd", rug_scrub,
        x=(0.35, 0.65), y=(0.35, 0.65), radius=(0.25, 0.4), c=(0.5, 0.9), w0=(0.05, 0.2),
        angle=(0.0, 3.14), aspect=(0.6, 1.0),
    ),
    # a road with a crown along its middle turns the robot's weight downhill, to either side
    "crowned_road": form(
        "yaw", "x y yaw", "", crown_swing,
        x=(0.35, 0.65), y=(0.35, 0.65), radius=(0.05, 0.2), height=(0.15, 0.4),
        angle=(0.35, 1.22), quarter=(0.0, 4.0),
    ),
    # a loose plug of one motor, which loses contact for some seconds again and again
    "loose_plug": form(
        "yaw", "effort_sum t", "effort_sum:odd",
        lambda at, c, period, phase, bias: (
            0.5 * c * at.pull * (1 + np.tanh(5 * (np.sin(2 * np.pi * at.t / period + phase) - bias)))
        ),
        c=(0.5, 0.9), period=(12.0, 40.0), phase=(0.0, 6.28), bias=(-0.3, 0.3),
    ),
}  # fmt: skip
