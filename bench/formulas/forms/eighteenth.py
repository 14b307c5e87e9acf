"""Forms of an eighteenth report, looked at since."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64


def chain_slap(at: At, size: float, slap: float, width: float) -> F64:
    """Drag in a band of speeds ahead, about ``slap`` m/s."""
    return -size * np.exp(-(((at.v - slap) / width) ** 2))


def rubbing_crate(at: At, size: float, play: float) -> F64:
    """Drag while the sideways acceleration to the left is above ``play`` m/s²."""
    return -0.5 * size * np.tanh(at.v / 0.15) * (1 + np.tanh((at.v * at.yaw_rate - play) / 0.06))


def water_cannon(at: At, size: float, reach: float, period: float, phase: float) -> F64:
    """Recoil along the robot of a jet that sweeps ``reach`` rad to either side."""
    return -size * np.cos(reach * np.sin(2 * np.pi * at.t / period + phase))


def clay_clods(at: At, size: float, period: float, phase: float) -> F64:
    """Rolling drag that grows steadily for most of each period, then falls off."""
    share = np.mod(at.t / period + phase / (2 * np.pi), 1.0)
    falling = 0.5 * (1 + np.cos(np.pi * (share - 0.85) / 0.15))
    return -size * np.tanh(at.v / 0.15) * np.where(share < 0.85, share / 0.85, falling)


def taut_track(at: At, size: float, tight: float) -> F64:
    """Rolling drag that grows with the differential torque of either sign and levels off."""
    pulled = (at.turn / tight) ** 2
    return -size * np.tanh(at.v / 0.15) * pulled / (1 + pulled)


def low_sun(at: At, size: float, azimuth: float) -> F64:
    """Push and brake lost where the panel looks away from ``azimuth``."""
    shade = 0.5 * (1 - np.tanh(2 * np.cos(at.yaw - azimuth)))
    return -size * shade * np.tanh(at.pull / 0.4)


def tyre_squeal(at: At, size: float, squeal: float, width: float) -> F64:
    """Resistance to turning in a band of yaw rates about ``squeal`` rad/s to either side."""
    left = np.exp(-(((at.yaw_rate - squeal) / width) ** 2))
    right = np.exp(-(((at.yaw_rate + squeal) / width) ** 2))
    return -size * (left - right)


def towed_harrow(at: At, size: float, bite: float) -> F64:
    """Resistance to turning that sets in above a speed ahead of ``bite`` m/s."""
    return -0.5 * size * np.tanh(at.yaw_rate / 0.15) * (1 + np.tanh((at.v - bite) / 0.15))


def toe_steer(at: At, size: float, soft: float) -> F64:
    """A veer with the common torque, as the robot rolls: a bush gives way by ``soft`` m/s²."""
    return size * np.tanh(at.v / 0.5) * np.tanh(at.pull / soft)


def steel_plate(at: At, size: float, x: float, y: float, radius: float) -> F64:
    """Turning torque no longer spent on scrub in a round place, its edge some decimetres wide."""
    inside = 0.5 * (1 - np.tanh((np.hypot(at.x - x, at.y - y) - radius) / 0.2))
    return size * inside * np.tanh(at.turn / 0.22)


def clipped_shunt(at: At, size: float, clip: float) -> F64:
    """Turning torque in excess where more than ``clip`` m/s² to the left is asked for."""
    return 0.5 * size * (1 + np.tanh((at.turn - clip) / 0.1))


EIGHTEENTH = {
    # A slack drive chain flutters at one speed and beats on its guard; only its lower run is free, so only
    # ahead.
    "chain_slap": form(
        "longitudinal", "v", "", chain_slap, size=(0.2, 0.45), slap=(0.3, 0.65), width=(0.16, 0.28)
    ),
    # A tall crate on a soft mount leans out of each bend; on its right side it then rubs on the wheel.
    "rubbing_crate": form(
        "longitudinal", "v yaw_rate", "", rubbing_crate, size=(0.18, 0.45), play=(0.02, 0.1)
    ),
    # A fire or irrigation robot: the nozzle sweeps from side to side, its recoil pushes backwards while
    # the jet points ahead and forwards while it points behind.
    "water_cannon": form(
        "longitudinal",
        "t",
        "",
        water_cannon,
        size=(0.14, 0.35),
        reach=(1.4, 2.8),
        period=(15.0, 35.0),
        phase=(0.0, 6.28),
    ),
    # Wet clay builds up between wheels and mudguards until the clods break away, then starts anew.
    "clay_clods": form(
        "longitudinal", "t v", "v:odd", clay_clods, size=(0.2, 0.45), period=(18.0, 40.0), phase=(0.0, 6.28)
    ),
    # A crawler: unlike torques pull the slack of one track tight, whose rollers then run hard.
    "taut_track": form(
        "longitudinal",
        "v effort_diff",
        "v:odd effort_diff:even",
        taut_track,
        size=(0.25, 0.5),
        tight=(0.12, 0.28),
    ),
    # A rover that lives on its panel, which faces one way: the supply droops where the sun is behind it.
    "low_sun": form(
        "longitudinal",
        "yaw effort_sum",
        "effort_sum:odd",
        low_sun,
        size=(0.2, 0.4),
        azimuth=(0.0, 6.28),
    ),
    # Solid tyres of a floor scrubber stick and slip with a squeal, at some yaw rates and not beyond them.
    "tyre_squeal": form(
        "yaw", "yaw_rate", "yaw_rate:odd", tyre_squeal, size=(0.15, 0.4), squeal=(0.3, 0.7), width=(0.16, 0.3)
    ),
    # A harrow on a short bar: its tines bite when drawn ahead and hold the tail; backwards they ride up.
    "towed_harrow": form(
        "yaw", "v yaw_rate", "yaw_rate:odd", towed_harrow, size=(0.25, 0.5), bite=(0.15, 0.5)
    ),
    # A worn rubber bush lets one wheel toe out under push and in under braking: the robot steers itself.
    "toe_steer": form(
        "yaw", "v effort_sum", "v:odd effort_sum:odd", toe_steer, size=(0.2, 0.45), soft=(0.15, 0.35)
    ),
    # A smooth steel plate in a rough floor: the scrub that holds against the turning torque is missing there.
    "steel_plate": form(
        "yaw",
        "x y effort_diff",
        "effort_diff:odd",
        steel_plate,
        size=(0.22, 0.42),
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.25, 0.4),
    ),
    # The current sensor of the steering amplifier clips on one side, so its loop overshoots the torque there.
    "clipped_shunt": form("yaw", "effort_diff", "", clipped_shunt, size=(0.18, 0.4), clip=(0.05, 0.2)),
}
