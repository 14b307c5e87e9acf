"""Forms of the report; no tuning has used them."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def centrifugal_clutch(at: At, size: float, engage: float) -> F64:
    """A centrifugal clutch slips at low speed and hands on only part of the pull until its shoes bite."""
    return -size * at.pull / (1.0 + (at.v / engage) ** 2)


def pulsing_suction(at: At, size: float, period: float, phase: float) -> F64:
    """A suction nozzle clings to the floor and rubs, harder and softer as its pump cycles."""
    return -size * np.sin(np.pi * at.t / period + phase) ** 2 * np.tanh(at.v / 0.1)


def shelving_shore(at: At, size: float, shore: float) -> F64:
    """Beyond the waterline the robot wades ever deeper, and the water resists with the square of speed."""
    return -size * at.v * np.abs(at.v) * np.maximum(at.x - shore, 0.0)


def ceiling_rail(at: At, size: float, height: float, rail: float) -> F64:
    """A taut cable from a trolley on a ceiling rail along x pulls the robot back under the rail."""
    aside = at.y - rail
    return -size * aside / np.hypot(aside, height) * np.sin(at.yaw)


def seed_coulter(at: At, size: float, loose: float) -> F64:
    """A coulter at the tail bites and brakes while running straight, and breaks out of its slit in bends."""
    return -size * np.tanh(at.v / 0.1) / (1.0 + (at.yaw_rate / loose) ** 2)


def wet_leaves(at: At, size: float, angle: float, quarter: float, width: float) -> F64:
    """To one side of a line the ground is strewn with wet leaves, where the wheels slip and pull less."""
    towards = aslant(angle, quarter)
    into = at.x * np.cos(towards) + at.y * np.sin(towards)
    return -0.5 * size * at.pull * (1.0 + np.tanh(into / width))


def snaking_trailer(at: At, size: float, period: float, phase: float) -> F64:
    """A trailer snakes from side to side and tugs the tail about, harder with the square of the speed."""
    return size * at.v**2 * np.sin(2.0 * np.pi * at.t / period + phase)


def billboard(at: At, size: float, angle: float, quarter: float) -> F64:
    """A flat board carried upright is turned broadside on by a steady wind, whichever face is to it."""
    return size * np.sin(2.0 * (at.yaw - aslant(angle, quarter)))


def drying_floor(at: At, size: float, dry: float) -> F64:
    """A freshly washed floor dries, and the tyres scrub ever more as they turn on it."""
    return -size * (1.0 - np.exp(-at.t / dry)) * np.tanh(at.yaw_rate / 0.15)


def braking_dive(at: At, size: float, slow: float) -> F64:
    """Braking presses the front caster down so that it scrubs in turns; pulling away lifts it free."""
    return size * at.pull * np.tanh(at.yaw_rate / slow)


def hummocky_lawn(at: At, size: float, length: float, phase: float) -> F64:
    """Across a lawn of long swells the heavy nose is drawn sideways down into the next hollow."""
    return -size * np.sin(2.0 * np.pi * at.y / length + phase) * np.cos(at.yaw)


REPORT = {
    "centrifugal_clutch": form(
        "longitudinal",
        "v effort_sum",
        "v:even effort_sum:odd",
        centrifugal_clutch,
        size=(0.5, 0.75),
        engage=(0.4, 0.8),
    ),
    "pulsing_suction": form(
        "longitudinal",
        "t v",
        "v:odd",
        pulsing_suction,
        size=(0.2, 0.5),
        period=(8.0, 25.0),
        phase=(0.0, 3.14),
    ),
    "shelving_shore": form(
        "longitudinal", "x v", "v:odd", shelving_shore, size=(0.2, 0.4), shore=(-2.0, -0.5)
    ),
    "ceiling_rail": form(
        "longitudinal", "y yaw", "", ceiling_rail, size=(0.25, 0.6), height=(1.0, 2.5), rail=(-1.0, 1.0)
    ),
    "seed_coulter": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even", seed_coulter, size=(0.2, 0.5), loose=(0.2, 0.5)
    ),
    "wet_leaves": form(
        "longitudinal",
        "x y effort_sum",
        "effort_sum:odd",
        wet_leaves,
        size=(0.55, 0.8),
        angle=(0.3, 1.27),
        quarter=(0.0, 4.0),
        width=(0.3, 1.0),
    ),
    "snaking_trailer": form(
        "yaw", "t v", "v:even", snaking_trailer, size=(0.5, 1.2), period=(4.0, 10.0), phase=(0.0, 6.28)
    ),
    "billboard": form("yaw", "yaw", "", billboard, size=(0.15, 0.4), angle=(0.3, 1.27), quarter=(0.0, 4.0)),
    "drying_floor": form(
        "yaw", "t yaw_rate", "yaw_rate:odd", drying_floor, size=(0.2, 0.45), dry=(20.0, 60.0)
    ),
    "braking_dive": form(
        "yaw",
        "effort_sum yaw_rate",
        "effort_sum:odd yaw_rate:odd",
        braking_dive,
        size=(0.7, 1.2),
        slow=(0.2, 0.5),
    ),
    "hummocky_lawn": form(
        "yaw", "y yaw", "", hummocky_lawn, size=(0.25, 0.5), length=(3.0, 7.0), phase=(0.0, 6.28)
    ),
}
