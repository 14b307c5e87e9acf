"""The path in the plane: strips by mode, the frame around it, and a grid in metres."""

import math
from dataclasses import dataclass, replace

import numpy as np
import rerun as rr

from wmr_replay.timeline import colours
from wmr_schemas.arrays import F64, I8, I64


@dataclass(frozen=True)
class LabelRoom:
    """Room for the grid's labels on the left and below, and their distance from these edges: shares of the
    longer side. A label has a fixed size on the screen, and so a larger share of a small view.
    """

    room: tuple[float, float] = (0.16, 0.1)
    inset: tuple[float, float] = (0.085, 0.075)
    tall: float = 1.0
    """By how much more room the labels on the left need where the path is taller than wide: drawn smaller."""

    def for_sides(self, sides: F64) -> "LabelRoom":
        """For a path of a width and a height."""
        if sides[1] <= sides[0]:
            return self
        (room, below), (inset, up) = self.room, self.inset
        return replace(self, room=(room * self.tall, below), inset=(inset * self.tall, up))


SMALL_VIEW = LabelRoom((0.24, 0.18), (0.08, 0.13), tall=2.0)
"""For a view that has a third of the window's height, and is wider than high."""


@dataclass(frozen=True, eq=False)
class Strips:
    """Consecutive pieces of one path: point lists, the mode of each, and the row at which each starts."""

    points: list[F64]
    modes: I8
    first_rows: I64


def strips_by_mode(xy: F64, mode: I8) -> Strips:
    """Cut the path ``xy`` (n, 2) where ``mode`` (n,) changes.

    The step from a row to the next has the mode of the first of the two, so that the pieces join. A single
    row has no step.
    """
    starts = np.flatnonzero(np.concatenate(([True], mode[1:] != mode[:-1])))
    starts = starts[starts < len(xy) - 1]
    ends = np.append(starts[1:], len(xy) - 1)[: len(starts)] + 1
    points = [xy[start:end] for start, end in zip(starts, ends, strict=True)]
    return Strips(points, mode[starts], starts)


class Frame:
    """The smallest rectangle around all points seen."""

    def __init__(self, labels: LabelRoom = LabelRoom()) -> None:
        self.labels = labels
        self.low, self.high = np.full(2, np.inf), np.full(2, -np.inf)

    def include(self, xy: F64) -> None:
        """Widen the rectangle to hold ``xy`` (n, 2)."""
        self.low, self.high = np.minimum(self.low, xy.min(axis=0)), np.maximum(self.high, xy.max(axis=0))

    def sides(self) -> F64:
        """Width and height; at least 1 m, and neither less than a quarter of the other."""
        size = self.high - self.low
        longer = max(1.0, float(size.max()))
        sides: F64 = np.maximum(size, longer / 4)
        return sides

    def with_margin(self, share: float = 0.06) -> tuple[F64, F64]:
        """Lower and upper corner, widened by a share of the longer side, and by room for the grid's labels on
        the left and below.
        """
        sides, middle = self.sides(), (self.low + self.high) / 2
        room = sides.max() * np.array(self.labels.for_sides(sides).room)
        half = sides / 2 + share * sides.max()
        return middle - half - room, middle + half


def grid_step_m(side_m: float, lines: int = 4) -> float:
    """A step of 1, 2 or 5 times a power of ten that puts about ``lines`` lines across ``side_m``."""
    raw = side_m / lines
    power = 10.0 ** math.floor(math.log10(raw))
    return float(next(factor * power for factor in (1, 2, 5, 10) if factor * power >= raw * 0.999))


def grid(frame: Frame) -> tuple[list[F64], F64, list[str]]:
    """Lines of constant x and y inside the frame, and for each the place and text of its label.

    No line goes through the room for labels, where two of them would overlap.
    """
    low, high = frame.with_margin()
    labels = frame.labels.for_sides(frame.sides())
    first = low + frame.sides().max() * np.array(labels.room)
    step = grid_step_m(float((high - first).max()))
    inset = (high - low).max() * np.diag(labels.inset)
    lines, places, texts = [], [], []
    for axis, name in enumerate("xy"):
        for k in range(math.ceil(first[axis] / step), math.floor(high[axis] / step) + 1):
            ends = np.array([low, high])
            ends[:, axis] = k * step
            lines.append(ends)
            places.append(ends[0] + inset[1 - axis])
            texts.append(f"{name} = {k * step:g} m")
    return lines, np.array(places).reshape(-1, 2), texts


def log_scene(recording: rr.RecordingStream) -> None:
    """Log what is static below ``/path``: y upwards (Rerun's plane has it downwards), mode colours."""
    infos = [
        rr.AnnotationInfo(colours.class_id(mode), colours.mode_name(mode), colour)
        for mode, colour in colours.MODE_COLOURS.items()
    ]
    recording.log("/path", rr.AnnotationContext(infos), rr.Transform3D(scale=[1, -1, 1]), static=True)


def pen(colour: colours.Colour | None, width: float, order: float) -> rr.LineStrips2D:
    """How every piece of a path is drawn. To be logged as static: what is drawn later lies no higher then."""
    radii = rr.Radius.ui_points(width)
    return rr.LineStrips2D.from_fields(colors=colour, radii=radii, show_labels=False, draw_order=order)


def pieces(points: list[F64]) -> rr.LineStrips2D:
    """The points of every piece, for a pen to draw."""
    return rr.LineStrips2D.from_fields(strips=points)


def strip_columns(strips: Strips) -> rr.ComponentColumnList:
    """The pieces as Rerun's columns, one row a piece, coloured by their class; the pen is logged once."""
    classes = [colours.class_id(int(mode)) for mode in strips.modes]
    return rr.LineStrips2D.columns(strips=strips.points, class_ids=classes)


def true_strip_columns(xy: F64) -> rr.ComponentColumnList:
    """One piece of the true path, thin and light over the measured one, which noise makes broad."""
    return rr.LineStrips2D.columns(strips=[xy])


def log_grid(recording: rr.RecordingStream, frame: Frame) -> None:
    """A labelled grid behind the path."""
    lines, places, texts = grid(frame)
    thin, none = rr.Radius.ui_points(0.5), rr.Radius.ui_points(0)
    recording.log(
        "/path/grid/lines",
        rr.LineStrips2D(lines, colors=colours.GRID, radii=thin, draw_order=-10),
        static=True,
    )
    labels = rr.Points2D(
        places, labels=texts, show_labels=True, colors=colours.GRID_LABEL, radii=none, draw_order=-5
    )
    recording.log("/path/grid/labels", labels, static=True)
