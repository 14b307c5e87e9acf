"""Forms of the sixth report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def ramp_slope(at: At, x: float, y: float, radius: float, height: float, angle: float) -> F64:
    """Gravity along the heading on a straight ramp through a place, between two level floors."""
    across = (at.x - x) * np.cos(angle) + (at.y - y) * np.sin(angle)
    return -height / np.cosh(across / radius) ** 2 * np.cos(at.yaw - angle)


def drain_swing(at: At, x: float, y: float, radius: float, height: float) -> F64:
    """What turns a robot with its weight behind the axle on a floor that falls towards a drain, all round."""
    dx, dy = at.x - x, at.y - y
    return height * (dy * np.cos(at.yaw) - dx * np.sin(at.yaw)) / np.sqrt(dx**2 + dy**2 + radius**2)


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
