"""The path of a gap analysis: coloured by the error of a model, with the error's vectors magnified."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from wmr_replay.timeline import colours
from wmr_replay.timeline.path import SMALL_VIEW, Frame, pen
from wmr_replay.timeline.sink import Sink
from wmr_schemas.arrays import F64, I64, Bool

if TYPE_CHECKING:
    from wmr_replay.gap.result.result import Region, Traces

WINDOW_S, EDGE_S = 4.0, 0.06
"""Simulated windows, and how much shorter than their length one may be, as the analysis cuts them."""
CORNERS = 64
MOST_VECTORS = 400
VECTOR_SHARE, LEAST_SHARE = 0.15, 0.008
"""Longest and shortest vector drawn, as shares of the frame's longer side."""
TOP_PERCENTILE = 92.0
"""The last colour begins at about the error that so many of a hundred rows do not reach."""
KEY_ROOM = 0.16
"""Room for the colours' key above the path, as a share of the frame's height."""
KEY_WIDTH = 0.85
"""Least width of the key, as a share of the frame's height: its words stand apart above a narrow path too."""
ROUND = (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0)
FACTORS = tuple(f * 10.0**power for power in range(6) for f in (1, 2, 5))


@dataclass(frozen=True)
class Errors:
    """Measured minus simulated position (n, 2) of each model in m, the error in m at the end of the colours,
    by how much vectors are magnified, and the length of the shortest that is drawn.
    """

    by_model: dict[str, F64]
    top_m: float
    factor: float
    shortest_m: float

    @classmethod
    def of(cls, traces: "Traces", frame: Frame) -> "Errors":
        """One scale for both models, which is that of the larger errors."""
        paths = {"base": traces.base_path, "extended": traces.extended_path}
        by_model = {model: path[:, :2] - traces.measured[:, :2] for model, path in paths.items()}
        sizes = np.hypot(*by_model["base"].T)
        known = sizes[np.isfinite(sizes)]
        top, largest = np.percentile(known, (TOP_PERCENTILE, 100.0)) if len(known) else (0.0, 0.0)
        side = float(frame.sides().max())
        factor = max((f for f in FACTORS if f * largest <= VECTOR_SHARE * side), default=1.0)
        return cls(by_model, round_number(max(top, 1e-6)), factor, LEAST_SHARE * side)

    def without_extended(self) -> "Errors":
        """For a model that was not extended."""
        return replace(self, by_model={"base": self.by_model["base"]})

    def level(self, model: str) -> I64:
        """The colour (n,) of each row, −1 where nothing was simulated."""
        sizes = np.hypot(*self.by_model[model].T)
        n = len(colours.ERRORS)
        level = np.clip(np.nan_to_num(sizes) / self.top_m * n, 0, n - 1).astype(np.int64)
        return np.where(np.isfinite(sizes), level, -1)


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
    frame = Frame(SMALL_VIEW)
    frame.include(traces.measured[:, :2])
    return frame


def add_paths(sink: Sink, traces: "Traces", errors: Errors, regions: "tuple[Region, ...]") -> None:
    """The measured path in the colours of each model's error, the error's vectors, the held-out part beneath,
    and circles about the regions.
    """
    xy = traces.measured[:, :2]
    held_out = [xy[a : b + 1] for a, b in runs(traces.held_out.astype(bool)) if b - a > 1]
    sink.add_pieces("/path/held_out", held_out, pen(colours.HELD_OUT, 5.0, -2.0))
    for model in errors.by_model:
        add_coloured(sink, f"/path/{model}/error", xy, errors.level(model))
        add_vectors(sink, f"/path/{model}/vectors", traces, errors, model)
    sink.add_pieces("/path/regions", [circle(region) for region in regions], pen(colours.REGION, 0.75, 15.0))


def add_coloured(sink: Sink, entity: str, xy: F64, level: I64) -> None:
    """The path, each stretch of one level in its colour; joined, and grey where nothing was simulated."""
    starts = np.flatnonzero(np.diff(level, prepend=level[0] - 1))
    ends = np.append(starts[1:], len(level)) + 1
    longer = [(a, b) for a, b in zip(starts, ends, strict=True) if len(xy[a:b]) > 1]
    shades = [colours.NOT_SIMULATED if level[a] < 0 else colours.ERRORS[level[a]] for a, _ in longer]
    coloured = rr.LineStrips2D([xy[a:b] for a, b in longer], colors=shades, radii=rr.Radius.ui_points(2.5))
    sink.recording.log(entity, coloured, rr.LineStrips2D.from_fields(draw_order=10.0), static=True)


def add_vectors(sink: Sink, entity: str, traces: "Traces", errors: Errors, model: str) -> None:
    """Vectors from the measured to the simulated position, magnified: the largest of each window."""
    sizes = np.nan_to_num(np.hypot(*errors.by_model[model].T))
    windows = cut(traces)
    rows = np.array(
        [a + int(sizes[a:b].argmax()) for a, b in windows[:: len(windows) // MOST_VECTORS + 1]], int
    )
    vectors = errors.factor * errors.by_model[model][rows]
    known = np.hypot(*vectors.T) >= errors.shortest_m
    arrows = rr.Arrows2D(
        vectors=vectors[known],
        origins=traces.measured[rows[known], :2],
        colors=colours.VECTOR,
        radii=rr.Radius.ui_points(2.0),
        draw_order=12.0,
    )
    sink.recording.log(entity, arrows, static=True)


def add_key(sink: Sink, frame: Frame, errors: Errors) -> None:
    """The errors of three colours, written in them above the path, for which the frame grows."""
    (left, bottom), (right, top) = frame.with_margin()
    y = top + 0.5 * KEY_ROOM * (top - bottom)
    top_mm = 1e3 * errors.top_m
    middle, half = (left + right) / 2, max(right - left, KEY_WIDTH * (top - bottom)) / 2
    points = rr.Points2D(
        [(x, y) for x in (middle - half, middle, middle + half)],
        labels=["0 mm", f"{top_mm / 2:g} mm", f"≥ {top_mm:g} mm"],
        colors=[colours.ERRORS[k] for k in (0, len(colours.ERRORS) // 2, -1)],
        radii=rr.Radius.ui_points(0),
        show_labels=True,
    )
    sink.recording.log("/path/key", points, static=True)
    frame.include(np.array([[(left + right) / 2, frame.high[1] + KEY_ROOM * (top - bottom)]]))


def round_number(value: float) -> float:
    """The nearest of 1, 1.5, 2, 3, 5, 7.5 times a power of ten, by ratio."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(min((f * power for f in ROUND), key=lambda near: abs(np.log(near / value))))


def circle(region: "Region") -> F64:
    """The region's edge as a closed polygon (65, 2)."""
    angle = np.linspace(0, 2 * np.pi, CORNERS + 1)
    return np.stack(
        [region.x_m + region.radius_m * np.cos(angle), region.y_m + region.radius_m * np.sin(angle)], axis=1
    )
