"""Forms of a nineteenth report, looked at since."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def counted_pulses(at: At, size: float, pulse: float) -> F64:
    """Speed counted in whole pulses: what is lost in rounding is a saw over the speed, its edges rounded."""
    angle = 2 * np.pi * at.v / pulse
    return -size * np.arctan2(0.6 * np.sin(angle), 1 + 0.6 * np.cos(angle)) / np.arcsin(0.6)


def moving_walkway(
    at: At, size: float, pace: float, slip: float, middle: float, half: float, way: float
) -> F64:
    """A moving walkway along x: on it the floor rubs the robot towards the belt's own speed."""
    on = 0.5 * (np.tanh((at.y - middle + half) / 0.35) - np.tanh((at.y - middle - half) / 0.35))
    belt = pace * np.cos(at.yaw + np.pi * np.floor(way))
    return size * on * np.tanh((belt - at.v) / slip)


def sliding_ballast(at: At, size: float, knee: float) -> F64:
    """A ballast on a sprung rail is flung ahead to its stop once the robot turns fast enough, either way."""
    share = (at.yaw_rate / knee) ** 4
    return size * share / (1 + share)


def skipping_pawls(at: At, size: float, lever: float, grip: float) -> F64:
    """The right hub's worn pawls skip where pushed ahead beyond their grip: there a fixed push is lost."""
    ahead = np.maximum(at.pull + lever * at.turn, 0.0) / grip
    return -size * ahead**3 / (1 + ahead**3)


def drum_spin_up(at: At, size: float, middle: float, width: float, hertz: float, phase: float) -> F64:
    """A drum aboard spins up: its rising shake is felt while it passes the springs' own beat."""
    since = at.t - middle
    turns = hertz * since + 0.5 * 0.004 * since**2
    return size * np.exp(-0.5 * (since / width) ** 2) * np.sin(2 * np.pi * turns + phase)


def fountain_gutter(at: At, size: float, east: float, north: float, radius: float, width: float) -> F64:
    """A round gutter about a fountain: downhill to its bottom from the inside and from the outside."""
    dx, dy = at.x - east, at.y - north
    away = np.hypot(dx, dy)
    off = (away - radius) / width
    outwards = (dx * np.cos(at.yaw) + dy * np.sin(at.yaw)) / np.sqrt(away**2 + 0.04)
    return -size * off * np.exp(0.5 - 0.5 * off**2) * outwards


def paving_grid(at: At, size: float, angle: float, slow: float) -> F64:
    """Joints of square paving take the wheels along: rolling either way, to the nearest of four headings."""
    return -size * np.sin(4 * (at.yaw - angle)) * at.v**2 / (at.v**2 + slow**2)


def half_blown_bridge(at: At, size: float, soft: float, power: float) -> F64:
    """One motor's bridge is half blown: weak when it drives, whole when it brakes, so that driving steers."""
    drive = (np.maximum(at.v * at.pull, 0.0) / power) ** 2
    return size * at.pull / np.sqrt(at.pull**2 + soft**2) * drive / (1 + drive)


def swivel_mops(at: At, size: float, rate: float) -> F64:
    """Two swivelling mops drag at a slow turn, and once swung about they throw the nose on in a quick one."""
    u = at.yaw_rate / rate
    return -2.8 * size * u * (1 - u**2) / (1 + u**4)


def passing_lorries(at: At, size: float, every: float, first: float, length: float, road: float) -> F64:
    """Lorries on a road: each pushes the nearer end off, then sucks it in, most where alongside."""
    since = np.mod(at.t - first + 0.5 * every, every) - 0.5 * every
    pulse = since / length * np.exp(0.5 - 0.5 * (since / length) ** 2)
    return -size * pulse * (0.3 + 0.7 * np.cos(at.yaw - road) ** 2)


def buried_magnet(
    at: At, size: float, east: float, north: float, reach: float, pole: float, quarter: float
) -> F64:
    """A heading held by compass over a buried magnet: it is pulled to the field lines of a dipole."""
    dx, dy = at.x - east, at.y - north
    far = dx**2 + dy**2
    strength = 4 * far * reach**2 / (far + reach**2) ** 2
    return size * strength * np.sin(2 * np.arctan2(dy, dx) - aslant(pole, quarter) - at.yaw)


NINETEENTH = {
    "counted_pulses": form("longitudinal", "v", "v:odd", counted_pulses, size=(0.2, 0.4), pulse=(0.3, 0.45)),
    "moving_walkway": form(
        "longitudinal",
        "v y yaw",
        "",
        moving_walkway,
        size=(0.2, 0.4),
        pace=(0.5, 0.9),
        slip=(0.25, 0.5),
        middle=(-1.0, 1.0),
        half=(1.5, 2.3),
        way=(0.0, 2.0),
    ),
    "sliding_ballast": form(
        "longitudinal", "yaw_rate", "yaw_rate:even", sliding_ballast, size=(0.2, 0.42), knee=(0.22, 0.38)
    ),
    "skipping_pawls": form(
        "longitudinal",
        "effort_sum effort_diff",
        "",
        skipping_pawls,
        size=(0.2, 0.4),
        lever=(0.3, 0.5),
        grip=(0.15, 0.3),
    ),
    "drum_spin_up": form(
        "longitudinal",
        "t",
        "",
        drum_spin_up,
        size=(0.25, 0.45),
        middle=(18.0, 42.0),
        width=(9.0, 15.0),
        hertz=(0.2, 0.35),
        phase=(0.0, 6.28),
    ),
    "fountain_gutter": form(
        "longitudinal",
        "x y yaw",
        "",
        fountain_gutter,
        size=(0.25, 0.45),
        east=(-1.5, 1.5),
        north=(-1.5, 1.5),
        radius=(1.5, 3.0),
        width=(0.7, 1.1),
    ),
    "paving_grid": form(
        "yaw", "v yaw", "v:even", paving_grid, size=(0.35, 0.65), angle=(0.0, 1.57), slow=(0.15, 0.35)
    ),
    "half_blown_bridge": form(
        "yaw",
        "v effort_sum",
        "",
        half_blown_bridge,
        size=(0.3, 0.6),
        soft=(0.1, 0.25),
        power=(0.03, 0.08),
    ),
    "swivel_mops": form("yaw", "yaw_rate", "yaw_rate:odd", swivel_mops, size=(0.25, 0.5), rate=(0.3, 0.5)),
    "passing_lorries": form(
        "yaw",
        "t yaw",
        "",
        passing_lorries,
        size=(0.35, 0.65),
        every=(7.5, 10.0),
        first=(0.0, 10.0),
        length=(0.9, 1.15),
        road=(0.0, 3.14),
    ),
    "buried_magnet": form(
        "yaw",
        "x y yaw",
        "",
        buried_magnet,
        size=(0.3, 0.6),
        east=(-2.5, 2.5),
        north=(-2.5, 2.5),
        reach=(1.5, 3.0),
        pole=(0.2, 1.37),
        quarter=(0.0, 4.0),
    ),
}
