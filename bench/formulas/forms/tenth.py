"""Forms of the tenth report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def helix_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """Gravity along the heading on a ramp that winds up to the left about a place, steepest at the radius."""
    dx, dy = (at.x - x) / radius, (at.y - y) / radius
    return -2 * height * (dx * np.sin(at.yaw) - dy * np.cos(at.yaw)) / (1 + dx**2 + dy**2)


def arm_reaction(at: At, size: float, period: float, phase: float) -> F64:
    """What an arm's swings hand on: a short jerk one way, then the other, and little until the next swing."""
    turn = 2 * np.pi * at.t / period + phase
    return size * np.sin(turn) * np.exp(1.5 * (np.cos(turn) - 0.55))


TENTH = {
    # a cart's assisting drive pushes whichever way the cart goes, and ever less up to the speed allowed
    "power_assist": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: c * np.tanh(at.v / 0.3) * np.maximum(1 - np.abs(at.v) / v0, 0.0),
        c=(0.3, 0.55), v0=(0.9, 1.6),
    ),
    # a snow blade set askew: what it throws aside turns the robot; in reverse it turns it back a little
    "angled_blade": form(
        "yaw", "v", "v:mixed",
        lambda at, c, v0: c * np.where(at.v > 0, 1.0, -0.3) * (1 - np.exp(-np.abs(at.v) / v0)),
        c=(0.25, 0.5), v0=(0.3, 0.7),
    ),
    # one bridge lost a half that drives, the other one a half that brakes: both turn the robot the same way
    "crossed_halves": form(
        "yaw", "effort_sum", "effort_sum:even",
        lambda at, c, a0: c * (np.sqrt(a0**2 + at.pull**2) - a0), c=(0.5, 0.9), a0=(0.03, 0.1),
    ),
    # a groomed track: runners roll easily along its ribs, and rub on each rib across them
    "groomed_ribs": form(
        "longitudinal", "v yaw", "v:odd",
        lambda at, c, v0, angle: -c * at.v / np.sqrt(v0**2 + at.v**2) * np.abs(np.sin(at.yaw - angle)),
        c=(0.35, 0.65), v0=(0.1, 0.4), angle=(0.0, 3.14),
    ),
    # a battery at the end of its charge: little at first, and ever quicker, it gives less
    "discharge_knee": form(
        "longitudinal", "effort_sum t", "effort_sum:odd",
        lambda at, c, time: -c * at.pull * np.exp((at.t - 90.0) / time), c=(0.8, 0.95), time=(20.0, 45.0),
    ),
    # a carpet whose pile leans: it leads wheels that pull across it to one side, braking ones to the other
    "leaning_pile": form(
        "yaw", "effort_sum yaw", "effort_sum:odd",
        lambda at, c, angle: c * at.pull * np.tanh(1.5 * np.sin(at.yaw - angle)),
        c=(0.5, 0.9), angle=(0.0, 6.28),
    ),
    # rails sunk into the floor: wheels that run along them are held, and what turns the robot is lost
    "sunk_rails": form(
        "yaw", "effort_diff yaw", "effort_diff:odd",
        lambda at, c, width, angle: -c * at.turn * np.exp(-((np.sin(at.yaw - angle) / width) ** 2)),
        c=(0.9, 0.98), width=(0.6, 1.2), angle=(0.0, 3.14),
    ),
    # a load bed that is open ahead catches the wind that blows into it; from behind most of it slips off
    "open_scoop": form(
        "longitudinal", "yaw", "",
        lambda at, c, angle: (
            -c * np.cos(at.yaw - angle) ** 2 * np.where(np.cos(at.yaw - angle) > 0, 1.0, -0.3)
        ),
        c=(0.3, 0.6), angle=(0.0, 6.28),
    ),
    # the ramp of a car park, which winds about its middle
    "helical_ramp": form(
        "longitudinal", "x y yaw", "", helix_slope,
        x=(0.35, 0.65), y=(0.35, 0.65), radius=(0.15, 0.35), height=(0.3, 0.6),
    ),
    # a floating bridge, along which waves run
    "floating_bridge": form(
        "longitudinal", "x yaw t", "",
        lambda at, size, length, period, phase: (
            size * np.sin(2 * np.pi * (at.x / length - at.t / period) + phase) * np.cos(at.yaw)
        ),
        size=(0.25, 0.5), length=(4.0, 12.0), period=(7.0, 18.0), phase=(0.0, 6.28),
    ),
    # an arm on the robot, which does the same work over and over
    "working_arm": form(
        "yaw", "t", "", arm_reaction, size=(0.25, 0.5), period=(6.0, 15.0), phase=(0.0, 6.28),
    ),
}  # fmt: skip
