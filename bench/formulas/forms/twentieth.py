"""Forms of a twentieth report, looked at since."""

import numpy as np

from formulas.forms.base import At, aslant, form
from wmr_schemas.arrays import F64


def memory_foam(at: At, size: float, peak: float, edge: float, ramp: float) -> F64:
    """Foam mats on one half of the hall: they spring back too late, which drags most at one speed."""
    u = at.v / peak
    return -size * 2.0 * u / (1.0 + u**2) * 0.5 * (1.0 + np.tanh((at.y - edge) / ramp))


def overrun_brake(at: At, size: float, slack: float, soft: float) -> F64:
    """A trailer's overrun brake grips when the robot rolls ahead and no longer pulls at the drawbar."""
    ahead = 0.5 * (1.0 + np.tanh(at.v / 0.1))
    return -size * ahead * 0.5 * (1.0 - np.tanh((at.pull - slack) / soft))


def tram_ride(at: At, size: float, period: float, start: float, angle: float, quarter: float) -> F64:
    """Driving about in a tram that pulls away, rolls and brakes again, from stop to stop."""
    tram = np.sin(2.0 * np.pi * at.t / period + start) ** 3
    return size * tram * np.cos(at.yaw - aslant(angle, quarter))


def far_feeder(at: At, size: float, x0: float, y0: float, reach: float) -> F64:
    """Fed through a contact net as a bumper car: far from the feeder, part of the pull is lost."""
    far = np.hypot(at.x - x0, at.y - y0) / reach
    return -size * at.pull / 0.4 * far**2 / (1.0 + far**2)


def stream_ford(at: At, size: float, middle: float, width: float) -> F64:
    """Wading through a stream along y: its current carries the robot with it, most in midstream."""
    return size * np.exp(-(((at.x - middle) / width) ** 2)) * np.sin(at.yaw)


def snow_packing(at: At, size: float, period: float, start: float, soft: float) -> F64:
    """Wet snow packs into the wheel arches and rubs more and more until it drops out, again and again."""
    full = (at.t / period + start) % 1.0
    return -size * np.tanh(at.v / soft) * 1.3 * full * (1.0 - full**8)


def hedge_alley(at: At, size: float, middle: float, width: float, soft: float) -> F64:
    """An alley along x between hedges: twigs hold back the side that is next to the nearer hedge."""
    return size * np.tanh(at.v / soft) * np.tanh((at.y - middle) / width) * np.cos(at.yaw)


def blade_reaction(at: At, size: float, length: float, phase: float, angle: float, quarter: float) -> F64:
    """A mower's blade twists the robot the other way, and more so where the grass stands thick."""
    way = aslant(angle, quarter)
    along = at.x * np.cos(way) + at.y * np.sin(way)
    return size * np.sin(np.pi * along / length + phase) ** 2


def jackknife(at: At, size: float, pace: float, rate: float) -> F64:
    """A hitched trailer straightens the robot when drawn ahead and folds it up further when pushed back."""
    return -size * np.tanh(at.v / pace) * np.tanh(at.yaw_rate / rate)


def kite_at_the_tail(at: At, size: float, wind: float, sweep: float, period: float) -> F64:
    """A kite tied to the tail sweeps from side to side of the wind and pulls the tail towards it."""
    kite = wind + sweep * np.sin(2.0 * np.pi * at.t / period)
    return size * np.sin(at.yaw - kite)


def flung_arms(at: At, size: float, rate: float) -> F64:
    """Loosely hung arms fly out in a spin, and the torques turn the wider robot less readily."""
    out = (at.yaw_rate / rate) ** 2
    return -size * at.turn / 0.6 * out / (1.0 + out)


TWENTIETH = {
    "memory_foam": form(
        "longitudinal",
        "v y",
        "v:odd",
        memory_foam,
        size=(0.2, 0.42),
        peak=(0.1, 0.3),
        edge=(-1.5, 0.5),
        ramp=(0.15, 0.5),
    ),
    "overrun_brake": form(
        "longitudinal",
        "v effort_sum",
        "",
        overrun_brake,
        size=(0.22, 0.45),
        slack=(0.1, 0.3),
        soft=(0.08, 0.2),
    ),
    "tram_ride": form(
        "longitudinal",
        "t yaw",
        "",
        tram_ride,
        size=(0.3, 0.55),
        period=(12.0, 30.0),
        start=(0.0, 6.28),
        angle=(0.2, 1.37),
        quarter=(0.0, 4.0),
    ),
    "far_feeder": form(
        "longitudinal",
        "x y effort_sum",
        "effort_sum:odd",
        far_feeder,
        size=(0.3, 0.55),
        x0=(-2.5, 2.5),
        y0=(-2.5, 2.5),
        reach=(1.6, 3.0),
    ),
    "stream_ford": form(
        "longitudinal", "x yaw", "", stream_ford, size=(0.25, 0.5), middle=(-1.5, 1.5), width=(1.3, 2.6)
    ),
    "snow_packing": form(
        "longitudinal",
        "t v",
        "v:odd",
        snow_packing,
        size=(0.2, 0.4),
        period=(12.0, 28.0),
        start=(0.0, 1.0),
        soft=(0.05, 0.2),
    ),
    "hedge_alley": form(
        "yaw",
        "v y yaw",
        "v:odd",
        hedge_alley,
        size=(0.3, 0.7),
        middle=(-1.0, 1.0),
        width=(0.7, 2.0),
        soft=(0.05, 0.25),
    ),
    "blade_reaction": form(
        "yaw",
        "x y",
        "",
        blade_reaction,
        size=(0.25, 0.6),
        length=(2.0, 5.0),
        phase=(0.0, 3.14),
        angle=(0.2, 1.37),
        quarter=(0.0, 4.0),
    ),
    "jackknife": form(
        "yaw",
        "v yaw_rate",
        "v:odd yaw_rate:odd",
        jackknife,
        size=(0.3, 0.65),
        pace=(0.2, 0.5),
        rate=(0.15, 0.4),
    ),
    "kite_at_the_tail": form(
        "yaw",
        "t yaw",
        "",
        kite_at_the_tail,
        size=(0.25, 0.55),
        wind=(-3.14, 3.14),
        sweep=(0.6, 1.4),
        period=(7.0, 18.0),
    ),
    "flung_arms": form(
        "yaw",
        "yaw_rate effort_diff",
        "yaw_rate:even effort_diff:odd",
        flung_arms,
        size=(0.22, 0.42),
        rate=(0.25, 0.55),
    ),
}
