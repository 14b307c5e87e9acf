"""The hidden forms: plain functions of the motion, written without the analysis's dictionary.

Each gives an acceleration in m/s² on one channel: dv_long/dt, or half_track_m · d(yaw_rate)/dt. Sizes are
drawn so that the form accelerates by about .1 to .5 m/s² where the robot drives.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64

Sizes = Mapping[str, float]
Rng = np.random.Generator


class At(NamedTuple):
    """The motion at which a form is taken, numbers or (n,): time, pose, speeds, half track · yaw rate, and
    the accelerations that the torques ask for, α·(right + left) and α_yaw·(right − left).
    """

    t: F64
    x: F64
    y: F64
    yaw: F64
    v: F64
    yaw_rate: F64
    w: F64
    pull: F64
    turn: F64


@dataclass(frozen=True)
class Form:
    """One hidden form; ``parity`` of the variables that have one, ``draws`` uniform ranges of the sizes."""

    channel: str
    variables: frozenset[str]
    parity: Mapping[str, str]
    draws: Mapping[str, tuple[float, float]]
    acceleration: Callable[[At, Sizes], F64]

    def drawn(self, rng: Rng) -> dict[str, float]:
        """Sizes for one log."""
        return {key: float(rng.uniform(*span)) for key, span in self.draws.items()}


def form(
    channel: str, variables: str, parity: str, function: Callable[..., F64], **draws: tuple[float, float]
) -> Form:
    """A form from text: ``variables`` by blanks, ``parity`` as ``v:odd yaw_rate:even``."""
    signs = dict(pair.split(":") for pair in parity.split())
    return Form(channel, frozenset(variables.split()), signs, draws, lambda at, p: function(at, **p))


def triangle(phase: F64) -> F64:
    """A triangle wave between −1 and 1, its corners rounded."""
    return np.arcsin(0.95 * np.sin(phase)) / np.arcsin(0.95)


def dome_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """Gravity along the heading on a bell-shaped dome; ``height`` in m/s² at the steepest place."""
    dx, dy = at.x - x, at.y - y
    bell = np.exp(0.5 - (dx**2 + dy**2) / (2 * radius**2))
    return height * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / radius * bell


def round_hill_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """The same on a hill of half a cosine wave, flat from its foot on."""
    dx, dy = at.x - x, at.y - y
    r = np.sqrt(dx**2 + dy**2) + 1e-9
    steep = np.where(r < radius, np.sin(np.pi * r / radius), 0.0)
    return height * steep * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / r


def ridge_slope(at: At, x: float, y: float, radius: float, height: float, angle: float) -> F64:
    """The same on a long straight ridge through a place, steepest across it."""
    across = (at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)
    return height * across / radius * np.exp(0.5 - across**2 / (2 * radius**2)) * np.cos(at.yaw - angle)


def bowl_slope(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """The same in a round bowl, flat at its middle and from its rim on; steepest between."""
    dx, dy = at.x - x, at.y - y
    out = np.minimum((dx**2 + dy**2) / radius**2, 1.0)
    steep = 0.5 * np.sqrt(27.0) * (1 - out)
    return -height * steep * (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / radius


def swell_slope(at: At, size: float, length: float, ratio: float, phase: float) -> F64:
    """The same on ground of two waves over y."""
    turn = 2 * np.pi * at.y / length
    return size * (np.sin(turn + phase) + 0.6 * np.sin(ratio * turn + 2 * phase)) * np.sin(at.yaw)


def headwind(at: At, c: float, wind: float, angle: float) -> F64:
    """Resistance of the air that comes from ``angle`` at the speed ``wind``, along the heading."""
    against = at.v + wind * np.cos(at.yaw - angle)
    return -c * against * np.abs(against)


def mud_drag(at: At, x: float, y: float, radius: float, c: float) -> F64:
    """Rolling resistance in a place, flat inside; half of it is left at the radius."""
    r2 = ((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2
    return -c * np.tanh(at.v / 0.1) / (1 + r2**2)


def ramp_slope(at: At, x: float, y: float, radius: float, height: float, angle: float) -> F64:
    """Gravity along the heading on a straight ramp through a place, between two level floors."""
    across = (at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)
    return -height / np.cosh(across / radius) ** 2 * np.cos(at.yaw - angle)


def drain_swing(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """What turns a robot with its weight behind the axle on a floor that falls towards a drain, all round."""
    dx, dy = at.x - x, at.y - y
    return height * (dy * np.cos(at.yaw) - dx * np.sin(at.yaw)) / np.sqrt(dx**2 + dy**2 + radius**2)


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


def aslant(angle: float, quarter: float) -> float:
    """A direction in any of the four quarters, clear of the axes where ``angle`` is clear of 0 and π/2."""
    return angle + 0.5 * np.pi * np.floor(quarter)


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


WAVE = {"size": (0.15, 0.4), "length": (3.0, 10.0), "phase": (0.0, 6.28)}
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
SECOND = {
    "knee_drag": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * np.sign(at.v) * np.maximum(np.abs(at.v) - v0, 0.0),
        c=(0.3, 0.8), v0=(0.3, 0.7),
    ),
    "field_weakening": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even",
        lambda at, v0: at.pull * (v0 / np.maximum(np.abs(at.v), v0) - 1), v0=(0.35, 0.8),
    ),
    "gain_cycle": form(
        "longitudinal", "effort_sum t", "effort_sum:odd",
        lambda at, size, period: -at.pull * size * np.sin(np.pi * at.t / period) ** 2,
        size=(0.3, 0.6), period=(80.0, 200.0),
    ),
    "push_unlike_brake": form(
        "longitudinal", "effort_sum", "effort_sum:mixed", lambda at, c: -c * np.maximum(at.pull, 0.0),
        c=(0.25, 0.6),
    ),
    "corner_drag": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even",
        lambda at, c, w0: -c * at.v * at.yaw_rate**2 / (w0**2 + at.yaw_rate**2),
        c=(0.4, 0.9), w0=(0.2, 0.5),
    ),
    "swell_y": form(
        "longitudinal", "y yaw", "", swell_slope,
        size=(0.12, 0.3), length=(4.0, 12.0), ratio=(1.5, 2.5), phase=(0.0, 6.28),
    ),
    "ridge": form(
        "longitudinal", "x y yaw", "", ridge_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.08, 0.25), height=(0.3, 0.6), angle=(0.0, 3.14),
    ),
    "speed_pull": form(
        "yaw", "v", "v:even", lambda at, c, v0: c * (np.exp(np.abs(at.v) / v0) - 1),
        c=(0.03, 0.1), v0=(0.8, 1.6),
    ),
    "lopsided_turning": form(
        "yaw", "yaw_rate", "yaw_rate:mixed", lambda at, c: -c * np.maximum(at.yaw_rate, 0.0) ** 1.5,
        c=(0.4, 1.0),
    ),
    "turn_stiffening": form(
        "yaw", "yaw_rate t", "yaw_rate:odd", lambda at, c, time: -c * at.w * at.t / (at.t + time),
        c=(1.5, 4.0), time=(30.0, 120.0),
    ),
    "turn_gain_by_speed": form(
        "yaw", "effort_diff v", "effort_diff:odd v:even",
        lambda at, v0: at.turn * (1 / np.sqrt(1 + (at.v / v0) ** 2) - 1), v0=(0.4, 1.2),
    ),
}  # fmt: skip
THIRD = {
    "stiction_tail": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * np.tanh(at.v / 0.02) * np.exp(-np.abs(at.v) / v0),
        c=(0.2, 0.5), v0=(0.3, 0.8),
    ),
    "fan_drag": form(
        "longitudinal", "v", "v:odd", lambda at, c: -c * np.sign(at.v) * np.abs(at.v) ** 1.5,
        c=(0.1, 0.3),
    ),
    "progressive_gain": form(
        "longitudinal", "effort_sum", "effort_sum:odd",
        lambda at, c, a0: -c * at.pull / (1 + (at.pull / a0) ** 2), c=(0.3, 0.6), a0=(0.3, 0.8),
    ),
    "weak_backwards": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:mixed",
        lambda at, c: -c * at.pull * (at.v < 0), c=(0.3, 0.6),
    ),
    "turning_drag": form(
        "longitudinal", "yaw_rate", "yaw_rate:even", lambda at, c: -c * np.abs(at.yaw_rate) ** 1.5,
        c=(0.3, 0.8),
    ),
    "ageing_drag": form(
        "longitudinal", "v t", "v:odd", lambda at, c, time: -c * at.v * at.t / (at.t + time),
        c=(0.4, 0.9), time=(30.0, 120.0),
    ),
    "washboard": form(
        "longitudinal", "x yaw", "",
        lambda at, size, length, phase: (
            size * np.sin(2 * np.pi * at.x / length + phase) ** 3 * np.cos(at.yaw)
        ),
        **WAVE,
    ),
    "bowl": form(
        "longitudinal", "x y yaw", "", bowl_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.25, 0.5), height=(0.3, 0.6),
    ),
    "cable_twist": form(
        "yaw", "yaw", "", lambda at, c, angle: c * np.sin(at.yaw - angle), c=(0.1, 0.3), angle=(0.0, 6.28),
    ),
    "turn_gain_cycle": form(
        "yaw", "effort_diff t", "effort_diff:odd",
        lambda at, size, period: -at.turn * size * np.sin(np.pi * at.t / period) ** 2,
        size=(0.3, 0.6), period=(80.0, 200.0),
    ),
    "turn_gain_saturating": form(
        "yaw", "effort_diff", "effort_diff:odd",
        lambda at, c, a0: -c * at.turn * np.abs(at.turn) / (a0 + np.abs(at.turn)),
        c=(0.4, 0.8), a0=(0.1, 0.4),
    ),
}  # fmt: skip
FOURTH = {
    # grease in the bearings shears as an activated flow does, its stress growing as an inverse sinh
    "grease_shear": form(
        "longitudinal", "v", "v:odd", lambda at, c, v0: -c * np.arcsinh(at.v / v0),
        c=(0.1, 0.25), v0=(0.08, 0.3),
    ),
    # the load shakes at one speed, which takes power there alone
    "resonant_drag": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0, width: -c * (
            np.exp(-(((at.v - v0) / width) ** 2)) - np.exp(-(((at.v + v0) / width) ** 2))
        ),
        c=(0.25, 0.6), v0=(0.4, 0.9), width=(0.15, 0.35),
    ),
    # the motors' iron saturates: torque grows slower than the current that is commanded as torque
    "iron_saturation": form(
        "longitudinal", "effort_sum", "effort_sum:odd",
        lambda at, a0: a0 * np.arctan(at.pull / a0) - at.pull, a0=(0.15, 0.5),
    ),
    # both motors hang on one battery, whose voltage sags with what turning draws
    "battery_sag": form(
        "longitudinal", "effort_sum effort_diff", "effort_sum:odd effort_diff:even",
        lambda at, c, a0: -c * at.pull * np.abs(at.turn) / (a0 + np.abs(at.turn)),
        c=(0.5, 0.9), a0=(0.05, 0.2),
    ),
    # strips of soft floor with soft edges, which cost rolling resistance by speed
    "striped_floor": form(
        "longitudinal", "v x", "v:odd",
        lambda at, c, length, phase: (
            -c * at.v / (1 + np.exp(-4 * np.sin(2 * np.pi * at.x / length + phase)))
        ),
        c=(0.4, 0.9), length=(3.0, 10.0), phase=(0.0, 6.28),
    ),
    # a wind from one side of the place that rises and dies away once
    "squall": form(
        "longitudinal", "yaw t", "",
        lambda at, c, angle, middle, time: (
            c * np.exp(-(((at.t - middle) / time) ** 2)) * np.cos(at.yaw - angle)
        ),
        c=(0.25, 0.5), angle=(0.0, 6.28), middle=(20.0, 70.0), time=(12.0, 30.0),
    ),
    # tyres that creep at first and let go of the ground as the robot turns faster
    "scrub_letting_go": form(
        "yaw", "yaw_rate", "yaw_rate:odd",
        lambda at, c, w0: -c * at.yaw_rate * np.exp(-np.abs(at.yaw_rate) / w0), c=(1.0, 2.5), w0=(0.2, 0.5),
    ),
    # a caster stuck askew steers as soon as it rolls, the other way in reverse
    "skewed_caster": form(
        "yaw", "v", "v:odd", lambda at, c, v0: c * at.v / (v0 + np.abs(at.v)), c=(0.1, 0.35), v0=(0.2, 0.8),
    ),
    # planks that tip to alternating sides; the weight behind the axle swings downhill
    "tilted_planks": form(
        "yaw", "y yaw", "",
        lambda at, size, length, phase: (
            size * np.tanh(2 * np.sin(2 * np.pi * at.y / length + phase)) * np.cos(at.yaw)
        ),
        **WAVE,
    ),
    # the belt of one side slips beyond a torque, so that pulling and braking turn the robot
    "slipping_belt": form(
        "yaw", "effort_sum", "effort_sum:odd",
        lambda at, c, a0: c * np.sign(at.pull) * np.maximum(np.abs(at.pull) - a0, 0.0),
        c=(0.3, 0.7), a0=(0.03, 0.15),
    ),
    # the motors' back voltage leaves less torque, the faster the robot turns
    "turn_gain_by_rate": form(
        "yaw", "effort_diff yaw_rate", "effort_diff:odd yaw_rate:even",
        lambda at, w0: at.turn * (1 / (1 + (at.yaw_rate / w0) ** 2) - 1), w0=(0.15, 0.5),
    ),
}  # fmt: skip
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
SIXTH = {
    # water that the wheels push ahead: a wave that builds up about one speed, and no more beyond it
    "bow_wave": form(
        "longitudinal", "v", "v:odd",
        lambda at, c, v0: -c * np.sign(at.v) * at.v**4 / (v0**4 + at.v**4), c=(0.25, 0.5), v0=(0.4, 0.9),
    ),
    # a load that hangs from the robot, and swings on by itself
    "swinging_load": form(
        "longitudinal", "t", "",
        lambda at, size, period, phase, time: (
            size * np.exp(-at.t / time) * np.sin(2 * np.pi * at.t / period + phase)
        ),
        size=(0.2, 0.45), period=(5.0, 14.0), phase=(0.0, 6.28), time=(40.0, 120.0),
    ),
    # a brake that the motors' current holds open: it drags wherever the motors do little
    "current_held_brake": form(
        "longitudinal", "effort_sum v", "effort_sum:even v:odd",
        lambda at, c, a0: -c * np.tanh(at.v / 0.1) / (1 + (at.pull / a0) ** 2),
        c=(0.25, 0.5), a0=(0.1, 0.3),
    ),
    # a battery whose voltage gives way by the power that is drawn, torque times speed
    "power_sag": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even",
        lambda at, c, p0: -c * at.pull * np.abs(at.pull * at.v) / (p0 + np.abs(at.pull * at.v)),
        c=(0.4, 0.7), p0=(0.05, 0.2),
    ),
    # as the robot turns it leans, the wheel inside lets go, and less of the torques gets to the ground
    "lifted_wheel": form(
        "longitudinal", "effort_sum yaw_rate", "effort_sum:odd yaw_rate:even",
        lambda at, c, w0: -c * at.pull * (1 - np.exp(-np.abs(at.yaw_rate) / w0)),
        c=(0.4, 0.7), w0=(0.1, 0.3),
    ),
    # a ramp between two floors
    "loading_ramp": form(
        "longitudinal", "x y yaw", "", ramp_slope,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.1, 0.3), height=(0.3, 0.6), angle=(0.0, 6.28),
    ),
    # one tyre loses its air ever more slowly: it drags on its side, whichever way it rolls
    "flat_on_one_side": form(
        "yaw", "v t", "v:odd",
        lambda at, c, v0, time: -c * np.tanh(at.v / v0) * (1 - np.exp(-at.t / time)),
        c=(0.2, 0.5), v0=(0.1, 0.4), time=(15.0, 50.0),
    ),
    # boards along which tyres turn easily, and across which they scrub
    "planed_boards": form(
        "yaw", "yaw_rate yaw", "yaw_rate:odd",
        lambda at, c, angle: -c * at.w * np.sin(at.yaw - angle) ** 2, c=(2.0, 4.0), angle=(0.0, 3.14),
    ),
    # a strut that twists before it turns anything: the first part of the torque is lost
    "twisting_strut": form(
        "yaw", "effort_diff", "effort_diff:odd", lambda at, a0: -a0 * np.tanh(at.turn / a0), a0=(0.1, 0.3),
    ),
    # the harder the motors pull or brake, the more weight rests on a skid that scrubs as the robot turns
    "loaded_skid": form(
        "yaw", "effort_sum yaw_rate", "effort_sum:even yaw_rate:odd",
        lambda at, c, a0: -c * np.tanh(at.yaw_rate / 0.1) * at.pull**2 / (a0**2 + at.pull**2),
        c=(0.5, 1.0), a0=(0.08, 0.2),
    ),
    # a floor that falls towards a drain turns the robot's weight downhill
    "drain": form(
        "yaw", "x y yaw", "", drain_swing,
        x=(0.3, 0.7), y=(0.3, 0.7), radius=(0.05, 0.2), height=(0.15, 0.4),
    ),
}  # fmt: skip
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
REPORT = {
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
FORMS = DEVELOP | EARLIER | SECOND | THIRD | FOURTH | FIFTH | SIXTH | SEVENTH | REPORT
ORDER = (*sorted(DEVELOP | EARLIER), *SECOND, *THIRD, *FOURTH, *FIFTH, *SIXTH, *SEVENTH, *REPORT)
"""Place of a form in the seeds' streams; new forms come last, so that logs of the others stay as they are."""
PLACED = (
    *("dome", "round_hill", "ridge", "bowl", "mud_patch", "loading_ramp", "drain", "bungee", "lawn_edge"),
    *("mopped_lane", "thick_rug", "crowned_road"),
)
"""Forms whose place and radius are drawn as shares of the area that is driven."""
