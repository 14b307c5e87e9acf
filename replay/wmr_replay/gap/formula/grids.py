"""The grids of numbers on which families are tried: scales of speeds and efforts, times, and places."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from wmr_replay.gap.formula.carriers import (
    ALONG,
    HEADING,
    OVER_DIRECTION,
    OVER_HEADING,
    OVER_PLACE,
    OVER_STRIP,
    OVER_TIME,
    SAWN,
    SHORT,
    SOFT_V,
    SOFT_W,
    SOFTER_V,
    SOFTER_W,
    TURNED,
    UNSWITCHED,
    carriers_of,
)
from wmr_replay.gap.formula.families import Factors, Family, swings_alone
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of, ordered
from wmr_replay.gap.settings.formula import FormulaSettings, Shares
from wmr_schemas.arrays import F64
from wmr_schemas.shape_factors import PRODUCTS, SHAPED, quantity
from wmr_schemas.terms import CHANNELS, TermChannel

FRICTIONS = ("sgn(v)", "sgn(yaw_rate)", SOFT_V, SOFTER_V, SOFT_W, SOFTER_W)
TRIED: tuple[TermChannel, ...] = tuple(channel for channel in CHANNELS if channel != "lateral")


@dataclass(frozen=True, eq=False)
class Grid:
    """Families of the same carriers, each with the numbers (m, k) with which it is tried."""

    pieces: tuple[tuple[Family, F64], ...]

    @property
    def first(self) -> Family:
        """A family of it: channel, carriers and the terms without numbers are those of all."""
        return self.pieces[0][0]

    def __len__(self) -> int:
        """How many groups it is."""
        return sum(len(numbers) for _, numbers in self.pieces)

    def at(self, k: int) -> tuple[Family, tuple[float, ...]]:
        """The family and the numbers of its k-th group."""
        for family, numbers in self.pieces:
            if k < len(numbers):
                return family, tuple(float(number) for number in numbers[k])
            k -= len(numbers)
        raise IndexError(k)


def grid_of(*pieces: tuple[Family, F64]) -> Grid:
    """The grid of those that have numbers."""
    return Grid(tuple((family, numbers) for family, numbers in pieces if len(numbers)))


def grids_of(binned: BinnedLog, settings: FormulaSettings) -> tuple[Grid, ...]:
    """Everything with numbers that is tried on a log, but for bells."""
    columns = columns_of(binned)
    found = [*shaped(columns, settings), *timed(columns, settings)]
    found += [*waves(columns, settings), *lines(columns, settings)]
    return tuple(grid for grid in found if len(grid))


def shaped(columns: dict[str, F64], settings: FormulaSettings) -> Iterator[Grid]:
    """Products of one or two quantities, odd or even in each, shaped by one quantity."""
    shapes = {
        z: [
            *shapes_of(values, settings.scale_shares, settings),
            *((kind, scale_of(values, settings) * pairs) for kind, pairs in two_numbers(settings)),
        ]
        for z, values in ((z, quantity(columns, z)) for z in (*SHAPED, *PRODUCTS))
    }
    for channel in TRIED:
        for carriers, along in carried():
            family = Family("", channel, along, carriers, plain=True)
            yield grid_of(*((replace(family, kind=kind), numbers) for kind, numbers in shapes[along]))


def two_numbers(own: FormulaSettings) -> Iterator[tuple[str, F64]]:
    """Kinds with a middle and a width, these in units of the quantity's scale; one side may be either."""
    yield "ring", np.array(list(product(*own.ring_shares)))
    middles, widths = own.side_shares
    yield "beyond", np.array(list(product(middles, widths)))
    yield "above", np.array(list(product((*middles, *(-at for at in middles)), widths)))


def carried() -> Iterator[tuple[tuple[Factors, ...], str]]:
    """Each product with each quantity that may shape it: one of any, a friction, two of their own; and both
    of one by itself, which acts on one side.
    """
    for along in (*SHAPED, *PRODUCTS):
        yield ((),), along
        if along in SHAPED:
            yield ((along,), (f"abs({along})",)), along
        for z in SHAPED:
            yield ((z,),), along
            yield ((f"abs({z})",),), along
        for friction in FRICTIONS:
            yield ((friction,),), along
    for a, b in combinations(SHAPED, 2):
        for first, second in product((a, f"abs({a})"), (b, f"abs({b})")):
            carrier = tuple(ordered((first, second)).split("*"))
            yield (carrier,), a
            yield (carrier,), b


def shapes_of(z: F64, shares: Shares, own: FormulaSettings) -> Iterator[tuple[str, F64]]:
    """Each shape with its numbers on a quantity's scale."""
    for kind, numbers in shares:
        yield kind, scale_of(z, own) * np.array(numbers)[:, None]


def scale_of(z: F64, own: FormulaSettings) -> float:
    """The scale of a quantity (n,): its root mean square."""
    return max(float(np.sqrt(np.mean(z**2))), own.least_scale)


def timed(columns: dict[str, F64], own: FormulaSettings) -> Iterator[Grid]:
    """What comes, goes, fades or swings in time."""
    first, last = float(columns["t"][0]), float(columns["t"][-1])
    span_s = last - first
    starts = np.arange(first + own.least_gust_s, last - own.least_gust_s, own.step_s)
    gusts = [
        (middle, width)
        for width in own.gust_s
        if own.most_gust * span_s >= width
        for middle in np.arange(first, last, width)
    ]
    shapes = (
        *((kind, np.array(gusts).reshape(-1, 2)) for kind in ("gust", "pulse")),
        ("after", starts[:, None]),
        ("decay", span_s * np.array(own.decay_spans)[:, None]),
        ("fall", span_s * np.array(own.decay_spans)[:, None]),
    )
    switches = edges_of(columns["t"], own.edge_widths, own)
    periods = numbers_of_waves(span_s, own.least_period_s, own.longest_in_spans * span_s, own)
    saws = saws_of(columns["t"], own)
    swings = np.concatenate([periods, *swings_of(span_s, own)])
    for channel in TRIED:
        for text in OVER_TIME[channel]:
            family = Family("wave", channel, "t", carriers_of(text), plain=True)
            short = SHORT if "effort" in text or text == "1" else ()
            own_shapes = [one for one in shapes if one[0] not in short]
            yield grid_of(*((replace(family, kind=kind), numbers) for kind, numbers in own_shapes))
            yield grid_of((family, swings if swings_alone(family) else periods))
            if (channel, text) not in UNSWITCHED:
                yield grid_of((replace(family, kind="edge"), switches))
            if text in SAWN[channel]:
                yield grid_of((replace(family, kind="saw"), saws))


def saws_of(t_s: F64, own: FormulaSettings) -> F64:
    """Beginnings and periods (m, 2) of saws that a log shows more than once."""
    span_s = float(np.ptp(t_s))
    periods = 2 * np.pi / numbers_of_waves(span_s, own.least_saw_s, own.longest_saw * span_s, own)[:, 0]
    return np.array([(t_s[0] + at * period, period) for period in periods for at in own.saw_phases])


def swings_of(span_s: float, own: FormulaSettings) -> Iterator[F64]:
    """Numbers (m, 1) of the waves over time that are shorter than all others, octave by octave."""
    longest = own.least_period_s
    while longest > own.least_swing_s:
        shortest = max(longest / 2, own.least_swing_s)
        yield between(span_s, shortest, longest, own)
        longest = shortest


def waves(columns: dict[str, F64], own: FormulaSettings) -> Iterator[Grid]:
    """Waves over x and y, the way and the heading, and along other directions."""
    spans = {z: float(np.ptp(columns[z])) for z in "xys"}
    lengths = {z: (own.least_length_m, own.longest_in_spans * spans[z]) for z in "xy"}
    lengths["s"] = own.way_lengths_m[0], min(own.way_lengths_m[1], spans["s"])
    numbers = {z: numbers_of_waves(spans[z], *lengths[z], own) for z in "xys"}
    slanted = directions(spans, own)
    for channel in TRIED:
        for z, text in product("xy", OVER_PLACE[channel]):
            family = Family("wave", channel, z, carriers_of(text), plain=True)
            yield grid_of((family, numbers[z]))
            if "(yaw)" in text:
                yield grid_of((replace(family, plain=False), numbers[z]))
        for text in ALONG[channel]:
            yield grid_of((Family("wave", channel, "s", carriers_of(text)), numbers["s"]))
        for text in OVER_HEADING[channel]:
            family, named = Family("wave", channel, "yaw", carriers_of(text), plain=text != "1"), text == "1"
            turns = own.turns[1:] if named and channel == "longitudinal" else own.turns
            yield grid_of((family, np.array(turns)[:, None]))
        for text in OVER_DIRECTION[channel]:
            yield grid_of((Family("wave", channel, "xy", carriers_of(text)), slanted))


def lines(columns: dict[str, F64], own: FormulaSettings) -> Iterator[Grid]:
    """What changes across a line or lies along one, of x, y and other directions, or with all turns."""
    middle = float(np.mean(columns["x"])), float(np.mean(columns["y"]))
    edges, bands = (
        {z: edges_of(columns[z], widths, own) for z in "xy"} for widths in (own.edge_widths, own.strip_widths)
    )
    sides, strips = (lines_of(columns, middle, widths, own) for widths in (own.edge_widths, own.strip_widths))
    turned = edges_of(columns["yaw"], own.edge_widths, own)
    for channel in TRIED:
        yield from (
            grid_of((Family("edge", channel, "yaw", carriers_of(text), plain=True), turned))
            for text in TURNED
        )
        for text in dict.fromkeys((*OVER_PLACE[channel], *OVER_STRIP[channel])):
            edge = Family("edge", channel, "", carriers_of(text), plain=True)
            yield from (grid_of((replace(edge, along=z), edges[z])) for z in "xy")
            yield grid_of((replace(edge, kind="side", along="xy", around=middle), sides))
        for text in OVER_STRIP[channel]:
            yield grid_of((Family("strip", channel, "xy", carriers_of(text), around=middle), strips))
        for z, text in product("xy", (*OVER_STRIP[channel], *HEADING.split())):
            yield grid_of((Family("band", channel, z, carriers_of(text)), bands[z]))


def edges_of(z: F64, shares: tuple[float, ...], own: FormulaSettings) -> F64:
    """Places and widths (m, 2) of edges on a grid of the span, from sharp to soft."""
    low, span = float(np.min(z)), float(np.ptp(z))
    return np.array([(low + span * at, span * share) for share in shares for at in own.edge_places])


def lines_of(
    columns: dict[str, F64], middle: tuple[float, float], shares: tuple[float, ...], own: FormulaSettings
) -> F64:
    """Distances from the middle, angles and widths (m, 3) of lines across other directions than x and y."""
    found = []
    for angle in own.side_angles_rad:
        across = (columns["x"] - middle[0]) * np.cos(angle) + (columns["y"] - middle[1]) * np.sin(angle)
        found.append(np.insert(edges_of(across, shares, own), 1, angle, axis=1))
    return np.concatenate(found)


def numbers_of_waves(span: float, shortest: float, longest: float, own: FormulaSettings) -> F64:
    """Numbers (m, 1) of waves of every length that a span can tell apart: half a turn over it from one to the
    next.
    """
    return between(span, shortest, longest, own) if longest > 2 * shortest else np.zeros((0, 1))


def between(span: float, shortest: float, longest: float, own: FormulaSettings) -> F64:
    """Numbers (m, 1) of waves from one length to the other."""
    first, last = 2 * np.pi / longest, 2 * np.pi / shortest
    n = min(int((last - first) * span / np.pi) + 1, own.most_waves)
    return np.linspace(first, last, n)[:, None]


def directions(spans: dict[str, float], own: FormulaSettings) -> F64:
    """Numbers (m, 2) of long waves over x and y, along neither of them."""
    steps = [np.pi / max(spans[z], own.least_length_m) for z in "xy"]
    longest = 2 * np.pi / (own.longest_in_spans * max(spans["x"], spans["y"], own.least_length_m))
    most = own.most_turns
    grid = np.array([(i * steps[0], j * steps[1]) for i in range(most + 1) for j in range(-most, most + 1)])
    size = np.hypot(*grid.T)
    long = (size >= longest) & (size <= 2 * np.pi / own.least_length_m)
    slanted = np.min(np.abs(grid), axis=1) >= own.slanted * size
    return np.asarray(grid[long & slanted & (grid[:, 0] > 0)])
