"""Forms of the ninth report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def spill_loss(at: At, x: float, y: float, radius: float, c: float) -> F64:
    """Turning torque that is lost on a round spot, flat inside, with a short edge."""
    r = np.sqrt((at.x - x) ** 2 + (at.y - y) ** 2) / radius
    return -0.5 * c * at.turn * (1 - np.tanh(3 * (r - 1)))


def saddle_slope(at: At, x: float, y: float, radius: float, height: float, angle: float) -> F64:
    """Gravity along the heading on a pass: it falls both ways along ``angle`` and rises both ways across it,
    and is level far away; ``height`` in m/s² at the steepest place.
    """
    dx, dy = (at.x - x) / radius, (at.y - y) / radius
    along, across = dx * np.cos(angle) + dy * np.sin(angle), dy * np.cos(angle) - dx * np.sin(angle)
    high = 0.5 * (across**2 - along**2)
    rise_along, rise_across = -along * (1 + high), across * (1 - high)
    rise = rise_along * np.cos(at.yaw - angle) + rise_across * np.sin(at.yaw - angle)
    return -2.4 * height * rise * np.exp(-0.5 * (along**2 + across**2))


def branch_scrub(at: At, c: float, w0: float, begin: float, length: float) -> F64:
    """Resistance to turning from one time on, for a while."""
    there = 0.5 * (np.tanh(2 * (at.t - begin)) - np.tanh(2 * (at.t - begin - length)))
    return -c * at.yaw_rate / np.sqrt(w0**2 + at.yaw_rate**2) * there


def cable_windup(at: At, c: float, angle: float, span: float) -> F64:
    """Torque of a cable that is wound up by all turns so far, slack at first, and no more once it curls."""
    wound = (at.yaw - angle) / span
    return -c * wound * np.abs(wound) / (1 + wound**2)


NINTH = {
    # somebody walks along at an even pace, and pushes or holds back with no more than so much
    "walking_helper": form(
        "longitudinal", "v", "", lambda at, c, pace, v0: c * np.tanh((pace - at.v) / v0),
        c=(0.2, 0.45), pace=(0.4, 1.0), v0=(0.4, 0.9),
    ),
    # brushes set for one way of running: the more current, the more torque that way, and the less the other
    "advanced_brushes": form(
        "longitudinal", "effort_sum", "effort_sum:even",
        lambda at, c, a0: c * at.pull**2 / np.sqrt(a0**2 + at.pull**2), c=(0.4, 0.7), a0=(0.1, 0.3),
    ),
    # a grating whose teeth lean one way: wheels that drive along with them creep
    "toothed_grating": form(
        "longitudinal", "effort_sum yaw", "effort_sum:odd",
        lambda at, c, angle: -c * at.pull * np.exp(1.5 * (np.cos(at.yaw - angle) - 1)),
        c=(0.6, 0.9), angle=(0.0, 6.28),
    ),
    # a frame that opposite torques twist, until a guard rubs on the wheels
    "twisting_frame": form(
        "longitudinal", "effort_diff v", "effort_diff:even v:odd",
        lambda at, c, a0: -c * np.tanh(at.v / 0.1) * at.turn**2 / (a0**2 + at.turn**2),
        c=(0.3, 0.6), a0=(0.05, 0.15),
    ),
    # a pass between two hills
    "saddle": form(
        "longitudinal", "x y yaw", "", saddle_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.15, 0.3), height=(0.3, 0.6), angle=(0.0, 3.14),
    ),
    # the deck of a ship, which rolls about its length
    "rolling_deck": form(
        "longitudinal", "yaw t", "",
        lambda at, size, angle, period, phase: (
            size * np.sin(2 * np.pi * at.t / period + phase) * np.cos(at.yaw - angle)
        ),
        size=(0.25, 0.5), angle=(0.0, 6.28), period=(7.0, 18.0), phase=(0.0, 6.28),
    ),
    # a sweeper's side brush, tilted: it sweeps sideways at rest, and is dragged behind as the robot runs
    "side_brush": form(
        "yaw", "v", "v:even", lambda at, c, v0: c / np.sqrt(1 + (at.v / v0) ** 2),
        c=(0.3, 0.55), v0=(0.2, 0.5),
    ),
    # spilt oil, on which wheels that turn the robot spin
    "oil_spill": form(
        "yaw", "effort_diff x y", "effort_diff:odd", spill_loss,
        x=(0.35, 0.65), y=(0.35, 0.65), radius=(0.3, 0.45), c=(0.85, 0.97),
    ),
    # a branch that the robot picks up, and loses again
    "caught_branch": form(
        "yaw", "yaw_rate t", "yaw_rate:odd", branch_scrub,
        c=(0.3, 0.7), w0=(0.05, 0.2), begin=(12.0, 45.0), length=(15.0, 35.0),
    ),
    # an eddy in shallow water, which turns whatever stands in it
    "whirlpool": form(
        "yaw", "x y", "",
        lambda at, x, y, radius, c: c / (1 + ((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2) ** 2,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.2, 0.35), c=(0.3, 0.6),
    ),
    # a supply cable, which winds up as the robot turns
    "wound_cable": form(
        "yaw", "yaw", "", cable_windup, c=(0.3, 0.6), angle=(-1.5, 1.5), span=(1.2, 3.0),
    ),
}  # fmt: skip
