"""Forms of the seventh report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def bungee_pull(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """Pull along the heading of a rubber rope from a post, slack up to the radius; ``height`` at twice it."""
    dx, dy = at.x - x, at.y - y
    r = np.sqrt(dx**2 + dy**2) + 1e-9
    stretch = np.maximum(r / radius - 1, 0.0)
    return -height * stretch * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / r


def lawn_drag(at: At, x: float, y: float, radius: float, c: float, v0: float, angle: float) -> F64:
    """Resistance of the grass on one side of a slanting line through a place, ever less towards the line."""
    beyond = ((at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)) / radius
    return -c * at.v / np.sqrt(v0**2 + at.v**2) / (1 + np.exp(-3 * beyond))


SEVENTH = {
    # a drive at idle pushes ahead by itself, as a torque converter does, up to the speed that it idles at
    "idle_creep": form(
        "longitudinal", "v", "v:even", lambda at, c, v0: c * np.maximum(1 - (at.v / v0) ** 2, 0.0),
        c=(0.25, 0.5), v0=(0.8, 1.4),
    ),
    # a film on the brushes, which a small current does not break through: little torques are lost
    "brush_film": form(
        "longitudinal", "effort_sum", "effort_sum:odd",
        lambda at, c, a0: -c * at.pull * np.exp(-np.abs(at.pull) / a0), c=(0.7, 0.95), a0=(0.3, 0.8),
    ),
    # a driver that throttles ever more as it warms up, lets go at once as it is cool, and begins anew
    "thermal_throttle": form(
        "longitudinal", "effort_sum t", "effort_sum:odd",
        lambda at, c, period, phase: -c * at.pull * np.mod(at.t / period + phase, 1.0),
        c=(0.6, 0.9), period=(20.0, 45.0), phase=(0.0, 1.0),
    ),
    # a leaking tank on soft tyres, which roll the easier, the less water weighs on them: Torricelli's law
    "draining_tank": form(
        "longitudinal", "v t", "v:odd",
        lambda at, c, time: -c * at.v * np.maximum(1 - at.t / time, 0.0) ** 2,
        c=(0.5, 0.8), time=(50.0, 110.0),
    ),
    # a rubber rope ties the robot to a post
    "bungee": form(
        "longitudinal", "x y yaw", "", bungee_pull,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.15, 0.3), height=(0.2, 0.4),
    ),
    # a hard floor on one side, a lawn on the other
    "lawn_edge": form(
        "longitudinal", "v x y", "v:odd", lawn_drag,
        x=(0.35, 0.65), y=(0.35, 0.65), radius=(0.08, 0.2), c=(0.5, 0.9), v0=(0.8, 1.6), angle=(0.45, 1.1),
    ),
    # paddles that stand in water, which they must stir to turn
    "stirred_water": form(
        "yaw", "yaw_rate", "yaw_rate:odd", lambda at, c: -c * at.yaw_rate * np.abs(at.yaw_rate),
        c=(0.8, 1.8),
    ),
    # a rotor that runs down in the air hands its spin on to the robot
    "rotor_running_down": form(
        "yaw", "t", "", lambda at, c, time: c / (1 + at.t / time) ** 2, c=(0.25, 0.5), time=(15.0, 50.0),
    ),
    # a tyre's patch of contact twists on the spot, and ever less, the wider the bend that it rolls along
    "turn_slip": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd",
        lambda at, c, radius: -c * at.yaw_rate / np.sqrt(0.01 + at.yaw_rate**2 + (at.v / radius) ** 2),
        c=(0.4, 0.8), radius=(0.4, 1.0),
    ),
    # the windings of the two motors differ: the quicker they run, the less one of them pulls and brakes
    "unlike_windings": form(
        "yaw", "effort_sum v", "effort_sum:odd v:even",
        lambda at, c, v0: c * at.pull * at.v**2 / (v0**2 + at.v**2), c=(0.7, 1.1), v0=(0.6, 1.2),
    ),
    # a wind blows between the pillars of a row, and turns the robot into it in each gap
    "colonnade": form(
        "yaw", "x yaw", "",
        lambda at, size, length, phase: (
            size * np.exp(1.5 * (np.cos(2 * np.pi * at.x / length + phase) - 1)) * np.cos(at.yaw)
        ),
        size=(0.25, 0.5), length=(2.5, 7.0), phase=(0.0, 6.28),
    ),
}  # fmt: skip
