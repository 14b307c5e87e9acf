"""The paths of a gap analysis in the plane: measured, held out, simulated window by window, regions."""

from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import rerun as rr

from wmr_replay.timeline import colours
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.sink import Sink
from wmr_schemas.arrays import F64, Bool

if TYPE_CHECKING:
    from wmr_replay.gap.result.result import Region, Traces

WINDOW_S, EDGE_S = 4.0, 0.06
"""Simulated windows, and how much shorter than their length one may be, as the analysis cuts them."""
CORNERS = 64


def runs(rows: Bool) -> list[tuple[int, int]]:
    """Rows [a, b) of each run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def cut(traces: "Traces") -> list[tuple[int, int]]:
    """Rows [a, b) of each simulated window, none of which reaches from a fitted part into a held-out one."""
    simulated = np.isfinite(traces.base_path[:, 0])
    held_out = traces.held_out.astype(bool)
    pieces = []
    for a, b in sorted(runs(simulated & held_out) + runs(simulated & ~held_out)):
        while a < b:
            end = min(int(np.searchsorted(traces.t_s, traces.t_s[a] + WINDOW_S - EDGE_S)), b)
            pieces.append((a, end))
            a = end  # noqa: PLW2901 – the rest of the run
    return pieces


def frame_of(traces: "Traces") -> Frame:
    """The rectangle around the measured path."""
    frame = Frame()
    frame.include(traces.measured[:, :2])
    return frame


def add_paths(sink: Sink, traces: "Traces", t_ns: pl.Series, regions: "tuple[Region, ...]") -> None:
    """All paths, the measured one thin over the simulated ones, and circles about the regions."""
    windows = cut(traces)
    held_out = runs(traces.held_out.astype(bool))
    drawn = (
        ("/path/held_out", traces.measured, held_out, colours.HELD_OUT, 4.5, 4.0),
        ("/path/base", traces.base_path, windows, colours.BASE, 1.5, 10.0),
        ("/path/extended", traces.extended_path, windows, colours.EXTENDED, 1.25, 12.0),
        ("/path/measured", traces.measured, [(0, len(traces.t_s))], colours.TRUE_PATH, 0.4, 14.0),
    )
    for entity, path, pieces, colour, width, order in drawn:
        longer = [(a, b) for a, b in pieces if b - a > 1]
        stamps = t_ns[[a for a, _ in longer]]
        sink.add_strips(entity, stamps, strips([path[a:b, :2] for a, b in longer], colour, width, order))
    robot = rr.Points2D.columns(positions=traces.measured[:, :2])
    sink.add_strips("/path/robot", t_ns, robot)
    circles = strips([circle(region) for region in regions], colours.REGION, 0.75, 15.0)
    sink.add_strips("/path/regions", t_ns[[0] * len(regions)], circles)


def strips(points: list[F64], colour: colours.Colour, width: float, order: float) -> rr.ComponentColumnList:
    """Pieces of a path as Rerun's columns, one row a piece."""
    n = len(points)
    return rr.LineStrips2D.columns(
        strips=points,
        colors=np.tile(np.array(colour, np.uint8), (n, 1)),
        radii=np.full(n, rr.Radius.ui_points(width)),
        draw_order=np.full(n, order),
    )


def circle(region: "Region") -> F64:
    """The region's edge as a closed polygon (65, 2)."""
    angle = np.linspace(0, 2 * np.pi, CORNERS + 1)
    return np.stack(
        [region.x_m + region.radius_m * np.cos(angle), region.y_m + region.radius_m * np.sin(angle)], axis=1
    )
