"""Forms of the seventeenth report, which is looked at."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def way(v: F64) -> F64:
    """Which way it rolls, smooth through standstill."""
    return np.tanh(v / 0.1)


def washboard(at: At, size: float, peak: float, width: float) -> F64:
    """A drag with a resonance at one speed."""
    return -size * way(at.v) / (1 + ((np.abs(at.v) - peak) / width) ** 2)


def base_speed(at: At, base: float) -> F64:
    """The share of the pull that is missing above the base speed, where power is what is limited."""
    return at.pull * (base / np.maximum(np.abs(at.v), base) - 1)


def lean(at: At, size: float, side: float) -> F64:
    """A drag that comes with the sideways acceleration and levels off."""
    leaning = (at.v * at.yaw_rate / side) ** 2
    return -size * way(at.v) * leaning / (1 + leaning)


def compressor(at: At, size: float, period: float, phase: float) -> F64:
    """A drag that is clutched in for half of each period."""
    clutch = 0.5 + 0.5 * np.tanh(4 * np.sin(2 * np.pi * at.t / period + phase))
    return -size * way(at.v) * clutch


def roundabout(at: At, x: float, y: float, radius: float, rim: float) -> F64:
    """Away from a centre in proportion to the distance, as far as it lies along the heading."""
    return rim * ((at.x - x) * np.cos(at.yaw) + (at.y - y) * np.sin(at.yaw)) / radius


def nap(at: At, size: float, lie: float) -> F64:
    """A drag that is full against the lie of a pile, half across it and none along it."""
    return -0.5 * size * way(at.v) * (1 - way(at.v) * np.cos(at.yaw - lie))


def limited_slip(at: At, share: float) -> F64:
    """A friction against turning that the driving torque, of either sign, presses together."""
    return -share * np.abs(at.pull) * np.tanh(at.yaw_rate / 0.15)


def grooves(at: At, size: float, along: float, pace: float) -> F64:
    """Into line with grooves, either way along them, while the wheels roll."""
    return -size * np.sin(2 * (at.yaw - along)) * at.v**2 / (at.v**2 + pace**2)


def whirl(at: At, x: float, y: float, radius: float, size: float, spin: float) -> F64:
    """Dragged along, near a centre, by a floor that spins."""
    near = np.exp(-((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2)
    return size * near * np.tanh((spin - at.yaw_rate) / 0.3)


def swash(at: At, size: float, period: float, phase: float, shore: float) -> F64:
    """A flow to and fro in one direction of the world that pushes the nose round."""
    return size * np.sin(2 * np.pi * at.t / period + phase) * np.sin(shore - at.yaw)


def current_limit(at: At, share: float, knee: float) -> F64:
    """Turning effort that is missing while the pull has taken the current."""
    return -share * at.turn * at.pull**2 / (at.pull**2 + knee**2)


SEVENTEENTH = {
    # A corrugated track shakes the suspension at its resonance at one speed: slower or faster is easier.
    "corrugations": form(
        "longitudinal", "v", "v:odd", washboard, size=(0.25, 0.45), peak=(0.3, 0.6), width=(0.1, 0.2)
    ),
    # Motors in field weakening: above their base speed the power is constant, the torque falls as 1 / speed.
    "constant_power": form(
        "longitudinal", "v effort_sum", "v:even effort_sum:odd", base_speed, base=(0.3, 0.5)
    ),
    # A tall load leans outwards in bends; the outer tyre is squashed and rolls hard, to its bump stop.
    "lean": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even", lean, size=(0.25, 0.45), side=(0.06, 0.15)
    ),
    # An air compressor on the axle, which a pressure switch clutches in and out.
    "compressor": form(
        "longitudinal", "v t", "v:odd", compressor, size=(0.2, 0.4), period=(16.0, 30.0), phase=(0.0, 6.28)
    ),
    # The whole floor is a roundabout that turns evenly: the centrifugal force, from its pivot outwards.
    "roundabout": form(
        "longitudinal",
        "x y yaw",
        "",
        roundabout,
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.25, 0.4),
        rim=(0.12, 0.25),
    ),
    # Carpet pile or combed turf: rolling against its lie, ahead or backing, is hard, with it is free.
    "nap": form("longitudinal", "v yaw", "", nap, size=(0.2, 0.4), lie=(0.0, 6.28)),
    # A limited-slip differential between the wheels: its plates are pressed together by the torque.
    "limited_slip": form(
        "yaw", "yaw_rate effort_sum", "yaw_rate:odd effort_sum:even", limited_slip, share=(0.25, 0.45)
    ),
    # Boards with grooves (or old furrows), which guide the rolling wheels into line from either side.
    "grooves": form("yaw", "v yaw", "v:even", grooves, size=(0.15, 0.35), along=(0.0, 3.14), pace=(0.1, 0.3)),
    # A turntable under a loose mat (or an eddy of water): near it, the robot is carried round with it.
    "whirl": form(
        "yaw",
        "x y yaw_rate",
        "",
        whirl,
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.25, 0.4),
        size=(0.2, 0.4),
        spin=(0.3, 0.8),
    ),
    # On a beach, waves run up and back: they strike the nose and turn it, most when it stands broadside.
    "swash": form(
        "yaw", "t yaw", "", swash, size=(0.15, 0.35), period=(6.0, 14.0), phase=(0.0, 6.28), shore=(0.0, 6.28)
    ),
    # Both motors on one current limit that serves driving first: steering starves while it pulls or brakes.
    "starved_steering": form(
        "yaw",
        "effort_sum effort_diff",
        "effort_sum:even effort_diff:odd",
        current_limit,
        share=(0.8, 0.98),
        knee=(0.1, 0.25),
    ),
}
