"""Trends of a fleet: α, gap, shares and detectable sizes over the dates of the logs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wmr_replay.report import charts
from wmr_replay.report.charts import Columns, Figure, Key, Spec, numbers
from wmr_replay.report.fleet_logs import (
    FleetLog,
    Judged,
    date_ms,
    date_of,
    have_dates,
    is_odd,
    numbers_of,
    short_name,
)
from wmr_replay.report.modes import COLOURS
from wmr_replay.timeline.colours import mode_name
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.modes import MODES, ContactMode

BLUE, ODD_COLOUR = "#23638a", "#d55e00"
NORMAL_95 = 1.96
TITLES = {
    "alpha": "α [(m/s²)/(N·m)], with its 95 % interval",
    "wheel_scale": "Wheel scale, with its 95 % interval",
    "gap_mm": "Held-out gap of the base model [mm]",
    "accuracy": "Accuracy",
}
WITH_SD = ("alpha", "wheel_scale")
LEAST_SIZES = ("viscous_drag", "payload")
"""Effects whose smallest detectable size is drawn: one that grows with the speed, one with the torque."""
NO_RULE = Judged("", "", "", 0.2, relative=True)


@dataclass(frozen=True)
class Row:
    """The logs in the order in which they are drawn: by date (``at`` in ms since 1970), or by number."""

    logs: Sequence[FleetLog]
    at: list[float]
    names: list[str]
    dates: bool


def trends(logs: Sequence[FleetLog], shown: Sequence[Judged]) -> list[Figure]:
    """The figures of a fleet; none for a single log."""
    if len(logs) < 2:
        return []
    row, judged = row_of(logs), {one.name: one for one in shown}
    figures = []
    for name, title in TITLES.items():
        if name in judged:
            values = numbers_of(row.logs, name)
            half = NORMAL_95 * numbers_of(row.logs, f"{name}_sd") if name in WITH_SD else None
            figures.append(trend_figure(name, title, row, values, is_odd(values, judged[name]), half))
    return [*figures, shares_figure(row), *detectable_figures(row)]


def row_of(logs: Sequence[FleetLog]) -> Row:
    """The logs by their dates; those without one are left out where the others have one."""
    dates = have_dates(logs)
    kept = [log for log in logs if not dates or date_of(log)]
    if dates:
        kept.sort(key=lambda log: log.start_ns or 0)
    at = [date_ms(log) for log in kept] if dates else [float(k + 1) for k in range(len(kept))]
    return Row(kept, at, [short_name(log) for log in kept], dates)


def horizontal(field: str, *, dates: bool) -> Spec:
    """The axis of dates, or of numbers of logs."""
    kind = (
        {"type": "temporal", "scale": {"type": "utc", "padding": 10}}
        if dates
        else {"type": "quantitative", "scale": {"zero": False, "nice": False, "padding": 10}}
    )
    axis: Spec = {
        "title": "start (UTC)" if dates else "log",
        "tickCount": {"expr": "width / 90"},
        "grid": False,
    }
    if not dates:
        axis |= {"format": "d", "labelExpr": "datum.value % 1 ? '' : datum.label"}
    return {"field": field} | kind | {"axis": axis}


def trend_figure(name: str, title: str, row: Row, values: F64, odd: Bool, half: F64 | None = None) -> Figure:
    """A number of each log over its date, with an interval of ± ``half``, the odd ones in orange."""
    key = f"trend_{name}"
    half = np.full(len(values), np.nan) if half is None else half
    data: Columns = {
        "x": row.at,
        "y": numbers(values),
        "low": numbers(values - half),
        "high": numbers(values + half),
        "s": row.names,
        "c": [ODD_COLOUR if one else BLUE for one in odd],
    }
    axis = {"title": None, "tickCount": 5, "minExtent": 46, "maxExtent": 46}
    y = charts.quantity("y", scale={"zero": False, "nice": True}, axis=axis)
    place = {"x": horizontal("x", dates=row.dates), "y": y}
    colour = {"color": {"field": "c", "type": "nominal", "scale": None}}
    tip = [{"field": "s", "title": "log"}, {"field": "y", "title": title.partition(",")[0]}]
    marks: list[tuple[Spec, Spec]] = [
        ({"type": "line", "color": "#c3ccd6", "strokeWidth": 1.2}, place),
        (
            {"type": "rule", "strokeWidth": 1.5},
            place | {"y": y | {"field": "low"}, "y2": {"field": "high"}} | colour,
        ),
        ({"type": "circle", "size": 60, "opacity": 1}, place | colour | {"tooltip": tip}),
    ]
    if not np.isfinite(half).any():
        del marks[1]
    layers = [{"data": {"name": key}, "mark": mark, "encoding": encoding} for mark, encoding in marks]
    entries = [Key(BLUE, "log", "dot")] + ([Key(ODD_COLOUR, "odd", "dot")] if odd.any() else [])
    return Figure(key, title, charts.specification(layers, 170, {"data": [key]}), {key: data}, entries)


def shares_figure(row: Row) -> Figure:
    """Shares of the modes of each log, stacked."""
    data: Columns = {"x": [], "y": [], "y2": [], "c": [], "s": [], "m": [], "p": []}
    seen = []
    for log, x, name in zip(row.logs, range(1, len(row.at) + 1), row.names, strict=True):
        low = 0.0
        for mode in (*MODES, ContactMode.UNDECIDED):
            share = log.number(f"share_{mode.label}") or 0.0
            if share > 0:
                one = {"x": x, "y": round(low, 4), "y2": round(low + share, 4), "c": COLOURS[mode], "s": name}
                for column, value in (one | {"m": mode_name(mode), "p": f"{share:.1%}"}).items():
                    data[column].append(value)
                low += share
                seen.append(mode)
    tip = [{"field": "s", "title": "log"}, {"field": "m", "title": "mode"}, {"field": "p", "title": "share"}]
    x_axis: Spec = {
        "title": "log, in the order of dates" if row.dates else "log",
        "labels": len(row.at) <= 60,
        "labelAngle": 0,
        "ticks": False,
    }
    layer: Spec = {
        "data": {"name": "shares"},
        "mark": {"type": "rect"},
        "encoding": {
            "x": {"field": "x", "type": "ordinal", "axis": x_axis, "scale": {"paddingInner": 0.15}},
            "y": charts.quantity(
                "y",
                scale={"domain": [0, 1]},
                axis={"title": None, "format": ".0%", "tickCount": 5, "minExtent": 46, "maxExtent": 46},
            ),
            "y2": {"field": "y2"},
            "color": {"field": "c", "type": "nominal", "scale": None},
            "tooltip": tip,
        },
    }
    key = [Key(COLOURS[mode], mode_name(mode)) for mode in (*MODES, ContactMode.UNDECIDED) if mode in seen]
    return Figure(
        "shares",
        "Shares of the contact modes",
        charts.specification([layer], 170, {"data": ["shares"]}),
        {"shares": data},
        key,
    )


def detectable_figures(row: Row) -> list[Figure]:
    """The smallest size of some effects that each log would have shown, where a gap analysis says so."""
    figures = []
    for effect in LEAST_SIZES:
        found = [None if log.gap is None else log.gap.minimum_detectable.get(effect) for log in row.logs]
        values = np.array([np.nan if one is None or one.value is None else one.value for one in found])
        if np.isfinite(values).sum() >= 2:
            unit = next(one.unit for one in found if one is not None)
            title = f"Smallest {effect} that would be seen" + ("" if unit == "1" else f" [{unit}]")
            figures.append(trend_figure(f"least_{effect}", title, row, values, is_odd(values, NO_RULE)))
    return figures
