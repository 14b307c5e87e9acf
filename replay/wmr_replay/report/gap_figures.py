"""The figures of a gap analysis: paths by error, the residual over its variable and over time, errors."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import polars as pl

from wmr_replay.report import charts
from wmr_replay.report.charts import Columns, Figure, Key, Read, Spec, numbers
from wmr_replay.report.decimate import extremes, path_rows
from wmr_replay.report.paths import box_of, pieces_of
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.gap_file import Against, Effect, GapFile, Interval, Region

BEFORE, AFTER, UNKNOWN, INK = "#d55e00", "#1f78b4", "#c3c8d0", "#3a424f"
HEAT = ("#f6d860", "#f2a93b", "#e5732f", "#c43c39", "#7d1f5e")
"""Levels of the error on white paper, from small to large."""
MARK = "#111827"
HELD_OUT, SLIPPING = "#e4e7ec", "#f3d9ec"
RESIDUALS = {
    "longitudinal": "residual of dv/dt [m/s²]",
    "lateral": "lateral velocity left over [m/s]",
    "yaw": "residual of half track · yaw acceleration [m/s²]",
}
SLIP_VELOCITIES = {
    "longitudinal": "velocity ahead left over [m/s]",
    "lateral": "lateral velocity left over [m/s]",
    "yaw": "yaw rate left over [rad/s]",
}
"""The residuals where wheel speeds drive the model."""
QUANTITIES = {
    "t_s": "time [s]",
    "distance_m": "distance from the disc's centre [m]",
    "x_m": "x [m]",
    "y_m": "y [m]",
    "v_mps": "longitudinal velocity [m/s]",
    "v_lat_mps": "lateral velocity [m/s]",
    "yaw_rate_radps": "yaw rate [rad/s]",
    "yaw_rad": "heading [rad]",
    "effort_sum_nm": "sum of the torques [N·m]",
    "effort_diff_nm": "right minus left torque [N·m]",
    "effort_sum_rate_nmps": "rate of change of the torques' sum [N·m/s]",
}
CELLS = (160, 90)
"""Cells of a scatter across and upwards, each of which keeps one point."""
BINS = 14
MOST_MARKED = 3


def values(traces: pl.DataFrame, name: str) -> F64:
    """A column with NaN where it is null; a heading between −π and π."""
    found = traces[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
    return np.angle(np.exp(1j * found)) if name == "yaw_rad" else found


def path_figures(gap: GapFile, traces: pl.DataFrame) -> list[Figure | None]:
    """The measured path in the colours of the base model's error, and of the extended model's: one scale."""
    error = values(traces, "base_error_m")
    known = error[np.isfinite(error)]
    if len(known) < 2:
        return []
    edges = round_edges(float(np.percentile(known, 98)))
    key = [Key(colour, said) for colour, said in zip(HEAT, level_words(edges), strict=True)]
    first = path_figure("before", "Path by error of the base model", traces, edges, marks=gap, key=key)
    if not gap.effects:
        return [first]
    return [
        first,
        path_figure("after", f"The same with {said(gap)} in the model", traces, edges, marks=None, key=key),
    ]


def said(gap: GapFile) -> str:
    """The effects by name, and the formulas as such."""
    formulas = "the formulas" if len(gap.formulas) > 1 else "the formula"
    return " and ".join([*(effect.name for effect in named(gap)), *([formulas] if gap.formulas else [])])


def named(gap: GapFile) -> list[Effect]:
    """The effects that are no terms of a formula."""
    terms = {name for one in gap.formulas for name in one.terms}
    return [effect for effect in gap.effects if effect.name not in terms]


def round_edges(largest: float) -> F64:
    """Four edges of five levels of error, in round numbers."""
    step = largest / 5
    digits = 10.0 ** np.floor(np.log10(step)) if step > 0 else 1e-3
    step = float(np.ceil(2 * step / digits) / 2 * digits)
    return step * np.arange(1.0, 5.0)


def level_words(edges: F64) -> list[str]:
    """The levels in words, in millimetres."""
    mm = [f"{float(f'{1e3 * edge:.3g}'):g}" for edge in edges]
    return [
        f"below {mm[0]} mm",
        *(f"{a}–{b}" for a, b in pairwise(mm)),
        f"above {mm[-1]} mm",
    ]


def path_figure(
    name: str, title: str, traces: pl.DataFrame, edges: F64, *, marks: GapFile | None, key: list[Key]
) -> Figure:
    """The measured path in levels of a model's error; ``marks``: places, stretches and discs to mark."""
    model = "base" if name == "before" else "extended"
    x, y, t_s = (values(traces, column) for column in ("x_m", "y_m", "t_s"))
    error = values(traces, f"{model}_error_m")
    level = np.where(np.isfinite(error), np.searchsorted(edges, np.nan_to_num(error)), -1)
    switch = np.diff(level, prepend=level[0]) != 0
    data = {f"path_{name}": coloured(x, y, t_s, level, error, path_rows(x, y, switch))}
    tip = [{"field": "t", "title": "time [s]"}, {"field": "e", "title": "error [mm]"}]
    layers: list[Spec] = []
    if marks is not None:
        data["stretches"] = stretches(marks.where.intervals, x, y, t_s)
        layers.append(charts.stroke("stretches", MARK, width=11, opacity=0.16))
    layers.append(charts.stroke(f"path_{name}", None, width=3.2, tip=tip))
    if marks is not None:
        data["discs"], data["said"] = discs(marks), stretch_labels(marks, x, y, t_s)
        below = bool(found_discs(marks))
        data["disc_names"] = disc_labels(marks)
        layers += [charts.stroke("discs", MARK, width=1.6), *charts.labels("disc_names", bold=True)]
        layers += charts.labels("said", bold=True, dy=24 if below else -12)
        if len(key) == len(HEAT) and data["stretches"]["x"]:
            key = [*key, Key("#d9dade", "when most of the error arises")]
        if data["discs"]["x"]:
            key = [*key, Key(MARK, "where most of it arises", "ring")]
    data = {one: columns for one, columns in data.items() if columns["x"]}
    layers = [layer for layer in layers if layer["data"]["name"] in data]
    spec = charts.in_plane(layers, box_of(x, y), list(data), place=f"path_{name}")
    return Figure(f"path-{name}", title, spec, data, key)


def coloured(x: F64, y: F64, t_s: F64, level: I64, error: F64, rows: I64) -> Columns:
    """A path in pieces of one level; each piece ends where the next begins."""
    pieces = pieces_of(level, rows)
    at = pieces.rows
    return {
        "t": numbers(t_s[at]),
        "x": numbers(x[at]),
        "y": numbers(y[at]),
        "k": pieces.piece.tolist(),
        "c": [HEAT[k] if k >= 0 else UNKNOWN for k in pieces.state.tolist()],
        "e": numbers(1e3 * error[at]),
    }


def stretches(intervals: Sequence[Interval], x: F64, y: F64, t_s: F64) -> Columns:
    """The path within the marked stretches of time."""
    out: Columns = {"t": [], "x": [], "y": [], "k": []}
    for k, one in enumerate(intervals[:MOST_MARKED]):
        inside = np.flatnonzero((t_s >= one.start_s) & (t_s <= one.end_s))
        rows = inside[path_rows(x[inside], y[inside], np.zeros(len(inside), bool))] if len(inside) else inside
        for name, column in (("t", t_s), ("x", x), ("y", y)):
            out[name] += numbers(column[rows])
        out["k"] += [k] * len(rows)
    return out


def stretch_labels(gap: GapFile, x: F64, y: F64, t_s: F64) -> Columns:
    """What is written at the middle of each marked stretch."""
    out: Columns = {"x": [], "y": [], "s": []}
    for one in gap.where.intervals[:MOST_MARKED]:
        at = int(np.argmin(np.abs(t_s - (one.start_s + one.end_s) / 2)))
        share = "" if one.share is None else f" · {one.share:.0%}"
        out["x"].append(float(x[at]))
        out["y"].append(float(y[at]))
        out["s"].append(f"{one.start_s:.0f}–{one.end_s:.0f} s{share}")
    return out


def disc_labels(gap: GapFile) -> Columns:
    """The names of the effects that act in a disc, at its upper edge."""
    found = found_discs(gap)
    return {
        "x": [x_m for _, (x_m, _, _) in found],
        "y": [y_m + radius_m for _, (_, y_m, radius_m) in found],
        "s": [name for name, _ in found],
    }


def found_discs(gap: GapFile) -> list[tuple[str, tuple[float, float, float]]]:
    """The discs of effects that act in a region: name, centre, radius."""
    found = []
    for effect in gap.effects:
        sizes = [effect.parameters.get(key) for key in ("x_m", "y_m", "radius_m")]
        if all(size is not None and size.value is not None for size in sizes):
            x_m, y_m, radius_m = (float(size.value) for size in sizes)  # type: ignore[union-attr, arg-type]
            found.append((effect.name, (x_m, y_m, radius_m)))
    return found


def discs(gap: GapFile) -> Columns:
    """The edges of the places with most of the error, and of the discs of effects."""
    places: list[tuple[float, float, float]] = [disc for _, disc in found_discs(gap)]
    places += [(r.x_m, r.y_m, r.radius_m) for r in gap.where.regions[:MOST_MARKED] if isinstance(r, Region)]
    angle = np.linspace(0, 2 * np.pi, 41)
    out: Columns = {"t": [], "x": [], "y": [], "k": []}
    for k, (x_m, y_m, radius_m) in enumerate(places):
        out["t"] += np.round(angle, 3).tolist()
        out["x"] += np.round(x_m + radius_m * np.cos(angle), 3).tolist()
        out["y"] += np.round(y_m + radius_m * np.sin(angle), 3).tolist()
        out["k"] += [k] * len(angle)
    return out


class Shown(NamedTuple):
    """What a scatter shows: its name and words, the residual, the quantity, and the table with the curve."""

    name: str
    words: str
    residual: str
    variable: str
    against: Against | None
    centre: tuple[float, float] = (np.nan, np.nan)


def shown_of(gap: GapFile) -> list[Shown]:
    """Each effect's residual over the quantity that it follows, and each formula's."""
    found = [
        Shown(one.name, one.name, one.residual, one.variable, one.against, centre_of(one))
        for one in named(gap)
    ]
    return found + [
        Shown(f"formula_{one.channel}", "the formula", one.channel, one.variable, one.against)
        for one in gap.formulas
    ]


def centre_of(effect: Effect) -> tuple[float, float]:
    """The middle of the disc in which an effect acts, m; NaN where it has none."""
    found = [effect.parameters[key].value if key in effect.parameters else None for key in ("x_m", "y_m")]
    x_m, y_m = (np.nan if one is None else one for one in found)
    return x_m, y_m


def variable_of(shown: Shown, traces: pl.DataFrame) -> F64:
    """The quantity that a residual follows, at each row."""
    if shown.variable != "distance_m":
        return values(traces, shown.variable)
    x_m, y_m = shown.centre
    return np.hypot(values(traces, "x_m") - x_m, values(traces, "y_m") - y_m)


def residuals_of(gap: GapFile) -> Mapping[str, str]:
    """The residuals of a base model, in words."""
    return SLIP_VELOCITIES if gap.base_model == "wheel_speed" else RESIDUALS


def scatter_figure(
    shown: Shown, traces: pl.DataFrame, residuals: Mapping[str, str] = RESIDUALS
) -> Figure | None:
    """The residual over the quantity that it follows, before and after: clouds and the median of each bin."""
    if shown.residual not in RESIDUALS or shown.variable not in QUANTITIES:
        return None
    x = variable_of(shown, traces)
    before, after = (values(traces, f"{model}_residual_{shown.residual}") for model in ("base", "extended"))
    known = np.isfinite(x) & np.isfinite(before) & np.isfinite(after)
    if known.sum() < BINS:
        return None
    x, before, after = x[known], before[known], after[known]
    edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
    name = f"scatter_{shown.name}"
    data = {
        f"{name}_0": cell_points(x, before),
        f"{name}_1": cell_points(x, after),
        f"{name}_2": medians(x, before, edges),
        f"{name}_3": medians(x, after, edges),
    }
    layers = [
        charts.level(0.0, "#6b7280", (), 1.0),
        charts.dots(f"{name}_0", BEFORE, size=9, opacity=0.32),
        charts.dots(f"{name}_1", AFTER, size=9, opacity=0.32),
        *(median_line(f"{name}_{k}", colour) for k, colour in ((2, BEFORE), (3, AFTER))),
    ]
    if shown.against is not None:
        bins = shown.against.bins
        data[f"{name}_4"] = {"x": [one.at for one in bins], "y": [one.fitted for one in bins]}
        layers.append(fitted_line(f"{name}_4"))
    spec = charts.cloud(layers, QUANTITIES[shown.variable], residuals[shown.residual], list(data), height=300)
    key = [
        Key(BEFORE, "base model", "dot"),
        Key(AFTER, f"with {shown.words}", "dot"),
        Key(INK, "median of a bin", "line"),
    ]
    if shown.against is not None:
        key.append(Key(MARK, "what it explains", "dash"))
    return Figure(name, scatter_title(shown, before, after, residuals), spec, data, key)


def scatter_title(shown: Shown, before: F64, after: F64, residuals: Mapping[str, str]) -> str:
    """What is drawn, and the residual's root mean square before and after."""
    quantity = QUANTITIES[shown.variable].partition(" [")[0]
    sizes = " → ".join(f"{np.sqrt(np.mean(one**2)):.2g}" for one in (before, after))
    unit = residuals[shown.residual].partition(" [")[2].rstrip("]")
    return f"Residual against the {quantity}: {sizes} {unit} rms"


def median_line(data: str, colour: str) -> Spec:
    """The medians of the bins as a line with points on white."""
    mark = {
        "type": "line",
        "color": colour,
        "strokeWidth": 2.6,
        "point": {"filled": True, "fill": colour, "stroke": "white", "strokeWidth": 1.2, "size": 46},
    }
    return {
        "data": {"name": data},
        "mark": mark,
        "encoding": {"x": charts.quantity("x"), "y": charts.quantity("y")},
    }


def fitted_line(data: str) -> Spec:
    """The effect's fitted curve, dashed."""
    mark = {"type": "line", "color": MARK, "strokeWidth": 1.6, "strokeDash": [5, 4]}
    return {
        "data": {"name": data},
        "mark": mark,
        "encoding": {"x": charts.quantity("x"), "y": charts.quantity("y")},
    }


def cell_points(x: F64, y: F64) -> Columns:
    """A point of each cell of a grid: no extreme is lost, and no two points hide one another."""
    across, up = CELLS
    span_x, span_y = float(np.ptp(x)) or 1.0, float(np.ptp(y)) or 1.0
    cell = (across * (x - x.min()) / span_x).astype(np.int64) * (up + 1) + (
        up * (y - y.min()) / span_y
    ).astype(np.int64)
    _, rows = np.unique(cell, return_index=True)
    rows = np.unique(np.concatenate([rows, [x.argmin(), x.argmax(), y.argmin(), y.argmax()]]))
    return {"x": numbers(x[rows]), "y": numbers(y[rows])}


def medians(x: F64, y: F64, edges: F64) -> Columns:
    """Median of each bin between ``edges``."""
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    filled = np.unique(bins)
    return {
        "x": numbers(np.array([np.median(x[bins == k]) for k in filled])),
        "y": numbers(np.array([np.median(y[bins == k]) for k in filled])),
    }


def residual_figure(
    channel: str, traces: pl.DataFrame, *, extended: bool, residuals: Mapping[str, str] = RESIDUALS
) -> Figure:
    """A residual over time, before and after, the held-out windows shaded."""
    lines = {"base": BEFORE} | ({"extended": AFTER} if extended else {})
    columns = {model: f"{model}_residual_{channel}" for model in lines}
    return over_time_figure(
        f"residual_{channel}", f"Over time: {residuals[channel]}", traces, lines, columns, 150, zero=True
    )


def error_figure(traces: pl.DataFrame, *, extended: bool, seconds: str = "4") -> Figure:
    """The distance of measured and simulated position over time."""
    lines = {"base": BEFORE} | ({"extended": AFTER} if extended else {})
    columns = {model: f"{model}_error_m" for model in lines}
    title = f"Error of the position [m], simulated in windows of {seconds} s"
    return over_time_figure("error", title, traces, lines, columns, 150)


def over_time_figure(
    name: str,
    title: str,
    traces: pl.DataFrame,
    lines: dict[str, str],
    columns: dict[str, str],
    height: int,
    *,
    zero: bool = False,
) -> Figure:
    """One line for each model, base below, and the held-out windows shaded."""
    t_s = values(traces, "t_s")
    data: dict[str, Columns] = {
        "held": stretches_of(t_s, traces["held_out"].to_numpy(), HELD_OUT),
        "slips": stretches_of(t_s, traces["mode"].to_numpy() > 0, SLIPPING),
    }
    layers = [charts.shade("held", 0.5), charts.shade("slips", 0.5)]
    if zero:
        layers.append(charts.level(0.0, "#9aa1ac", (), 0.8))
    read = []
    for model, colour in lines.items():
        value = values(traces, columns[model])
        rows = extremes(t_s, value)
        data[columns[model]] = {"t": numbers(t_s[rows]), "v": numbers(value[rows])}
        layers.append(charts.line(columns[model], "v", colour))
        read.append(Read(WORDS[model], columns[model], "v"))
    spec = charts.over_time(layers, (float(t_s[0]), float(t_s[-1])), height, data=list(data), readout=read)
    key = [Key(colour, WORDS[model], "line") for model, colour in lines.items()]
    key += [Key(HELD_OUT, "held out: not fitted")] if data["held"]["t"] else []
    key += [Key(SLIPPING, "slip or skid")] if data["slips"]["t"] else []
    return Figure(name, title, spec, data, key)


WORDS = {"base": "base model", "extended": "extended model"}


def stretches_of(t_s: F64, held: Bool, colour: str) -> Columns:
    """The stretches of a mask, in a colour."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(np.int8), [0]]))).reshape(-1, 2)
    return {
        "t": [round(float(t_s[a]), 3) for a, _ in edges],
        "t2": [round(float(t_s[min(b, len(t_s) - 1)]), 3) for _, b in edges],
        "c": [colour] * len(edges),
    }
