"""Figures as Vega-Lite: plots over time, paths in the plane, scatters.

A figure is plain data: a specification, and the columns that it draws by the name of their data set. The page
turns columns into rows and gives a figure its width, so that one page serves a phone and a wide screen.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wmr_replay.report.bundle import SCHEMA

Spec = dict[str, Any]
Columns = dict[str, list[Any]]
STEPS = 4000
"""A drawn number is rounded to its column's range divided by this: less than a pixel."""
LEFT = 58
"""Width of the vertical axis: plots over time stand exactly below one another."""
INK, SOFT, GRID = "#3a424f", "#5b6472", "#e6e9ee"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"
CONFIG: Spec = {
    "font": FONT,
    "view": {"stroke": None},
    "axis": {
        "labelColor": INK,
        "titleColor": INK,
        "labelFontSize": 11,
        "titleFontSize": 11.5,
        "titleFontWeight": "normal",
        "gridColor": GRID,
        "domainColor": "#aab1bc",
        "tickColor": "#aab1bc",
        "tickSize": 4,
        "labelFlush": False,
    },
}
NEVER_S = -1e12


@dataclass(frozen=True)
class Key:
    """An entry of a figure's key: colour, name, and form: ``box, line, dash, dot`` or ``ring``."""

    colour: str
    name: str
    form: str = "box"


@dataclass(frozen=True)
class Read:
    """A value that a plot says below the pointer: name, data set, column, and the column of its time.

    With ``row`` it is the span of that row of a lane chart in which the time lies.
    """

    name: str
    data: str
    field: str
    row: int | None = None

    def as_json(self) -> Spec:
        """As the page's script takes it."""
        one: Spec = {"name": self.name, "data": self.data, "field": self.field}
        return one if self.row is None else one | {"span": True, "where": ["r", self.row]}


@dataclass(frozen=True)
class Figure:
    """One figure: its title, what the reader should see, its key, specification and data."""

    name: str
    title: str
    spec: Spec
    data: Mapping[str, Columns]
    key: Sequence[Key] = field(default_factory=tuple)
    note: str = ""


def renamed(figure: Figure, suffix: str) -> Figure:
    """The figure with data sets of its own names, so that a page can hold two of a kind."""
    names = {name: f"{name}_{suffix}" for name in figure.data}

    def named(value: Any) -> Any:
        if isinstance(value, str):
            return names.get(value, value)
        if isinstance(value, Mapping):
            return {key: named(inner) for key, inner in value.items()}
        return [named(inner) for inner in value] if isinstance(value, list | tuple) else value

    data = {names[name]: columns for name, columns in figure.data.items()}
    return replace(figure, name=f"{figure.name}_{suffix}", spec=named(figure.spec), data=data)


def numbers(values: NDArray[Any]) -> list[float | None]:
    """Numbers for a page: rounded to less than a pixel, null where they are not finite."""
    values = np.asarray(values, np.float64)
    known = values[np.isfinite(values)]
    if not len(known):
        return [None] * len(values)
    span = float(np.ptp(known)) or abs(float(known[0])) or 1.0
    digits = max(0, math.ceil(-math.log10(span / STEPS)))
    shown = np.round(values, digits).tolist()
    return [value if math.isfinite(value) else None for value in shown]


def quantity(name: str, **more: Any) -> Spec:
    """A column of numbers on its scale as it is."""
    return {"field": name, "type": "quantitative", **more}


def line(
    data: str, y: str, colour: str, *, width: float = 1.3, dash: Sequence[int] = (), x: str = "t"
) -> Spec:
    """A line over time; it breaks where a value is null."""
    mark = {"type": "line", "color": colour, "strokeWidth": width, "clip": True, "strokeJoin": "round"}
    return {
        "data": {"name": data},
        "mark": mark | ({"strokeDash": list(dash)} if dash else {}),
        "encoding": {"x": quantity(x), "y": quantity(y)},
    }


def band(data: str, low: str, high: str, colour: str, opacity: float = 0.2) -> Spec:
    """The area between two lines."""
    mark = {"type": "area", "color": colour, "opacity": opacity, "clip": True, "line": False}
    return {
        "data": {"name": data},
        "mark": mark,
        "encoding": {"x": quantity("t"), "y": quantity(low), "y2": {"field": high}},
    }


def shade(data: str, opacity: float = 0.15) -> Spec:
    """Spans of time in their own colours (columns ``t, t2, c``), over the whole height."""
    return {
        "data": {"name": data},
        "mark": {"type": "rect", "opacity": opacity, "clip": True},
        "encoding": {
            "x": quantity("t"),
            "x2": {"field": "t2"},
            "color": {"field": "c", "type": "nominal", "scale": None},
        },
    }


def blocks(data: str) -> Spec:
    """Rectangles in their own colours: ``t`` to ``t2``, ``y`` to ``y2``."""
    colour = {"field": "c", "type": "nominal", "scale": None}
    place = {"x": quantity("t"), "x2": {"field": "t2"}, "y": quantity("y"), "y2": {"field": "y2"}}
    return {
        "data": {"name": data},
        "mark": {"type": "rect", "clip": True},
        "encoding": place | {"color": colour},
    }


def level(value: float, colour: str, dash: Sequence[int] = (5, 4), width: float = 1.1) -> Spec:
    """A level line."""
    mark = {"type": "rule", "color": colour, "strokeDash": list(dash), "strokeWidth": width, "clip": True}
    return {
        "data": {"values": [{}]},
        "mark": mark,
        "encoding": {"y": {"datum": value, "type": "quantitative"}},
    }


def over_time(
    layers: Sequence[Spec],
    span_s: tuple[float, float],
    height: int,
    *,
    data: Sequence[str],
    readout: Sequence[Read] = (),
    domain: tuple[float, float] | None = None,
    rows: Mapping[float, str] | None = None,
    time_title: bool = True,
) -> Spec:
    """A plot over time. ``rows`` names heights on the vertical axis in place of numbers."""
    hover: Spec = {
        "data": {"values": [{}]},
        "mark": {"type": "rule", "color": INK, "strokeWidth": 1, "opacity": 0.65, "clip": True},
        "encoding": {"x": {"datum": {"expr": "hover_s"}, "type": "quantitative"}},
    }
    vertical: Spec = {
        "scale": {"zero": False, "nice": domain is None, **({"domain": list(domain)} if domain else {})}
    }
    axis: Spec = {"title": None, "minExtent": LEFT, "maxExtent": LEFT}
    if rows is None:
        axis["tickCount"] = 4
    else:
        said = ": ".join(f"abs(datum.value - {at}) < 0.01 ? '{name}'" for at, name in rows.items())
        axis |= {
            "values": list(rows),
            "labelExpr": f"{said} : ''",
            "grid": False,
            "ticks": False,
            "domain": False,
        }
    across = {
        "title": "time [s]" if time_title else None,
        "grid": rows is None,
        "tickCount": {"expr": "width / 70"},
    }
    layered = [*layers, hover]
    for layer in layered:
        if "x" in layer["encoding"]:
            layer["encoding"]["x"] |= {"scale": {"domain": list(span_s), "nice": False}, "axis": across}
        if "y" in layer["encoding"]:
            layer["encoding"]["y"] |= vertical | {"axis": axis}
    meta = {"time": True, "data": list(data), "readout": [one.as_json() for one in readout]}
    return specification(layered, height, meta) | {"params": [{"name": "hover_s", "value": NEVER_S}]}


def specification(layers: Sequence[Spec], height: int, meta: Spec) -> Spec:
    """A layered figure; ``meta`` is for the page's script."""
    return {
        "$schema": SCHEMA,
        "height": height,
        "autosize": {"type": "fit-x", "contains": "padding"},
        "padding": {"left": 2, "right": 12, "top": 6, "bottom": 2},
        "layer": list(layers),
        "resolve": {"legend": {"color": "independent"}},
        "config": CONFIG,
        "usermeta": meta,
    }


def stroke(
    data: str,
    colour: str | None,
    *,
    width: float,
    opacity: float = 1.0,
    by: str = "k",
    tip: Sequence[Spec] = (),
) -> Spec:
    """A path: pieces (column ``by``) in the order of their rows, in one colour or each in its own, ``c``."""
    mark: Spec = {
        "type": "line",
        "strokeWidth": width,
        "opacity": opacity,
        "strokeCap": "round",
        "strokeJoin": "round",
    }
    drawn: Spec = {
        "x": quantity("x"),
        "y": quantity("y"),
        "detail": {"field": by, "type": "nominal"},
        "order": quantity("t"),
    }
    if colour is None:
        drawn["color"] = {"field": "c", "type": "nominal", "scale": None}
    else:
        mark["color"] = colour
    if tip:
        drawn["tooltip"] = list(tip)
    return {"data": {"name": data}, "mark": mark, "encoding": drawn}


def dots(
    data: str, colour: str | None, *, size: float = 14, opacity: float = 0.7, tip: Sequence[Spec] = ()
) -> Spec:
    """Points at ``x, y``, in one colour or each in its own, ``c``."""
    mark: Spec = {"type": "circle", "size": size, "opacity": opacity, "clip": True}
    drawn: Spec = {"x": quantity("x"), "y": quantity("y")}
    if colour is None:
        drawn["color"] = {"field": "c", "type": "nominal", "scale": None}
    else:
        mark["color"] = colour
    if tip:
        drawn["tooltip"] = list(tip)
    return {"data": {"name": data}, "mark": mark, "encoding": drawn}


def labels(data: str, *, colour: str = INK, dy: int = -12, bold: bool = False) -> list[Spec]:
    """Text ``s`` at ``x, y``: white and broad below, so that it stays readable on a line."""
    place = {"x": quantity("x"), "y": quantity("y"), "text": {"field": "s"}}
    mark = {"type": "text", "dy": dy, "fontSize": 11.5, "fontWeight": "bold" if bold else "normal"}
    edge = {"stroke": "white", "strokeWidth": 4, "strokeJoin": "round", "opacity": 0.85, "color": "white"}
    return [
        {"data": {"name": data}, "mark": mark | ink, "encoding": dict(place)}
        for ink in (edge, {"color": colour})
    ]


def in_plane(
    layers: Sequence[Spec], box: Sequence[float], data: Sequence[str], *, place: str | None = None
) -> Spec:
    """A figure of the plane, both axes in metres of one length. ``box``: x from, x to, y from, y to.

    ``place``: the data set with ``t, x, y`` on which the pointer over a plot over time marks a place.
    """
    robot: Spec = {
        "data": {"values": [{}]},
        "mark": {
            "type": "point",
            "shape": "circle",
            "filled": False,
            "size": 150,
            "color": INK,
            "strokeWidth": 2.5,
            "opacity": {"expr": "hover_x == null ? 0 : 1"},
        },
        "encoding": {axis: {"datum": {"expr": f"hover_{axis}"}, "type": "quantitative"} for axis in "xy"},
    }
    layered = [*layers, robot]
    for layer in layered:
        for axis in "xy":
            extent = {"minExtent": 34, "maxExtent": 34} if axis == "y" else {}
            count = {"expr": "width / 80" if axis == "x" else "height / 50"}
            layer["encoding"][axis] |= {"axis": {"title": f"{axis} [m]", "tickCount": count, **extent}}
    meta: Spec = {"box": [float(edge) for edge in box], "data": list(data)} | (
        {"place": place} if place else {}
    )
    params = [{"name": "hover_x", "value": None}, {"name": "hover_y", "value": None}]
    return specification(layered, 300, meta) | {"params": params}


def cloud(
    layers: Sequence[Spec],
    x_title: str,
    y_title: str,
    data: Sequence[str],
    *,
    height: int = 260,
    y_domain: tuple[float, float] | None = None,
) -> Spec:
    """A scatter."""
    for layer in layers:
        encoding = layer["encoding"]
        if "x" in encoding:
            encoding["x"] |= {
                "scale": {"zero": False, "nice": False, "padding": 6},
                "axis": {"title": x_title, "tickCount": {"expr": "width / 70"}},
            }
        if "y" in encoding:
            scale: Spec = (
                {"zero": False, "nice": True}
                if y_domain is None
                else {"domain": list(y_domain), "nice": False}
            )
            encoding["y"] |= {
                "scale": scale,
                "axis": {"title": y_title, "tickCount": 5, "minExtent": 40, "maxExtent": 40},
            }
    return specification(layers, height, {"data": list(data)})
