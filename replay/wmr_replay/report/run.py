"""The page of a replay: verdict, data quality, path, contact modes, velocities, constraints, α."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from wmr_replay.report import charts, page
from wmr_replay.report.charts import Columns, Figure, Key, Read, numbers
from wmr_replay.report.decimate import extremes, path_rows
from wmr_replay.report.modes import (
    COLOURS,
    SHOWN,
    Lane,
    colour_of,
    mode_figure,
    modes_of,
    name_of,
    posterior_of,
    shading,
)
from wmr_replay.report.paths import box_of, pieces_of
from wmr_replay.timeline.colours import mode_name
from wmr_schemas.arrays import F64, I64
from wmr_schemas.modes import MODES
from wmr_schemas.tables import ANOMALIES

BLUE, RED, GREY, DARK = "#23638a", "#c8500a", "#8b93a1", "#3a424f"
NORMAL_95 = 1.96
TONE = "#1f7a4d"
BARRED, WARNED = "#b3261e", "#b26a00"
OUTER = (0.5, 99.5)
"""Percentiles of α's interval that its axis shows once it has settled."""
COLUMNS = (
    *(
        "t_s",
        "x_m",
        "y_m",
        "v_long_mps",
        "v_lat_mps",
        "yaw_rate_radps",
        "delay_s",
        "c_k_mps",
        "c_k_threshold_mps",
    ),
    *("c_d_mps2", "c_d_threshold_mps2", "mode", "mode_true", "alpha", "alpha_sd"),
    *(f"p_{mode.label}" for mode in MODES),
)


@dataclass(frozen=True, eq=False)
class RunTables:
    """What a page of a replay is drawn from: the tables as they are on disk, modes as numbers."""

    summary: Mapping[str, Any]
    samples: pl.LazyFrame
    hindsight: pl.LazyFrame | None = None
    confusion: pl.DataFrame | None = None

    @classmethod
    def of_files(cls, files: Mapping[str, Path]) -> "RunTables":
        """The tables of result files by kind."""
        later, confusion = files.get("hindsight"), files.get("confusion")
        return cls(
            pl.read_parquet(files["summary"], glob=False).row(0, named=True),
            pl.scan_parquet(files["samples"], glob=False),
            None if later is None else pl.scan_parquet(later, glob=False),
            None if confusion is None else pl.read_parquet(confusion, glob=False),
        )


def run_page(tables: RunTables, name: str) -> str:
    """The page of a replay of the log ``name``, as the text of a file. Raises MissingExtra."""
    row = tables.summary
    sheet = page.Page(name, "replay of a log")
    samples = tables.samples.select(COLUMNS).collect()
    findings = json.loads(row["findings"])
    sheet.add(verdict_of(row, findings), page.share_bar(shares_of(row)), page.facts(fact_list(row)))
    sheet.section("Data quality")
    sheet.add(quality(row, findings))
    if len(samples) > 1:
        draw(sheet, tables, samples, row)
    sheet.add(confusion(tables.confusion), settings(row))
    sheet.add(page.footer(origin(row)))
    return sheet.text()


def verdict_of(row: Mapping[str, Any], findings: list[Mapping[str, Any]]) -> str:
    """The sentence of the summary, in the colour of the worst finding."""
    weights = {found["severity"] for found in findings}
    tone = BARRED if "bars" in weights else WARNED if "warning" in weights else TONE
    if row["share_undecided"] is not None and row["share_undecided"] > 0.999 and tone == TONE:
        tone = WARNED
    return page.verdict("", row["verdict"], tone)


def shares_of(row: Mapping[str, Any]) -> list[tuple[str, str, float]]:
    """Name, colour and share of each mode that occurs: in hindsight where there is a second pass."""
    later = "hindsight_" if row.get("hindsight_share_ideal") is not None else ""
    found = [(mode_name(mode), COLOURS[mode], row[f"{later}share_{mode.label}"]) for mode in SHOWN]
    return [(name, colour, float(share)) for name, colour, share in found if share]


def fact_list(row: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The main numbers."""
    rate = "" if row["rate_hz"] is None else f" at {row['rate_hz']:.4g} Hz"
    found = [("length", length(row["duration_s"]), f"{row['n_pose']} poses{rate}, {row['n_torque']} torques")]
    if row["alpha"] is not None:
        robot = json.loads(row["settings"]).get("robot") or {}
        nominal = "" if robot.get("alpha") is None else f"; nominal {robot['alpha']:.4g}"
        sd = "" if row["alpha_sd"] is None else f" ± {NORMAL_95 * row['alpha_sd']:.2g}"
        found.append(("α", f"{row['alpha']:.4g}{sd}", f"(m/s²)/(N·m), 95 %{nominal}"))
    if row.get("hindsight_accuracy") is not None:
        found.append(
            (
                "accuracy in hindsight",
                f"{row['hindsight_accuracy']:.1%}",
                "against the truth, by the whole log",
            )
        )
    if row["accuracy"] is not None:
        decided = f"{row['accuracy_decided']:.1%} of {row['decided_share']:.1%} decided"
        found.append(("accuracy as known at the time", f"{row['accuracy']:.1%}", decided))
    if row["median_detection_delay_s"] is not None:
        found.append(
            (
                "detection",
                f"{row['median_detection_delay_s']:.2f} s",
                f"median; {row['missed_switches']} switches missed",
            )
        )
    return found


def length(seconds: float) -> str:
    """A length of time."""
    if seconds < 600:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.1f} min" if seconds < 7200 else f"{seconds / 3600:.2f} h"


def quality(row: Mapping[str, Any], findings: list[Mapping[str, Any]]) -> str:
    """Findings, counts of what was left out, notes."""
    counted = [(row[c.name], c.meaning) for c in ANOMALIES if row[c.name] and c.name != "truncated"]
    notes = [f"{n} {meaning}" for n, meaning in counted] + list(json.loads(row["notes"]))
    if row["truncated"]:
        notes.append("the file ends before its end")
    listed = "".join(f"<li>{page.escape(note)}</li>" for note in notes)
    said = page.finding_list(findings) or page.NOTHING_FOUND
    return said + (f"<ul class=soft>{listed}</ul>" if listed else "")


def draw(sheet: page.Page, tables: RunTables, samples: pl.DataFrame, row: Mapping[str, Any]) -> None:
    """Every figure of a replay."""
    t_s = column(samples, "t_s")
    span = (float(t_s[0]), float(t_s[-1]))
    later = (
        None
        if tables.hindsight is None
        else tables.hindsight.select("t_s", "mode", *(f"p_{m.label}" for m in MODES)).collect()
    )
    later = later if later is not None and len(later) else None
    best = modes_of(samples) if later is None or len(later) != len(samples) else modes_of(later)
    hue = {"shade": shading(t_s, best)}
    how = "as known at the time" if later is None else "in hindsight"
    sheet.section("Path, velocities, contact modes")
    sheet.figures([path_figure(samples, best, how)], velocity_figures(samples, span, hue, how))
    sheet.figures([lanes_figure(samples, later, span)])
    sheet.add(
        '<p class="note screen">Point at a plot: the values there, the same time in the other plots, '
        "and the place on the path.</p>"
    )
    sheet.section(
        "Constraints and their thresholds",
        "In ideal rolling both stay within their grey band: C_k leaves it in a skid, C_d in slip.",
    )
    names = (
        ("c_k", "mps", "C_k = −v_lat [m/s]: beyond the band the robot skids"),
        ("c_d", "mps2", "C_d [m/s²]: beyond the band a wheel slips"),
    )
    sheet.figures([constraint_figure(samples, span, hue, name, unit, title) for name, unit, title in names])
    robot = json.loads(row["settings"]).get("robot") or {}
    if np.isfinite(column(samples, "alpha")).any():
        sheet.section("α, acceleration per torque")
        sheet.figures([alpha_figure(samples, span, hue, robot.get("alpha"))])


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
    ends: Columns = {
        "x": numbers(x[rows[[0, -1]]]),
        "y": numbers(y[rows[[0, -1]]]),
        "s": ["start", "end"],
        "c": ["#ffffff", DARK],
    }
    tip = [{"field": "t", "title": "time [s]"}, {"field": "m", "title": "mode"}]
    layers = [
        charts.stroke("path", None, width=3.2, tip=tip),
        charts.dots("path_ends", DARK, size=70, opacity=1),
        charts.labels("path_ends"),
    ]
    spec = charts.in_plane(layers, box_of(x, y), ["path", "path_ends"], place="path")
    key = [Key(colour_of(m), name_of(m)) for m in (*map(int, SHOWN),) if m in seen]
    return Figure("path", f"Path by contact mode, {how}", spec, {"path": path, "path_ends": ends}, key)


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
) -> Figure:
    """A constraint over time, and the band between its thresholds."""
    t_s, value, limit = (
        described_s(samples),
        column(samples, f"{name}_{unit}"),
        column(samples, f"{name}_threshold_{unit}"),
    )
    if not np.isfinite(value).any():
        return Figure(name, f"{title}: not known in this log", charts.over_time([], span, 40, data=[]), {})
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
    t_s, alpha, sd = (column(samples, name) for name in ("t_s", "alpha", "alpha_sd"))
    low, high = alpha - NORMAL_95 * sd, alpha + NORMAL_95 * sd
    rows = np.unique(np.concatenate([extremes(t_s, low), extremes(t_s, high), extremes(t_s, alpha)]))
    data = {
        "alpha": {
            "t": numbers(t_s[rows]),
            "v": numbers(alpha[rows]),
            "low": numbers(low[rows]),
            "high": numbers(high[rows]),
        }
    } | hue
    layers = [
        charts.shade("shade", 0.1),
        charts.band("alpha", "low", "high", BLUE, 0.2),
        charts.line("alpha", "v", BLUE, width=1.6),
    ]
    key = [Key(BLUE, "α", "line"), Key("#c9dae4", "95 % interval")]
    if nominal is not None:
        layers.append(charts.level(nominal, DARK))
        key.append(Key(DARK, f"nominal {nominal:.4g}", "dash"))
    spec = charts.over_time(
        layers,
        span,
        180,
        data=list(data),
        readout=[Read("α", "alpha", "v"), Read("from", "alpha", "low"), Read("to", "alpha", "high")],
        domain=alpha_domain(t_s, low, high, nominal),
    )
    return Figure("alpha", "α [(m/s²)/(N·m)] as known at the time", spec, data, key)


def alpha_domain(t_s: F64, low: F64, high: F64, nominal: float | None) -> tuple[float, float] | None:
    """What the axis of α shows: its interval once a fifth of the log has passed, and the nominal value."""
    settled = np.isfinite(low) & np.isfinite(high) & (t_s >= t_s[0] + 0.2 * (t_s[-1] - t_s[0]))
    if not settled.any():
        return None
    least, most = np.percentile(np.concatenate([low[settled], high[settled]]), OUTER).tolist()
    if nominal is not None:
        least, most = min(least, nominal), max(most, nominal)
    margin = 0.25 * (most - least) or 0.1 * abs(most)
    return least - margin, most + margin


def confusion(frame: pl.DataFrame | None) -> str:
    """Seconds by true and estimated mode."""
    if frame is None or not len(frame):
        return ""
    seconds = {(int(t), int(m)): s for t, m, s in frame.select("mode_true", "mode", "seconds").iter_rows()}
    columns = [m for m in map(int, SHOWN) if any(k[1] == m for k in seconds)]
    rows = []
    for true in [m for m in map(int, SHOWN) if any(k[0] == m for k in seconds)]:
        total = sum(seconds.get((true, m), 0.0) for m in columns)
        rows.append(
            [
                f"true {name_of(true)}",
                f"{total:.1f} s",
                *(f"{seconds.get((true, m), 0) / total:.1%}" if total else "–" for m in columns),
            ]
        )
    made = page.table(
        ["", "time", *(f"said {name_of(m)}" for m in columns)], rows, numeric=range(1, len(columns) + 2)
    )
    return f"<h2>Against the truth, as known at the time</h2>{made}"


def settings(row: Mapping[str, Any]) -> str:
    """Settings and differentiator, closed."""
    text = json.dumps(json.loads(row["settings"]), indent=1, ensure_ascii=False)
    lines = page.lines(text)
    return (
        f"<h2>How it was made</h2>{page.details('Settings, robot, channels, kernel', f'<pre>{lines}</pre>')}"
    )


def origin(row: Mapping[str, Any]) -> list[str]:
    """Log, hash and version."""
    sha = f"SHA-256 {row['log_sha256']}" if row["log_sha256"] else ""
    return [str(row["log"]), *([sha] if sha else []), f"wmr-replay {row['version']}"]
