"""Forms of the fifteenth report."""

import numpy as np

from formulas.forms.base import At, form
from wmr_schemas.arrays import F64

ROUND = (0.0, 6.28)
EITHER = (-1.0, 1.0)


def side_of(side: float) -> float:
    """Left or right, by the sign of the draw."""
    return 1.0 if side >= 0.0 else -1.0


def shudder(at: At, peak: float, speed: float, width: float) -> F64:
    """A drag with a hump at one speed, against the motion."""
    return -peak * np.tanh(at.v / 0.05) * np.exp(-(((np.abs(at.v) - speed) / width) ** 2))


def worm(at: At, friction: float) -> F64:
    """Sliding friction between gear teeth that the torque presses together, against the motion."""
    return -friction * np.abs(at.pull) * np.tanh(at.v / 0.06)


def soil(at: At, drag: float, rate: float) -> F64:
    """Drag of the earth that turning wheels push before their flanks."""
    return -drag * np.tanh(at.v / 0.1) * (1.0 - np.exp(-((at.yaw_rate / rate) ** 2)))


def deck(at: At, size: float, period: float, phase: float, direction: float) -> F64:
    """Gravity along the heading on a floor that rolls about one axis."""
    return size * np.sin(2 * np.pi * at.t / period + phase) * np.cos(at.yaw - direction)


def hose(at: At, tension: float, x: float, y: float, radius: float) -> F64:
    """Tension towards the tap, along the heading, rising once the slack is used up."""
    east, north = x - at.x, y - at.y
    far = np.maximum(np.hypot(east, north), 1e-6)
    taut = 1.0 - np.exp(-2.0 * np.maximum(far - 0.6 * radius, 0.0) / radius)
    return tension * taut * (east * np.cos(at.yaw) + north * np.sin(at.yaw)) / far


def pump(at: At, lost: float, share: float) -> F64:
    """Drive pressure lost to steering where one pump feeds both wheel motors."""
    return -lost * at.pull * (1.0 - np.exp(-np.abs(at.turn) / share))


def vane(at: At, size: float, wind: float, gust: float, period: float, phase: float) -> F64:
    """The moment that turns a tail fin downwind, by a wind that swells and sinks."""
    swell = 1.0 + gust * np.sin(2 * np.pi * at.t / period + phase)
    return size * swell * np.sin(wind - at.yaw)


def ruts(at: At, size: float, along: float, x: float, y: float, radius: float) -> F64:
    """A moment that turns the wheels into parallel grooves, either way along, within a round area."""
    far = np.hypot(at.x - x, at.y - y) / radius
    return size * np.exp(-(far**4)) * np.sin(2.0 * (along - at.yaw))


def axle(at: At, grip: float) -> F64:
    """Clutch plates pressed by the drive torque hold the two wheels to one speed."""
    return -grip * np.abs(at.pull) * np.tanh(at.yaw_rate / 0.15)


def plate(at: At, friction: float, reach: float) -> F64:
    """Sideways part of the dry friction under a sliding tail, whose direction is that of the slide."""
    return -friction * at.w / np.sqrt(at.w**2 + (reach * at.v) ** 2 + 0.02**2)


def leak(at: At, drag: float, side: float, start: float, over: float) -> F64:
    """Drag of one tyre as it goes soft: to its side forwards, to the other backwards."""
    soft = 1.0 - np.exp(-np.maximum(at.t - start, 0.0) / over)
    return side_of(side) * drag * soft * np.tanh(at.v / 0.1)


FIFTEENTH = {
    # A drive belt that shudders near one speed and eats power there.
    "belt_shudder": form(
        "longitudinal", "v", "v:odd", shudder, peak=(0.25, 0.45), speed=(0.35, 0.75), width=(0.15, 0.3)
    ),
    # Worm gears: teeth rub in proportion to the load, which takes from the drive and adds to the brake.
    "worm_gears": form("longitudinal", "v effort_sum", "v:odd effort_sum:even", worm, friction=(0.35, 0.65)),
    # Soft ground: in a bend the wheels bulldoze a berm, which holds the robot back.
    "bulldozed_soil": form(
        "longitudinal", "v yaw_rate", "v:odd yaw_rate:even", soil, drag=(0.25, 0.5), rate=(0.2, 0.5)
    ),
    # Aboard a ship whose deck rolls with the swell.
    "ship_deck": form(
        "longitudinal", "t yaw", "", deck, size=(0.25, 0.5), period=(5.0, 14.0), phase=ROUND, direction=ROUND
    ),
    # A hose or cable dragged from a tap, slack close by and taut farther off.
    "garden_hose": form(
        "longitudinal",
        "x y yaw",
        "",
        hose,
        tension=(0.3, 0.5),
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.2, 0.4),
    ),
    # One hydraulic pump for both wheel motors: hard steering takes pressure from the drive.
    "shared_pump": form(
        "longitudinal",
        "effort_sum effort_diff",
        "effort_sum:odd effort_diff:even",
        pump,
        lost=(0.45, 0.75),
        share=(0.06, 0.16),
    ),
    # A tall tail or banner behind the axle weathercocks in a gusty wind.
    "weather_vane": form(
        "yaw",
        "t yaw",
        "",
        vane,
        size=(0.18, 0.35),
        wind=ROUND,
        gust=(0.3, 0.8),
        period=(8.0, 25.0),
        phase=ROUND,
    ),
    # Old wheel ruts or planks in one area that guide the wheels along themselves.
    "cart_ruts": form(
        "yaw",
        "x y yaw",
        "",
        ruts,
        size=(0.35, 0.55),
        along=(0.0, 3.14),
        x=(0.25, 0.75),
        y=(0.25, 0.75),
        radius=(0.2, 0.4),
    ),
    # A limited-slip axle: the harder it is driven or braked, the more it resists turning.
    "locking_axle": form("yaw", "yaw_rate effort_sum", "yaw_rate:odd effort_sum:even", axle, grip=(0.7, 1.2)),
    # A sliding tail plate: it resists a turn on the spot in full, a turn on the move much less.
    "skid_plate": form(
        "yaw", "v yaw_rate", "v:even yaw_rate:odd", plate, friction=(0.25, 0.42), reach=(0.2, 0.45)
    ),
    # A puncture: some while into the drive one tyre goes soft and drags on its side.
    "leaking_tyre": form(
        "yaw", "v t", "v:odd", leak, drag=(0.2, 0.4), side=EITHER, start=(3.0, 20.0), over=(6.0, 20.0)
    ),
}
