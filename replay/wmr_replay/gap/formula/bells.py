"""Bells over the plane, where the robot comes onto their flanks at least twice."""

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from wmr_replay.gap.formula.carriers import (
    EITHER_WAY,
    HEADING,
    SOFT_V,
    SOFT_W,
    SOFTER_V,
    SOFTER_W,
    carriers_of,
)
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.grids import TRIED, Grid
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.terms import TermChannel

CARRIED: tuple[tuple[str, TermChannel, str], ...] = (
    *((slope, channel, "1") for slope in ("hill", "tilt") for channel in TRIED),
    *(("bump", "longitudinal", text) for text in ("1", "v", "sgn(v)", HEADING)),
    *(("bump", "yaw", text) for text in ("1", "yaw_rate", "sgn(yaw_rate)", HEADING, EITHER_WAY)),
    *(("disc", "longitudinal", text) for text in ("v", "sgn(v)", SOFT_V, HEADING, "effort_sum")),
    *(
        ("disc", "yaw", text)
        for text in ("yaw_rate", "sgn(yaw_rate)", SOFT_W, HEADING, EITHER_WAY, "effort_diff")
    ),
)
"""Height, ahead and to the side, and what pushes, brakes, guides or blows in a place, or takes traction."""

PULLED: tuple[tuple[str, TermChannel], ...] = (("rope", "longitudinal"), ("rope_left", "yaw"))
"""A hose or cable that is held in a place. Fixed behind the axle, it turns the robot, too."""

OVER_ALL: tuple[tuple[TermChannel, str], ...] = (
    *(("longitudinal", text) for text in ("sgn(v)", SOFT_V, SOFTER_V, "v")),
    *(("yaw", text) for text in ("sgn(yaw_rate)", SOFT_W, SOFTER_W, "yaw_rate")),
)
"""Frictions and drags that change smoothly over the whole area: about the tap of a hose, say."""

FAR: tuple[tuple[TermChannel, str], ...] = (
    *(("longitudinal", text) for text in ("effort_sum", "sgn(v)", SOFT_V, "v")),
    *(("yaw", text) for text in ("effort_diff", "sgn(yaw_rate)", SOFT_W, "yaw_rate")),
)
"""What is lost, or drags, far from a place, or on a round path about it: from what feeds a robot, or from a
hose's tap.
"""


def bells(binned: BinnedLog, settings: FormulaSettings) -> Iterator[Grid]:
    """The bells of a log, by what they carry."""
    numbers = {kind: bells_of(kind, binned, settings) for kind in ("hill", "bump", "disc")}
    numbers["tilt"] = numbers["hill"]
    for kind, channel, text in CARRIED:
        if len(numbers[kind]):
            yield Grid(((Family(kind, channel, "", carriers_of(text)), numbers[kind]),))
    for kind, channel in PULLED:
        yield Grid(((Family(kind, channel), ropes_of(binned, settings)),))
    wide, far = (wide_bells_of(binned, settings, s) for s in (settings.wide_shares, settings.away_shares))
    for channel, text in OVER_ALL:
        yield Grid(((Family("bump", channel, "", carriers_of(text), plain=True), wide),))
    circles = circles_of(binned, settings)
    for channel, text in FAR:
        yield Grid(((Family("away", channel, "", carriers_of(text)), far),))
        yield Grid(((Family("circle", channel, "", carriers_of(text)), circles),))


def wide_bells_of(binned: BinnedLog, settings: FormulaSettings, shares: Sequence[float]) -> F64:
    """Wide bells (m, 3), radii by shares of the area's span, about places on a grid where the robot was."""
    place = binned.pose[:, :2]
    span_m = float(np.mean(np.ptp(place, axis=0)))
    found = []
    for share in shares:
        radius_m = max(share * span_m, settings.least_radius_m)
        cells = np.unique(np.rint(2 * place / radius_m), axis=0) * radius_m / 2
        found.append(np.column_stack([cells, np.full(len(cells), radius_m)]))
    return np.concatenate(found)


def ropes_of(binned: BinnedLog, settings: FormulaSettings) -> F64:
    """Ropes (m, 3) that are held at places on a grid over the area and about it."""
    place = binned.pose[:, :2]
    span_m = max(float(np.mean(np.ptp(place, axis=0))), settings.least_radius_m)
    step_m, reach_m = settings.rope_step * span_m, settings.rope_reach * span_m
    x_m, y_m = (np.arange(u.min() - reach_m, u.max() + reach_m + step_m, step_m) for u in place.T)
    radii = np.maximum(span_m * np.array(settings.rope_shares), settings.least_radius_m)
    return np.array(list(product(x_m, y_m, np.unique(radii))))


def circles_of(binned: BinnedLog, settings: FormulaSettings) -> F64:
    """Circles (m, 4), radii by shares of the area's span, about places on a grid over the area."""
    place = binned.pose[:, :2]
    span_m = max(float(np.mean(np.ptp(place, axis=0))), settings.least_radius_m)
    step_m, width_m = settings.circle_step * span_m, settings.circle_width * span_m
    x_m, y_m = (np.arange(u.min(), u.max() + step_m, step_m) for u in place.T)
    return np.array(list(product(x_m, y_m, span_m * np.array(settings.circle_shares), [width_m])))


def bells_of(kind: str, binned: BinnedLog, settings: FormulaSettings) -> F64:
    """Bells (m, 3) on a grid of their radius, along the path and beside it, where they are seen at least
    twice.

    The slope of a hill is steepest a radius from its middle, which need not be passed.
    """
    place = binned.pose[:, :2]
    span_m = float(np.mean(np.ptp(place, axis=0)))
    here, next_to = np.zeros((1, 2)), np.eye(2)
    beside = np.vstack([here, next_to, -next_to]) if kind == "hill" else here
    found = []
    for share in settings.bell_shares:
        radius_m = max(share * span_m, settings.least_radius_m)
        on_path = np.unique(np.rint(place / radius_m), axis=0)
        cells = np.unique((on_path[:, None] + beside).reshape(-1, 2), axis=0)
        for x, y in cells * radius_m:
            shape = (float(x), float(y), radius_m)
            if visits_of(binned, shape, settings) >= settings.visits:
                found.append(shape)
    return np.array(found).reshape(-1, 3)


def visits_of(binned: BinnedLog, shape: tuple[float, ...], settings: FormulaSettings) -> int:
    """How often the path comes onto a bell's flanks, counted anew after some seconds outside."""
    x, y, radius_m = shape
    apart_m = np.hypot(binned.pose[:, 0] - x, binned.pose[:, 1] - y)
    t_s = binned.t_s[apart_m < settings.flank_radii * radius_m]
    return int(len(t_s) > 0) + int(np.sum(np.diff(t_s) > settings.apart_s))
