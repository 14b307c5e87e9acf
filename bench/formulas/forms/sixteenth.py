"""Forms of the sixteenth report, which is looked at."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64

CREEP_MPS = 0.1
"""Within this speed, what opposes motion changes sides."""
CREEP_RADPS = 0.12


def cold_grease(at: At, c: float, warm_s: float, left_over: float) -> F64:
    """Shear-thinning grease, |v|^0.4, that churning warms."""
    cold = left_over + (1.0 - left_over) * np.exp(-at.t / warm_s)
    return -c * cold * at.v / (at.v**2 + CREEP_MPS**2) ** 0.3


def shimmy(at: At, c: float, peak: float, width: float) -> F64:
    """A loss round one speed, either way."""
    return -c * np.tanh(at.v / CREEP_MPS) * np.exp(-(((np.abs(at.v) - peak) / width) ** 2))


def wind(at: At, c: float, source: float, depth: float, period_s: float, phase: float) -> F64:
    """The push along the heading of a wind much faster than the robot, with gusts."""
    return -c * np.cos(at.yaw - source) * (1.0 + depth * np.sin(2 * np.pi * at.t / period_s + phase))


def dip(at: At, c: float, x: float, y: float, radius: float) -> F64:
    """Downhill to the middle of a bell-shaped hollow, steepest (c) at ``radius``."""
    ahead = ((at.x - x) * np.cos(at.yaw) + (at.y - y) * np.sin(at.yaw)) / radius
    far = ((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2
    return -c * ahead * np.exp(0.5 - 0.5 * far)


def arm(at: At, c: float, period_s: float, share: float, phase: float) -> F64:
    """Reaction to an arm swung over and, half a period later, back: to speed it up, then to stop it."""
    u = np.mod(at.t / period_s + phase, 1.0)
    over, back = np.clip(u / share, 0.0, 1.0), np.clip((u - 0.5) / share, 0.0, 1.0)
    return c * (np.sin(2 * np.pi * back) - np.sin(2 * np.pi * over))


def skid(at: At, c: float, arm_m: float) -> F64:
    """Dry friction of a skid at the tail: what of it points sideways, as its foot slides."""
    side = arm_m * at.yaw_rate
    return -c * side / np.sqrt(at.v**2 + side**2 + 0.05**2)


def mat(at: At, c: float, x: float, y: float, radius: float) -> F64:
    """Pivoting tyres grabbed on a round mat with a firm edge."""
    far = ((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2
    return -c * np.tanh(at.yaw_rate / CREEP_RADPS) / (1.0 + far**3)


SIXTEENTH = {
    # stiff grease in the bearings after a cold night, shear-thinning with speed and thinner as it warms
    "stiff_grease": form(
        "longitudinal",
        "v t",
        "v:odd",
        cold_grease,
        c=(0.4, 0.65),
        warm_s=(20.0, 50.0),
        left_over=(0.15, 0.35),
    ),
    # the castor flutters round one speed of travel and eats power there, slower and faster it runs quietly
    "wheel_shimmy": form(
        "longitudinal", "v", "v:odd", shimmy, c=(0.3, 0.55), peak=(0.35, 0.7), width=(0.15, 0.3)
    ),
    # a tall body in a strong wind from one side of the yard, pushed along its heading, in gusts
    "side_gusts": form(
        "longitudinal",
        "yaw t",
        "",
        wind,
        c=(0.2, 0.4),
        source=(0.0, 6.28),
        depth=(0.3, 0.7),
        period_s=(8.0, 20.0),
        phase=(0.0, 6.28),
    ),
    # the floor sinks towards a drain: downhill on the way in, uphill on the way out
    "floor_dip": form(
        "longitudinal",
        "x y yaw",
        "",
        dip,
        c=(0.3, 0.55),
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.2, 0.4),
    ),
    # worm gears whose tooth pressure, driving or braking alike, is paid for in rubbing against the motion
    "worm_gear": form(
        "longitudinal",
        "v effort_sum",
        "v:odd effort_sum:even",
        lambda at, c: -c * np.abs(at.pull) * np.tanh(at.v / CREEP_MPS),
        c=(0.5, 0.8),
    ),
    # wheels that pull apart wring the frame until the brake discs touch their pads
    "brake_rub": form(
        "longitudinal",
        "v effort_diff",
        "v:odd effort_diff:even",
        lambda at, c, half: -c * np.tanh(at.v / CREEP_MPS) * np.abs(at.turn) / (np.abs(at.turn) + half),
        c=(0.3, 0.6),
        half=(0.05, 0.15),
    ),
    # furrows in a field that guide rolling wheels along the rows, either way, and resist being left
    "crop_rows": form(
        "yaw",
        "v yaw",
        "v:even",
        lambda at, c, row: -c * np.sin(2 * (at.yaw - row)) * np.tanh(np.abs(at.v) / 0.25),
        c=(0.2, 0.4),
        row=(0.0, 3.14),
    ),
    # an arm on top that picks and places by the clock; the body takes the reaction of each swing
    "picking_arm": form(
        "yaw",
        "t",
        "",
        arm,
        c=(0.2, 0.4),
        period_s=(2.5, 5.0),
        share=(0.3, 0.45),
        phase=(0.0, 1.0),
    ),
    # one bald tyre slips the more the harder both pull (or brake), so the robot veers to its side
    "worn_tyre": form(
        "yaw",
        "effort_sum",
        "effort_sum:odd",
        lambda at, c, half: c * at.pull * np.abs(at.pull) / (np.abs(at.pull) + half),
        c=(0.7, 1.1),
        half=(0.12, 0.3),
    ),
    # a skid at the tail: hard to swing aside at a crawl, easily while it slides along at speed
    "tail_skid": form("yaw", "v yaw_rate", "v:even yaw_rate:odd", skid, c=(0.4, 0.75), arm_m=(0.35, 0.7)),
    # a rubber mat before a machine that grabs the tyres as they pivot
    "rubber_mat": form(
        "yaw",
        "x y yaw_rate",
        "yaw_rate:odd",
        mat,
        c=(0.3, 0.55),
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.2, 0.4),
    ),
}
