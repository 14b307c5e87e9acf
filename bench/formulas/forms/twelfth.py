"""Forms of the twelfth report."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def gearbox(at: At, c: float) -> F64:
    """What a gear loses of its load, against the motion, whether it drives or is driven."""
    return -c * np.abs(at.pull) * np.tanh(at.v / 0.05)


def weakened(at: At, v0: float) -> F64:
    """Full torque up to the base speed, constant power above."""
    return at.pull * (v0 / np.maximum(np.abs(at.v), v0) - 1)


def wind(at: At, c: float, speed: float, angle: float) -> F64:
    """Drag of the air, which itself moves steadily over the ground."""
    air = at.v + speed * np.cos(at.yaw - angle)
    return -c * np.abs(air) * air


def grass(at: At, c: float, x: float, y: float, radius: float) -> F64:
    """Drag in proportion to the speed, dying out away from a place."""
    return -c * at.v * np.exp(-((at.x - x) ** 2 + (at.y - y) ** 2) / (2 * radius**2))


def ridged(at: At, size: float, length: float, phase: float, angle: float, quarter: float) -> F64:
    """Gravity along the heading on ground that waves in one direction."""
    across = aslant(angle, quarter)
    along = at.x * np.cos(across) + at.y * np.sin(across)
    return size * np.sin(2 * np.pi * along / length + phase) * np.cos(at.yaw - across)


def rattle(at: At, c: float, v0: float, width: float) -> F64:
    """Resistance about one speed, ahead and back."""
    return -c * np.tanh(at.v / 0.05) * np.exp(-((np.abs(at.v) - v0) ** 2) / (2 * width**2))


TWELFTH = {
    # a worm gear loses a share of the torque that it passes on, always against the motion
    "gearbox_load_loss": form(
        "longitudinal", "effort_sum v", "effort_sum:even v:odd", gearbox, c=(0.25, 0.6),
    ),
    # above their base speed the motors have the supply's power only, so that torque falls as 1/speed
    "base_speed": form(
        "longitudinal", "effort_sum v", "effort_sum:odd v:even", weakened, v0=(0.15, 0.35),
    ),
    # cold grease in gears and bearings drags, and less as it gets warm
    "cold_grease": form(
        "longitudinal", "v t", "v:odd", lambda at, c, tau: -c * at.v * np.exp(-at.t / tau),
        c=(0.4, 0.9), tau=(20.0, 45.0),
    ),
    # a steady wind over a yard: drag goes by the speed against the air
    "yard_wind": form(
        "longitudinal", "v yaw", "v:mixed", wind, c=(0.03, 0.07), speed=(1.5, 3.0), angle=(0.0, 6.28),
    ),
    # a stand of tall grass, which brakes the more the faster the robot goes through it
    "tall_grass": form(
        "longitudinal", "v x y", "v:odd", grass,
        c=(0.5, 1.2), x=(0.25, 0.75), y=(0.25, 0.75), radius=(0.15, 0.35),
    ),
    # ridges of a tilled field that run aslant
    "tilled_ridges": form(
        "longitudinal", "x y yaw", "", ridged,
        size=(0.2, 0.45), length=(2.0, 6.0), phase=(0.0, 6.28), angle=(0.3, 1.27), quarter=(0.0, 4.0),
    ),
    # at one speed the joints of the tiles shake the chassis, which takes power
    "tile_resonance": form(
        "longitudinal", "v", "v:odd", rattle, c=(0.2, 0.45), v0=(0.4, 0.8), width=(0.1, 0.25),
    ),
    # wide tyres scrub most where the robot turns on the spot, and less where it rolls
    "pivot_scrub": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd",
        lambda at, c, w0, v0: -c * np.tanh(at.w / w0) / (1 + np.abs(at.v) / v0),
        c=(0.3, 0.7), w0=(0.02, 0.06), v0=(0.4, 1.0),
    ),
    # on a side slope the heavy end swings downhill
    "side_slope": form(
        "yaw", "yaw", "", lambda at, size, angle: size * np.sin(at.yaw - angle),
        size=(0.1, 0.3), angle=(0.0, 6.28),
    ),
    # a bad bearing at one wheel: the robot veers, the more the faster it goes
    "bad_bearing": form(
        "yaw", "v", "v:odd", lambda at, c, side: c * np.sign(side) * at.v, c=(0.15, 0.4), side=(-1.0, 1.0),
    ),
    # both drives share a limited current: what pushing ahead takes is missing for turning
    "shared_current": form(
        "yaw", "effort_diff effort_sum", "effort_diff:odd effort_sum:even",
        lambda at, p0: -at.turn * np.abs(at.pull) / (np.abs(at.pull) + p0), p0=(0.05, 0.15),
    ),
}  # fmt: skip
