"""Forms of the fourteenth report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64

CRAWL_MPS = 0.05
"""Below this speed dry friction fades."""


def full_battery(at: At, c: float) -> F64:
    """Takes a share of the pull where it brakes, against the way of rolling."""
    return -0.5 * c * (at.pull - np.abs(at.pull) * np.tanh(at.v / CRAWL_MPS))


def hose_reel(at: At, size: float, x: float, y: float, reach: float) -> F64:
    """A nearly constant tension towards the reel, none at the reel itself, along the heading."""
    ahead = (x - at.x) * np.cos(at.yaw) + (y - at.y) * np.sin(at.yaw)
    far2 = (x - at.x) ** 2 + (y - at.y) ** 2
    return size * (1 - np.exp(-far2 / reach**2)) * ahead / np.sqrt(far2 + 0.01)


def loose_sand(at: At, c: float, x: float, y: float, radius: float) -> F64:
    """Swallows a share of the pull within a round patch with soft edges."""
    return -c * at.pull * np.exp(-((((at.x - x) ** 2 + (at.y - y) ** 2) / radius**2) ** 2))


def caster_scrub(at: At, size: float, fades: float) -> F64:
    """Dry friction against turning that fades as the contact patches roll."""
    return -size * np.tanh(at.yaw_rate / 0.1) / (1 + (at.v / fades) ** 2)


def slow_puncture(at: At, size: float, tau: float) -> F64:
    """Drag of one side that grows as its tyre goes flat: it turns the robot, the other way in reverse."""
    return size * (1 - np.exp(-at.t / tau)) * np.tanh(at.v / CRAWL_MPS)


FOURTEENTH = {
    # The windings and magnets warm up, so that the motors give less for the same command as time goes by.
    "hot_windings": form(
        "longitudinal",
        "t effort_sum",
        "effort_sum:odd",
        lambda at, c, tau: -c * (1 - np.exp(-at.t / tau)) * at.pull,
        c=(0.4, 0.65),
        tau=(15.0, 50.0),
    ),
    # The battery is full and takes no current back, so that the motors brake less than they are asked to.
    "full_battery": form("longitudinal", "v effort_sum", "", full_battery, c=(0.6, 0.85)),
    # A water hose or a cable on a spring reel, which pulls the robot back to where the reel stands.
    "hose_reel": form(
        "longitudinal",
        "x y yaw",
        "",
        hose_reel,
        size=(0.2, 0.5),
        x=(-2.0, 2.0),
        y=(-2.0, 2.0),
        reach=(0.8, 1.8),
    ),
    # In bends the tyres run at a slip angle under the centrifugal load, and the side force drags backwards.
    "cornering_drag": form(
        "longitudinal",
        "v yaw_rate",
        "v:odd yaw_rate:even",
        lambda at, c: -c * np.abs(at.v * at.yaw_rate) * np.tanh(at.v / CRAWL_MPS),
        c=(0.4, 0.9),
    ),
    # A patch of dry sand in which the wheels dig and only a part of the torque becomes thrust.
    "loose_sand": form(
        "longitudinal",
        "x y effort_sum",
        "effort_sum:odd",
        loose_sand,
        c=(0.6, 0.85),
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.2, 0.35),
    ),
    # A heavy load that hangs from a gantry on the robot swings fore and aft at a period of its own.
    "hung_load": form(
        "longitudinal",
        "t",
        "",
        lambda at, size, period, phase: size * np.sin(2 * np.pi * at.t / period + phase),
        size=(0.2, 0.5),
        period=(2.5, 6.0),
        phase=(0.0, 6.28),
    ),
    # Casters and wide tyres grind over the floor in turns on the spot, much less so once they roll.
    "caster_scrub": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd", caster_scrub, size=(0.3, 0.6), fades=(0.25, 0.6)
    ),
    # A tyre on one side loses its air during the drive and drags more and more.
    "slow_puncture": form("yaw", "t v", "v:odd", slow_puncture, size=(0.2, 0.5), tau=(15.0, 50.0)),
    # The motor controllers hardly answer small differences between the commands: a soft dead band.
    "dead_band": form(
        "yaw",
        "effort_diff",
        "effort_diff:odd",
        lambda at, size: -0.85 * size * np.tanh(at.turn / size),
        size=(0.2, 0.45),
    ),
    # Both motors hang on one weak supply: while it pulls or brakes hard, little is left for steering.
    "shared_supply": form(
        "yaw",
        "effort_sum effort_diff",
        "effort_sum:even effort_diff:odd",
        lambda at, c, full: -c * at.turn * at.pull**2 / (at.pull**2 + full**2),
        c=(0.65, 0.9),
        full=(0.1, 0.3),
    ),
    # A crowned road along x: its nose-heavy load turns the robot down the side slope it is on.
    "road_crown": form(
        "yaw",
        "y yaw",
        "",
        lambda at, size, y, width: size * np.tanh((at.y - y) / width) * np.cos(at.yaw),
        size=(0.2, 0.5),
        y=(-2.0, 2.0),
        width=(0.5, 1.5),
    ),
}
