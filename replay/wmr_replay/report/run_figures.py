"""The figures of a replay: path and modes, velocities, constraints with their thresholds, α."""

from collections.abc import Sequence

import numpy as np
import polars as pl

from wmr_replay.report import charts
from wmr_replay.report.charts import Columns, Figure, Key, Read, numbers
from wmr_replay.report.decimate import extremes, path_rows
from wmr_replay.report.modes import SHOWN, Lane, colour_of, mode_figure, modes_of, name_of, posterior_of
from wmr_replay.report.paths import box_of, pieces_of
from wmr_schemas.arrays import F64, I64

BLUE, RED, GREY, DARK = "#23638a", "#c8500a", "#8b93a1", "#3a424f"
NORMAL_95 = 1.96
OUTER = (0.5, 99.5)
"""Percentiles of α's interval that its axis shows once it has settled."""


def column(samples: pl.DataFrame, name: str) -> F64:
    """A column with NaN where it is null."""
    return samples[name].cast(pl.Float64).fill_null(np.nan).to_numpy()


def curve(t_s: F64, value: F64) -> Columns:
    """A line over time as columns ``t, v``, thinned to the extremes of each pixel column."""
    known = np.isfinite(t_s)
    t_s, value = t_s[known], value[known]
    rows = extremes(t_s, value) if len(t_s) else np.zeros(0, np.int64)
    return {"t": numbers(t_s[rows]), "v": numbers(value[rows])}


def described_s(samples: pl.DataFrame) -> F64:
    """The instants that the derivative columns describe."""
    return column(samples, "t_s") - np.nan_to_num(column(samples, "delay_s"))


def path_figure(samples: pl.DataFrame, mode: I64, how: str) -> Figure | None:
    """The measured path in the colours of the modes, its start marked."""
    x, y, t_s = (column(samples, name) for name in ("x_m", "y_m", "t_s"))
    switch = np.diff(mode, prepend=mode[0]) != 0
    rows = path_rows(x, y, switch if switch.sum() < 2000 else np.zeros(len(x), bool))
    if len(rows) < 2:
        return None
    path, seen = path_columns(x, y, t_s, mode, rows)
    ends: dict[str, Columns] = {
        name: {
            "x": numbers(x[rows])[k : k + 1 or None],
            "y": numbers(y[rows])[k : k + 1 or None],
            "s": [name],
        }
        for name, k in (("start", 0), ("end", -1))
    }
    tip = [{"field": "t", "title": "time [s]"}, {"field": "m", "title": "mode"}]
    layers = [charts.stroke("path", None, width=3.2, tip=tip)]
    for name, dy in (("start", -12), ("end", 22)):
        layers += [charts.dots(name, DARK, size=70, opacity=1), *charts.labels(name, dy=dy)]
    spec = charts.in_plane(layers, box_of(x, y), ["path", *ends], place="path")
    key = [Key(colour_of(m), name_of(m)) for m in (*map(int, SHOWN),) if m in seen]
    return Figure("path", f"Path by contact mode, {how}", spec, {"path": path} | ends, key)


def path_columns(x: F64, y: F64, t_s: F64, mode: I64, rows: I64) -> tuple[Columns, set[int]]:
    """The path in pieces of one mode, and the modes that occur."""
    pieces = pieces_of(mode, rows)
    path: Columns = {
        "t": numbers(t_s[pieces.rows]),
        "x": numbers(x[pieces.rows]),
        "y": numbers(y[pieces.rows]),
        "k": pieces.piece.tolist(),
        "c": [colour_of(m) for m in pieces.state.tolist()],
        "m": [name_of(m) for m in pieces.state.tolist()],
    }
    return path, set(pieces.state.tolist())


def lanes_figure(samples: pl.DataFrame, later: pl.DataFrame | None, span: tuple[float, float]) -> Figure:
    """Modes as known at the time, in hindsight and in truth, and their posteriors."""
    t_s = column(samples, "t_s")
    lanes = [Lane("known", t_s, modes_of(samples))]
    bands = [posterior_of("p known", samples)]
    if later is not None:
        lanes.append(Lane("hindsight", column(later, "t_s"), modes_of(later)))
        bands.append(posterior_of("p hindsight", later))
    truth = modes_of(samples, "mode_true")
    if (truth >= 0).any():
        lanes.append(Lane("true", t_s, truth))
    found = mode_figure(lanes, bands, span)
    note = "known: from the data up to that time. hindsight: from the whole log." if later is not None else ""
    return Figure(found.name, found.title, found.spec, found.data, found.key, note)


def velocity_figures(
    samples: pl.DataFrame, span: tuple[float, float], hue: dict[str, Columns], how: str
) -> list[Figure]:
    """Longitudinal velocity; lateral velocity and yaw rate."""
    ahead = (("v_long_mps", BLUE, "longitudinal [m/s]"),)
    across = (("v_lat_mps", RED, "lateral [m/s]"), ("yaw_rate_radps", GREY, "yaw rate [rad/s]"))
    note = f"Shaded: contact mode {how}, where it is not ideal rolling."
    return [
        lines_figure("ahead", "Longitudinal velocity [m/s]", samples, ahead, span, hue),
        lines_figure("across", "Lateral velocity and yaw rate", samples, across, span, hue, note),
    ]


def lines_figure(
    name: str,
    title: str,
    samples: pl.DataFrame,
    drawn: Sequence[tuple[str, str, str]],
    span: tuple[float, float],
    hue: dict[str, Columns],
    note: str = "",
) -> Figure:
    """Columns of the derivatives as lines: column, colour, name with unit."""
    t_s = described_s(samples)
    data = {column_name: curve(t_s, column(samples, column_name)) for column_name, _, _ in drawn} | hue
    layers = [charts.shade("shade"), *(charts.line(one, "v", colour) for one, colour, _ in reversed(drawn))]
    read = [Read(words, one, "v") for one, _, words in drawn]
    spec = charts.over_time(layers, span, 150, data=list(data), readout=read)
    key = [Key(colour, words, "line") for _, colour, words in drawn] if len(drawn) > 1 else []
    return Figure(name, title, spec, data, key, note)


def constraint_figure(
    samples: pl.DataFrame,
    span: tuple[float, float],
    hue: dict[str, Columns],
    name: str,
    unit: str,
    title: str,
) -> Figure | None:
    """A constraint over time, and the band between its thresholds; None where the log does not show it."""
    t_s, value, limit = (
        described_s(samples),
        column(samples, f"{name}_{unit}"),
        column(samples, f"{name}_threshold_{unit}"),
    )
    if not np.isfinite(value).any():
        return None
    limits = curve(t_s, limit)
    limits["low"] = [None if v is None else -v for v in limits["v"]]
    data = {name: curve(t_s, value), f"{name}_limit": limits} | hue
    layers = [
        charts.shade("shade"),
        charts.band(f"{name}_limit", "low", "v", "#9aa2af", 0.38),
        charts.line(f"{name}_limit", "v", GREY, width=0.8),
        charts.line(f"{name}_limit", "low", GREY, width=0.8),
        charts.line(name, "v", BLUE),
    ]
    read = [Read(title.partition(":")[0], name, "v"), Read("threshold ±", f"{name}_limit", "v")]
    spec = charts.over_time(layers, span, 170, data=list(data), readout=read)
    key = [Key(BLUE, "from the log", "line"), Key("#cfd4db", "± threshold")]
    return Figure(name, title, spec, data, key)


def alpha_figure(
    samples: pl.DataFrame, span: tuple[float, float], hue: dict[str, Columns], nominal: float | None
) -> Figure:
    """α with its 95 % interval, and the nominal value."""
    level = None if nominal is None else (nominal, f"nominal {nominal:.4g}")
    return interval_figure(samples, span, hue, ("alpha", "α"), "α [(m/s²)/(N·m)] as known at the time", level)


def learnt_figure(
    samples: pl.DataFrame,
    span: tuple[float, float],
    hue: dict[str, Columns],
    name: str,
    title: str,
    stated: float | None,
) -> Figure:
    """What was learnt of the wheels, with its 95 % interval, and the stated value."""
    words = title.partition(":")[0].partition(" [")[0]
    level = None if stated is None else (stated, f"as stated: {stated:g}")
    return interval_figure(samples, span, hue, (name, words), title, level)


def slip_figure(
    samples: pl.DataFrame, span: tuple[float, float], hue: dict[str, Columns], side: str
) -> Figure:
    """Slip velocity of a wheel with its 95 % interval, at the instants that it describes."""
    name, words = (f"slip_{side}_mps", f"slip {side}")
    title = f"Slip of the {side} wheel [m/s]: its speed minus the ground's"
    t_s = described_s(samples)
    return interval_figure(samples, span, hue, (name, words), title, t_s=t_s, whole=True)


def interval_figure(
    samples: pl.DataFrame,
    span: tuple[float, float],
    hue: dict[str, Columns],
    called: tuple[str, str],
    title: str,
    level: tuple[float, str] | None = None,
    *,
    t_s: F64 | None = None,
    whole: bool = False,
) -> Figure:
    """A column, and what it is called, with its 95 % interval and a level to compare it with. The axis shows
    it ``whole``, or as it is once it has settled.
    """
    name, words = called
    t_s = column(samples, "t_s") if t_s is None else t_s
    value, sd = column(samples, name), column(samples, f"{name}_sd")
    low, high = value - NORMAL_95 * sd, value + NORMAL_95 * sd
    rows = np.unique(np.concatenate([extremes(t_s, low), extremes(t_s, high), extremes(t_s, value)]))
    data = {
        name: {
            "t": numbers(t_s[rows]),
            "v": numbers(value[rows]),
            "low": numbers(low[rows]),
            "high": numbers(high[rows]),
        }
    } | hue
    layers = [
        charts.shade("shade", 0.1),
        charts.band(name, "low", "high", BLUE, 0.2),
        charts.line(name, "v", BLUE, width=1.6),
    ]
    key = [Key(BLUE, words, "line"), Key("#c9dae4", "95 % interval")]
    if level is not None:
        layers.append(charts.level(level[0], DARK))
        key.append(Key(DARK, level[1], "dash"))
    spec = charts.over_time(
        layers,
        span,
        180,
        data=list(data),
        readout=[Read(words, name, "v"), Read("from", name, "low"), Read("to", name, "high")],
        domain=None if whole else settled_domain(t_s, low, high, None if level is None else level[0]),
    )
    return Figure(name, title, spec, data, key)


def settled_domain(t_s: F64, low: F64, high: F64, nominal: float | None) -> tuple[float, float] | None:
    """What the axis shows: the interval once a fifth of the log has passed, and the level."""
    settled = np.isfinite(low) & np.isfinite(high) & (t_s >= t_s[0] + 0.2 * (t_s[-1] - t_s[0]))
    if not settled.any():
        return None
    least, most = np.percentile(np.concatenate([low[settled], high[settled]]), OUTER).tolist()
    if nominal is not None:
        least, most = min(least, nominal), max(most, nominal)
    margin = 0.25 * (most - least) or 0.1 * abs(most)
    return least - margin, most + margin
