"""Forms of the thirteenth report."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def gusts(at: At, c: float, angle: float, quarter: float, period: float, phase: float) -> F64:
    """A wind from one direction that swells and dies down; ahead is the share along the robot."""
    strength = 0.3 + 0.7 * np.sin(np.pi * at.t / period + phase) ** 2
    return -c * strength * np.cos(at.yaw - aslant(angle, quarter))


def laid_hose(at: At, c: float, x: float, y: float, radius: float) -> F64:
    """Friction of a hose on the floor, as long as the way from the tap to the robot."""
    return -c * np.tanh(at.v / 0.04) * np.hypot(at.x - x, at.y - y) / radius


def ruts(at: At, c: float, x: float, y: float, radius: float, angle: float, quarter: float) -> F64:
    """A track through (x, y) that turns the robot to its own direction, either way round."""
    along = aslant(angle, quarter)
    off = (at.y - y) * np.cos(along) - (at.x - x) * np.sin(along)
    return -c * np.sin(2 * (at.yaw - along)) * np.exp(-((off / radius) ** 2))


THIRTEENTH = {
    # gears lose a share of the torque that they carry, whichever way it goes, against the motion
    "gear_loss_under_load": form(
        "longitudinal",
        "v effort_sum",
        "v:odd effort_sum:even",
        lambda at, c: -c * np.abs(at.pull) * np.tanh(at.v / 0.05),
        c=(0.5, 0.75),
    ),
    # motors run out of voltage: the faster they turn, the less of the asked torque they give
    "back_emf_fade": form(
        "longitudinal",
        "v effort_sum",
        "v:even effort_sum:odd",
        lambda at, c, v0: -c * at.pull * at.v**2 / (at.v**2 + v0**2),
        c=(0.65, 0.9),
        v0=(0.2, 0.45),
    ),
    # cold grease in gears and bearings drags, and less and less as it warms up
    "winter_grease": form(
        "longitudinal",
        "v t",
        "v:odd",
        lambda at, c, v0, warm: -c * np.tanh(at.v / v0) * np.exp(-at.t / warm),
        c=(0.45, 0.9),
        v0=(0.2, 0.5),
        warm=(12.0, 35.0),
    ),
    # a gusty wind on a tall body
    "gusty_wind": form(
        "longitudinal",
        "yaw t",
        "",
        gusts,
        c=(0.25, 0.6),
        angle=(0.3, 1.27),
        quarter=(0.0, 4.0),
        period=(12.0, 30.0),
        phase=(0.0, 3.14),
    ),
    # an electronic speed limiter brakes above its set speed, ahead and in reverse
    "speed_limiter": form(
        "longitudinal",
        "v",
        "v:odd",
        lambda at, rate, v0: -rate * np.sign(at.v) * np.maximum(np.abs(at.v) - v0, 0.0),
        rate=(0.6, 1.4),
        v0=(0.3, 0.55),
    ),
    # tyres and castors scrub in bends and hold the robot back
    "scrub_in_bends": form(
        "longitudinal",
        "v yaw_rate",
        "v:odd yaw_rate:even",
        lambda at, c, w0: -c * np.tanh(at.v / 0.05) * np.abs(at.w) / (np.abs(at.w) + w0),
        c=(0.4, 0.8),
        w0=(0.03, 0.1),
    ),
    # a water hose or mains cable dragged over the floor: the more of it is laid out, the more it holds back
    "laid_hose": form(
        "longitudinal",
        "v x y",
        "v:odd",
        laid_hose,
        c=(0.25, 0.5),
        x=(0.0, 1.0),
        y=(0.0, 1.0),
        radius=(0.5, 1.0),
    ),
    # wide tyres and castors resist turning on the spot, and hardly once they roll
    "turning_on_the_spot": form(
        "yaw",
        "v yaw_rate",
        "v:even yaw_rate:odd",
        lambda at, c, v0: -c * np.tanh(at.w / 0.03) / (1 + (at.v / v0) ** 2),
        c=(0.3, 0.6),
        v0=(0.5, 1.0),
    ),
    # the motor of one side gets hot and weak, so that pushing ahead turns the robot more and more
    "one_motor_hot": form(
        "yaw",
        "t effort_sum",
        "effort_sum:odd",
        lambda at, c, side, warm: c * np.sign(side) * at.pull * (1 - np.exp(-at.t / warm)),
        c=(0.6, 1.2),
        side=(-1.0, 1.0),
        warm=(10.0, 40.0),
    ),
    # a cable from above twists up as the robot turns, and turns it back
    "twisted_cable": form(
        "yaw",
        "yaw",
        "",
        lambda at, c, twist: -c * np.tanh(at.yaw / twist),
        c=(0.2, 0.45),
        twist=(0.6, 3.0),
    ),
    # wheel ruts across the yard steer the robot along them
    "wheel_ruts": form(
        "yaw",
        "x y yaw",
        "",
        ruts,
        c=(0.25, 0.6),
        x=(0.2, 0.8),
        y=(0.2, 0.8),
        radius=(0.15, 0.35),
        angle=(0.3, 1.27),
        quarter=(0.0, 4.0),
    ),
}
