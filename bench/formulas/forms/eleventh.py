"""Forms of the eleventh report."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def across(at: At, x: float, y: float, angle: float) -> F64:
    """Distance in m beyond a straight line through a place, towards ``angle``."""
    return (at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)


def carpet(at: At, x: float, y: float, radius: float, angle: float, quarter: float, c: float) -> F64:
    """Rolling resistance on one side of a line; ``radius`` in m is half the width of the fringe."""
    beyond = across(at, x, y, aslant(angle, quarter))
    return -c * np.tanh(at.v / 0.1) * 0.5 * (1 + np.tanh(beyond / radius))


def two_banks(at: At, x: float, y: float, radius: float, angle: float, quarter: float, size: float) -> F64:
    """Gravity along the heading in a valley; ``size`` in m/s² is the grade of both banks."""
    up = aslant(angle, quarter)
    return -size * np.tanh(across(at, x, y, up) / radius) * np.cos(at.yaw - up)


LINE = {"x": (0.35, 0.65), "y": (0.35, 0.65), "angle": (0.2, 1.37), "quarter": (0.0, 4.0)}

ELEVENTH = {
    # the motors' back-EMF leaves less torque, the faster they run
    "back_emf_droop": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even",
        lambda at, v0: -at.pull * np.abs(at.v) / v0, v0=(1.8, 3.0),
    ),
    # stiff oil in a gearbox that starts cold: a viscous drag that dies out as it warms up
    "cold_gear_oil": form(
        "longitudinal", "v t", "v:odd",
        lambda at, c, tau: -c * at.v * np.exp(-at.t / tau), c=(0.4, 0.8), tau=(20.0, 50.0),
    ),
    # friction in the gear mesh in proportion to the torque that it passes on, driving or braking
    "gear_mesh_loss": form(
        "longitudinal", "effort_sum v", "effort_sum:even v:odd",
        lambda at, c: -c * np.abs(at.pull) * np.tanh(at.v / 0.1), c=(0.3, 0.6),
    ),
    # a hall that is half carpet, half hard floor
    "carpet_edge": form(
        "longitudinal", "x y v", "v:odd", carpet, **LINE, radius=(0.02, 0.05), c=(0.2, 0.45),
    ),
    # a meadow that falls from both sides to a shallow ditch
    "swale": form(
        "longitudinal", "x y yaw", "", two_banks, **LINE, radius=(0.1, 0.25), size=(0.2, 0.45),
    ),
    # tyres and casters that scrub in bends brake the robot
    "bend_scrub": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even",
        lambda at, c: -c * np.abs(at.yaw_rate) * np.tanh(at.v / 0.15), c=(0.4, 0.9),
    ),
    # resistance to turning that grows with the square of the yaw rate, as of a wide brush deck
    "quadratic_turn_drag": form(
        "yaw", "yaw_rate", "yaw_rate:odd",
        lambda at, c: -c * at.yaw_rate * np.abs(at.yaw_rate), c=(0.8, 1.6),
    ),
    # tyres that push straight on in bends, with the lateral acceleration
    "understeer": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd",
        lambda at, c: -c * at.yaw_rate * np.abs(at.v), c=(0.6, 1.3),
    ),
    # on a side slope the heavy nose swings downhill
    "nose_downhill": form(
        "yaw", "yaw", "",
        lambda at, size, downhill: size * np.sin(downhill - at.yaw), size=(0.12, 0.35), downhill=(0.0, 6.28),
    ),
    # water that sloshes from side to side in a tank swings the nose
    "sloshing_tank": form(
        "yaw", "t", "",
        lambda at, size, period, phase: size * np.sin(2 * np.pi * at.t / period + phase),
        size=(0.12, 0.35), period=(3.0, 9.0), phase=(0.0, 6.28),
    ),
    # a spray boom folds out at some time: more yaw inertia from then on
    "boom_folds_out": form(
        "yaw", "effort_diff t", "effort_diff:odd",
        lambda at, loss, begun, lasts: -loss * at.turn * 0.5 * (1 + np.tanh((at.t - begun) / lasts)),
        loss=(0.5, 0.75), begun=(25.0, 55.0), lasts=(1.5, 5.0),
    ),
}  # fmt: skip
