"""The page of two results side by side: what differs, when, and by how much."""

from dataclasses import dataclass

import numpy as np
import polars as pl

from wmr_replay.report import charts, page
from wmr_replay.report.charts import Columns, Figure, Key, Read, numbers
from wmr_replay.report.decimate import extremes, path_rows
from wmr_replay.report.modes import Lane, mode_figure, modes_of
from wmr_replay.report.paths import box_of, pieces_of
from wmr_replay.report.run_figures import BLUE, GREY, RED, column, curve
from wmr_schemas import __version__
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.text import figure

SAME, OTHER = "#c9ced6", "#d55e00"
OVERLAID = {"alpha": "α [(m/s²)/(N·m)]", "v_long_mps": "longitudinal velocity [m/s]"}
PLOTTED = (
    ("alpha", "α [(m/s²)/(N·m)]"),
    ("v_long_mps", "longitudinal velocity [m/s]"),
    ("v_lat_mps", "lateral velocity [m/s]"),
    ("yaw_rate_radps", "yaw rate [rad/s]"),
    ("c_k_mps", "C_k [m/s]"),
    ("c_d_mps2", "C_d [m/s²]"),
)
"""Columns whose difference is drawn, where there is one."""


@dataclass(frozen=True, eq=False)
class Compared:
    """Two results: names, samples tables, and the rows that both have, b's columns with the ending ``_b``;
    ``summary`` (field, a, b, delta) and ``columns`` (column, n, max, at_s, rms) as ``compare`` gives them.
    """

    a: str
    b: str
    samples_a: pl.DataFrame
    samples_b: pl.DataFrame
    joined: pl.DataFrame
    by_stamp: bool
    summary: pl.DataFrame
    columns: pl.DataFrame


def compare_page(two: Compared, name: str) -> str:
    """The page, as the text of a file. Raises MissingExtra."""
    sheet = page.Page(name, "two results side by side")
    changed = two.columns.filter(pl.col("rms") > 0)
    differs = other_mode(two.joined)
    sheet.add(verdict(two, changed, differs), page.facts(fact_list(two, differs)))
    sheet.add(page.table(("", "result"), [("a", two.a), ("b", two.b)]))
    if len(two.samples_a) > 1 and len(two.samples_b) > 1:
        sheet.section("Path and contact modes")
        sheet.figures([path_figure(two)], [overlay(two, one, said) for one, said in OVERLAID.items()])
        sheet.figures([lanes_figure(two, differs)])
        drawn = [
            difference_figure(two, one, said) for one, said in PLOTTED if one in changed["column"].to_list()
        ]
        if drawn:
            sheet.section("Differences b − a over time")
            sheet.figures(drawn[0::2], drawn[1::2])
    sheet.section("Numbers")
    rows = [
        (r["field"], figure(r["a"]), figure(r["b"]), figure(r["delta"], sign="+"))
        for r in two.summary.iter_rows(named=True)
    ]
    sheet.add(
        page.table(("summary", "a", "b", "b − a"), rows, numeric=(1, 2, 3))
        or page.paragraph("No number of the summary differs.")
    )
    rows = [
        (r["column"], figure(r["max"], sign="+"), f"{r['at_s']:.3f}", figure(r["rms"]))
        for r in changed.iter_rows(named=True)
    ]
    sheet.add(page.table(("samples", "largest difference", "at s", "rms"), rows, numeric=(1, 2, 3)))
    sheet.add(page.footer([f"wmr-replay {__version__}"]))
    return sheet.text()


def other_mode(joined: pl.DataFrame) -> Bool:
    """Of each common row, whether the modes differ."""
    found: Bool = joined.select(pl.col("mode").ne_missing(pl.col("mode_b"))).to_series().to_numpy()
    return found


def verdict(two: Compared, changed: pl.DataFrame, differs: Bool) -> str:
    """What differs, in a sentence."""
    if not len(two.joined):
        return page.verdict("Not comparable.", "The two have no row in common.", "#b3261e")
    if not len(changed) and not len(two.summary) and not differs.any():
        return page.verdict("The same.", f"{len(two.joined)} rows in common, no difference.", "#1f7a4d")
    words = [f"Another contact mode in {differs.mean():.2%} of the {len(two.joined)} common rows"]
    alpha = two.summary.filter(pl.col("field") == "alpha")
    if len(alpha) and alpha["delta"][0] is not None:
        words.append(
            f"α {figure(alpha['a'][0])} → {figure(alpha['b'][0])} ({figure(alpha['delta'][0], sign='+')})"
        )
    return page.verdict("They differ.", "; ".join(words) + ".", "#b26a00" if differs.any() else "#1d6f8f")


def fact_list(two: Compared, differs: Bool) -> list[tuple[str, str, str]]:
    """Rows, and the main scores of both."""
    how = "by stamp" if two.by_stamp else "by the time since the start"
    found = [
        (
            "rows in common",
            str(len(two.joined)),
            f"of {len(two.samples_a)} and {len(two.samples_b)}, matched {how}",
        )
    ]
    if len(differs):
        found.append(("another mode", f"{differs.mean():.2%}", f"{int(differs.sum())} rows"))
    for name, said in (("accuracy", "accuracy"), ("hindsight_accuracy", "accuracy in hindsight")):
        row = two.summary.filter(pl.col("field") == name)
        if len(row) and row["delta"][0] is not None:
            found.append((said, f"{row['a'][0]:.1%} → {row['b'][0]:.1%}", "a → b"))
    return found


def path_figure(two: Compared) -> Figure | None:
    """The path of a, where the modes differ in orange."""
    joined = two.joined
    if len(joined) < 2:
        return None
    x, y, t_s = (column(joined, name) for name in ("x_m", "y_m", "t_s"))
    differs = other_mode(joined)
    rows = path_rows(x, y, np.diff(differs, prepend=differs[0]) != 0)
    pieces = pieces_of(differs.astype(np.int64), rows)
    path: Columns = {
        "t": numbers(t_s[pieces.rows]),
        "x": numbers(x[pieces.rows]),
        "y": numbers(y[pieces.rows]),
        "k": pieces.piece.tolist(),
        "c": [OTHER if state else SAME for state in pieces.state],
    }
    spec = charts.in_plane([charts.stroke("path", None, width=3)], box_of(x, y), ["path"], place="path")
    return Figure(
        "path",
        "Path of a: where the modes differ",
        spec,
        {"path": path},
        [Key(SAME, "same mode"), Key(OTHER, "another mode")],
    )


def span_of(two: Compared) -> tuple[float, float]:
    """The time that both cover."""
    ends = [(float(s["t_s"][0]), float(s["t_s"][-1])) for s in (two.samples_a, two.samples_b)]
    return min(a for a, _ in ends), max(b for _, b in ends)


def lanes_figure(two: Compared, differs: Bool) -> Figure:
    """The modes of a and b, adjacent, where they differ, and the true ones."""
    lanes = [
        Lane(name, column(s, "t_s"), modes_of(s)) for name, s in (("a", two.samples_a), ("b", two.samples_b))
    ]
    truth = modes_of(two.samples_a, "mode_true")
    if (truth >= 0).any():
        lanes.append(Lane("true", column(two.samples_a, "t_s"), truth))
    return mode_figure(lanes, [], span_of(two))


def overlay(two: Compared, name: str, title: str) -> Figure | None:
    """A column of both over time, b drawn thin over a."""
    pairs = (("a", two.samples_a, GREY, 3.0), ("b", two.samples_b, RED, 1.2))
    data = {f"{name}_{side}": curve(column(s, "t_s"), column(s, name)) for side, s, _, _ in pairs}
    if not any(any(v is not None for v in columns["v"]) for columns in data.values()):
        return None
    layers = [charts.line(f"{name}_{side}", "v", colour, width=width) for side, _, colour, width in pairs]
    domain = settled(two, name) if name == "alpha" else None
    read = [Read(side, f"{name}_{side}", "v") for side, *_ in pairs]
    spec = charts.over_time(layers, span_of(two), 150, data=list(data), readout=read, domain=domain)
    return Figure(name, title, spec, data, [Key(colour, side, "line") for side, _, colour, _ in pairs])


def settled(two: Compared, name: str) -> tuple[float, float] | None:
    """The range of a column in the last four fifths of both."""
    parts: list[F64] = []
    for samples in (two.samples_a, two.samples_b):
        value, t_s = column(samples, name), column(samples, "t_s")
        parts.append(value[np.isfinite(value) & (t_s >= t_s[0] + 0.2 * (t_s[-1] - t_s[0]))])
    return range_of(np.concatenate(parts))


def range_of(values: F64) -> tuple[float, float] | None:
    """A range that holds all but the rarest values, with a margin; None without any."""
    if not len(values):
        return None
    low, high = np.percentile(values, (0.5, 99.5)).tolist()
    margin = 0.15 * (high - low) or 0.05 * abs(high) or 1.0
    return low - margin, high + margin


def difference_figure(two: Compared, name: str, title: str) -> Figure:
    """The difference b − a of a column over time."""
    t_s = column(two.joined, "t_s")
    value = column(two.joined, f"{name}_b") - column(two.joined, name)
    known = np.isfinite(t_s)
    t_s, value = t_s[known], value[known]
    rows = extremes(t_s, value)
    data = {f"difference_{name}": {"t": numbers(t_s[rows]), "v": numbers(value[rows])}}
    layers = [charts.level(0.0, "#9aa1ac", (), 0.8), charts.line(f"difference_{name}", "v", BLUE)]
    read = [Read("b − a", f"difference_{name}", "v")]
    late = np.isfinite(value) & (t_s >= t_s[0] + 0.2 * (t_s[-1] - t_s[0]))
    domain = range_of(np.append(value[late], 0.0)) if name == "alpha" and late.any() else None
    spec = charts.over_time(layers, span_of(two), 130, data=list(data), readout=read, domain=domain)
    return Figure(f"difference-{name}", f"b − a: {title}", spec, data)
