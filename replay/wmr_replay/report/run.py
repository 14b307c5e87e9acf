"""The page of a replay: verdict, data quality, path, contact modes, velocities, constraints, α."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from wmr_replay.report import charts, page
from wmr_replay.report import run_figures as figures
from wmr_replay.report.modes import COLOURS, SHOWN, modes_of, name_of, shading
from wmr_replay.report.run_figures import NORMAL_95
from wmr_replay.tables.drawn import DRAWN, WHEELS, by_wheel_speeds, with_wheels
from wmr_replay.timeline.colours import mode_name
from wmr_schemas.modes import MODES
from wmr_schemas.tables import counted_anomalies, driven_by

C_K = ("c_k", "mps", "C_k = −v_lat [m/s]: beyond the band the robot skids")
C_D = ("c_d", "mps2", "C_d [m/s²]: beyond the band a wheel slips")
LEARNT = (
    ("wheel_scale", "Wheel scale: true over stated speed", 1.0),
    ("effective_half_track_m", "Half track that turning shows [m]", None),
    ("icr_offset_m", "Centre of rotation, x [m]", 0.0),
)
"""What is learnt of the wheels: column, title, and what the stated robot would show."""
TONE = "#1f7a4d"
BARRED, WARNED = "#b3261e", "#b26a00"
COLUMNS = (*DRAWN, *WHEELS, *(f"p_{mode.label}" for mode in MODES))


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
    samples = with_wheels(tables.samples).select(COLUMNS).collect()
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
    inputs = f"{row['n_torque']} {driven_by(row)}"
    found = [("length", length(row["duration_s"]), f"{row['n_pose']} poses{rate}, {inputs}")]
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
    notes = [f"{n} {meaning}" for n, meaning in counted_anomalies(row)] + list(json.loads(row["notes"]))
    if row["truncated"]:
        notes.append("the file ends before its end")
    listed = "".join(f"<li>{page.escape(note)}</li>" for note in notes)
    said = page.finding_list(findings) or page.NOTHING_FOUND
    return said + (f"<ul class=soft>{listed}</ul>" if listed else "")


def draw(sheet: page.Page, tables: RunTables, samples: pl.DataFrame, row: Mapping[str, Any]) -> None:
    """Every figure of a replay."""
    t_s = figures.column(samples, "t_s")
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
    sheet.figures(
        [figures.path_figure(samples, best, how)], figures.velocity_figures(samples, span, hue, how)
    )
    sheet.figures([figures.lanes_figure(samples, later, span)])
    sheet.add(
        '<p class="note screen">Point at a plot: the values there, the same time in the other plots, '
        "and the place on the path.</p>"
    )
    if by_wheel_speeds(samples):
        draw_wheels(sheet, samples, span, hue)
    else:
        draw_constraints(sheet, samples, span, hue)
    robot = json.loads(row["settings"]).get("robot") or {}
    if np.isfinite(figures.column(samples, "alpha")).any():
        sheet.section("α, acceleration per torque")
        sheet.figures([figures.alpha_figure(samples, span, hue, robot.get("alpha"))])


Hue = dict[str, charts.Columns]


def draw_wheels(sheet: page.Page, samples: pl.DataFrame, span: tuple[float, float], hue: Hue) -> None:
    """What wheel speeds show: slip beside skidding, and what was learnt of the wheels."""
    sheet.section(
        "Skidding and slip",
        "In ideal rolling C_k stays within its grey band, and the 95 % intervals of both slips hold zero.",
    )
    skid = figures.constraint_figure(samples, span, hue, *C_K)
    sheet.figures([skid])
    left, right = (figures.slip_figure(samples, span, hue, side) for side in ("left", "right"))
    sheet.figures([left], [right])
    sheet.section("Learnt of the wheels", "As known at the time, with 95 % intervals.")
    sheet.figures([figures.learnt_figure(samples, span, hue, *one) for one in LEARNT])


def draw_constraints(sheet: page.Page, samples: pl.DataFrame, span: tuple[float, float], hue: Hue) -> None:
    """What torques show: both constraints."""
    sheet.section(
        "Constraints and their thresholds",
        "In ideal rolling both stay within their grey band: C_k leaves it in a skid, C_d in slip.",
    )
    names = (C_K, C_D)
    drawn = [figures.constraint_figure(samples, span, hue, *one) for one in names]
    sheet.figures(drawn)
    unknown = [
        title.partition(":")[0] for (_, _, title), one in zip(names, drawn, strict=True) if one is None
    ]
    if unknown:
        sheet.add(page.paragraph(f"Not known in this log: {', '.join(unknown)}.", "soft"))


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
