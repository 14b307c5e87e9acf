"""The page of a batch: a row per log, what is odd about it, and trends over dates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np

from wmr_replay.report import charts, page
from wmr_replay.report.charts import Columns, Figure, Key, Spec, numbers
from wmr_replay.report.modes import COLOURS
from wmr_replay.report.run import length
from wmr_replay.timeline.colours import mode_name
from wmr_schemas import __version__
from wmr_schemas.arrays import F64
from wmr_schemas.gap_file import GapFile
from wmr_schemas.modes import MODES, ContactMode

ODD_SCORE = 3.5
LEAST_LOGS = 5
TO_SD = 1.4826
"""Median absolute deviation to standard deviation, for normal numbers."""
RULE = (
    f"Odd: a number whose distance from the median of all logs is more than {ODD_SCORE:g} times the scaled "
    f"median absolute deviation (a robust z-score; from {LEAST_LOGS} logs on), or data that bar an answer."
)
BLUE, ODD_COLOUR = "#23638a", "#d55e00"


@dataclass(frozen=True)
class Judged:
    """A number that is judged: name of the column, heading, format, and the least deviation that counts."""

    name: str
    heading: str
    form: str
    least: float
    relative: bool = False


JUDGED = (
    Judged("alpha", "α", ".4g", 0.01, relative=True),
    *(
        Judged(f"share_{mode.label}", mode_name(mode), ".1%", 0.02)
        for mode in (*MODES, ContactMode.UNDECIDED)
    ),
    Judged("accuracy", "accuracy", ".1%", 0.01),
    Judged("rate_hz", "rate [Hz]", ".4g", 0.01, relative=True),
    Judged("gap_mm", "gap [mm]", ".3g", 0.1, relative=True),
    Judged("gap_left_mm", "gap left [mm]", ".3g", 0.1, relative=True),
)


@dataclass(frozen=True)
class FleetLog:
    """A log of the batch: its row of the fleet table, start in ns since 1970, the file of its report, and its
    gap analysis where there is one.
    """

    row: Mapping[str, Any]
    start_ns: int | None = None
    report: str | None = None
    gap: GapFile | None = None
    findings: Sequence[Mapping[str, Any]] = field(default_factory=tuple)

    def number(self, name: str) -> float | None:
        """A number of the log by its column."""
        if name in ("gap_mm", "gap_left_mm"):
            held = None if self.gap is None else self.gap.gap.held_out
            value = None if held is None else held.before if name == "gap_mm" else held.after
            return None if value is None else 1e3 * value
        found = self.row.get(name)
        return None if found is None else float(found)


def fleet_page(logs: Sequence[FleetLog], total: Mapping[str, Any], name: str) -> str:
    """The page of a batch, as the text of a file. Raises MissingExtra."""
    sheet = page.Page(name, "fleet")
    done = [log for log in logs if log.row["state"] == "done"]
    failed = [log for log in logs if log.row["state"] != "done"]
    shown = [one for one in JUDGED if any(log.number(one.name) for log in done)]
    odd = odd_ones(done, shown)
    n_odd = sum(bool(o) for o in odd)
    sheet.add(verdict(done, failed, n_odd), bar(total), page.facts(fact_list(done, failed, n_odd, total)))
    if failed:
        sheet.section("Failed")
        sheet.add(page.table(("log", "why"), [(log.row["path"], log.row["problem"]) for log in failed]))
    sheet.section("Logs", "Click a heading to sort.")
    sheet.add(page.paragraph(RULE, "note"), log_table(done, shown, odd))
    drawn = trends(done, shown, odd)
    if drawn:
        dated = all(log.start_ns is not None and log.start_ns > DAY_NS for log in done)
        sheet.section(
            "Trends",
            "Over the start of each log." if dated else "In the order of the logs, which have no dates.",
        )
        sheet.figures(drawn[0::2], drawn[1::2])
    sheet.add(page.footer([f"wmr-replay {__version__}"]))
    return sheet.text()


DAY_NS = 86_400 * 1_000_000_000
"""Stamps before this count from some start, not from 1970."""


def odd_ones(logs: Sequence[FleetLog], shown: Sequence[Judged]) -> list[list[str]]:
    """What is odd about each log, by the rule: headings with their robust z-scores, and findings."""
    odd: list[list[str]] = [[] for _ in logs]
    for one in shown:
        values = np.array([np.nan if (v := log.number(one.name)) is None else v for log in logs])
        for k, score in enumerate(robust_scores(values, one)):
            if abs(score) > ODD_SCORE:
                odd[k].append(f"{one.heading} {'high' if score > 0 else 'low'} (z {score:+.1f})")
    for k, log in enumerate(logs):
        odd[k] += [f"{found['code']} bars an answer" for found in log.findings if found["severity"] == "bars"]
    return odd


def robust_scores(values: F64, judged: Judged) -> F64:
    """Distances from the median in scaled median absolute deviations; 0 where there are too few logs.

    The deviation is at least ``least``, of the median where ``relative``: logs that agree to the last digit
    make no log odd.
    """
    known = values[np.isfinite(values)]
    if len(known) < LEAST_LOGS:
        return np.zeros(len(values))
    centre = float(np.median(known))
    least = judged.least * (abs(centre) if judged.relative else 1.0)
    spread = max(TO_SD * float(np.median(np.abs(known - centre))), least) or 1.0
    return np.nan_to_num((values - centre) / spread)


def verdict(done: Sequence[FleetLog], failed: Sequence[FleetLog], n_odd: int) -> str:
    """How many logs there are, failed, and are odd."""
    words = [f"{len(done)} log{'' if len(done) == 1 else 's'} done"]
    words += [f"{len(failed)} failed"] if failed else []
    words.append(f"{n_odd} odd" if n_odd else "none odd")
    tone = "#b3261e" if failed else "#b26a00" if n_odd else "#1f7a4d"
    return page.verdict("", ", ".join(words) + ".", tone)


def bar(total: Mapping[str, Any]) -> str:
    """Shares of the modes by time over the fleet."""
    found = [
        (mode_name(m), COLOURS[m], total.get(f"share_{m.label}")) for m in (*MODES, ContactMode.UNDECIDED)
    ]
    parts = [(name, colour, float(share)) for name, colour, share in found if share]
    return page.share_bar(parts) if parts else ""


def fact_list(
    done: Sequence[FleetLog], failed: Sequence[FleetLog], n_odd: int, total: Mapping[str, Any]
) -> list[tuple[str, str, str]]:
    """The fleet in numbers."""
    found = [
        ("logs", str(len(done)), f"{total['hours']:.2f} h" + (f"; {len(failed)} failed" if failed else ""))
    ]
    found.append(("odd", str(n_odd), "marked in the table"))
    alpha = [v for log in done if (v := log.number("alpha")) is not None]
    if alpha:
        found.append(
            (
                "α, median",
                f"{np.median(alpha):.4g}",
                f"from {min(alpha):.4g} to {max(alpha):.4g} (m/s²)/(N·m)",
            )
        )
    if total.get("accuracy") is not None:
        found.append(
            ("accuracy", f"{total['accuracy']:.1%}", f"over {total['n_with_truth']} logs with a truth")
        )
    n_gap = sum(log.gap is not None for log in done)
    if n_gap:
        found.append(("gap analyses", str(n_gap), "found in the dataset's folder gap/"))
    return found


def log_table(logs: Sequence[FleetLog], shown: Sequence[Judged], odd: Sequence[Sequence[str]]) -> str:
    """A row per log; its headings sort."""
    heads = [
        ("log", "text"),
        ("date", "text"),
        ("length", "number"),
        *((one.heading, "number") for one in shown),
        ("odd", "number"),
    ]
    if any(log.gap is not None for log in logs):
        heads.insert(3, ("missing", "text"))
    head = "".join(
        f'<th data-sort="{kind}"{" class=n" if kind == "number" else ""}>{page.escape(name)}</th>'
        for name, kind in heads
    )
    rows = "".join(
        log_row(log, shown, said, gaps=len(heads) > len(shown) + 4)
        for log, said in zip(logs, odd, strict=True)
    )
    inside = f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody>"
    return f'<div class="scroll"><table class="sortable">{inside}</table></div>'


def log_row(log: FleetLog, shown: Sequence[Judged], odd: Sequence[str], *, gaps: bool) -> str:
    """A log: link, date, length, numbers, what is odd."""
    name = page.escape(short_name(log))
    link = f'<a href="{page.escape(log.report)}">{name}</a>' if log.report else name
    cells = [
        f'<td data-v="{page.escape(log.row["path"])}">{link}</td>',
        cell(date_of(log), date_of(log) or "–"),
    ]
    cells.append(cell(log.row["duration_s"], length(log.row["duration_s"] or 0.0), number=True))
    if gaps:
        missing = (
            ""
            if log.gap is None
            else ", ".join(e.name for e in log.gap.effects) or log.gap.verdict.replace("_", " ")
        )
        cells.append(cell(missing, missing or "–"))
    for one in shown:
        value = log.number(one.name)
        cells.append(cell(value, "–" if value is None else f"{value:{one.form}}", number=True))
    cells.append(f'<td class="mark" data-v="{len(odd)}">{page.escape("; ".join(odd))}</td>')
    return f"<tr{' class=odd' if odd else ''}>{''.join(cells)}</tr>"


def cell(value: object, text: str, *, number: bool = False) -> str:
    """A cell with the value that sorts it."""
    kept = "" if value is None else page.escape(value)
    return f'<td data-v="{kept}"{" class=n" if number else ""}>{page.escape(text)}</td>'


def short_name(log: FleetLog) -> str:
    """The log's file name."""
    return str(log.row["path"] or log.row["log"]).rstrip("/").replace("\\", "/").rpartition("/")[2]


def date_of(log: FleetLog) -> str:
    """The log's start, in UTC; empty where its clock has no date."""
    if log.start_ns is None or log.start_ns <= DAY_NS:
        return ""
    try:
        return datetime.fromtimestamp(log.start_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M")
    except (OverflowError, ValueError, OSError):
        return ""


def trends(logs: Sequence[FleetLog], shown: Sequence[Judged], odd: Sequence[Sequence[str]]) -> list[Figure]:
    """α with its interval, gap, shares, accuracy and detectable sizes over the dates of the logs."""
    if len(logs) < 2:
        return []
    dates = all(date_of(log) for log in logs)
    order = sorted(range(len(logs)), key=lambda k: (logs[k].start_ns or 0) if dates else k)
    at = [date_ms(logs[k]) if dates else float(i + 1) for i, k in enumerate(order)]
    names = [short_name(logs[k]) for k in order]
    marked = [bool(odd[k]) for k in order]
    judged = {one.name: one for one in shown}
    figures = []
    for name, title in (
        ("alpha", "α [(m/s²)/(N·m)]"),
        ("gap_mm", "Held-out gap of the base model [mm]"),
        ("accuracy", "Accuracy"),
    ):
        if name in judged:
            values = [logs[k].number(name) for k in order]
            figures.append(trend_figure(name, title, at, values, names, marked, dates=dates))
    figures.append(shares_figure([logs[k] for k in order], at, names, dates=dates))
    return figures + detectable_figures([logs[k] for k in order], at, names, marked, dates=dates)


def date_ms(log: FleetLog) -> float:
    """The start in milliseconds since 1970, as the page's script takes a date."""
    return (log.start_ns or 0) / 1e6


def horizontal(encoding: Spec, *, dates: bool) -> Spec:
    """The axis of dates, or of numbers of logs."""
    kind = (
        {"type": "temporal", "scale": {"type": "utc"}}
        if dates
        else {"type": "quantitative", "scale": {"zero": False}}
    )
    axis: Spec = {
        "title": "start (UTC)" if dates else "log",
        "tickCount": {"expr": "width / 90"},
        "grid": False,
    }
    if not dates:
        axis |= {"format": "d", "tickMinStep": 1}
    return encoding | kind | {"axis": axis}


def trend_figure(
    name: str,
    title: str,
    at: list[float],
    values: list[float | None],
    names: list[str],
    odd: list[bool],
    *,
    dates: bool,
) -> Figure:
    """A number of each log over its date, the odd ones in orange."""
    data: Columns = {
        "x": at,
        "y": numbers(np.array([np.nan if v is None else v for v in values])),
        "s": names,
        "c": [ODD_COLOUR if one else BLUE for one in odd],
    }
    key = "trend_" + name
    y = charts.quantity(
        "y",
        scale={"zero": False, "nice": True},
        axis={"title": None, "tickCount": 5, "minExtent": 46, "maxExtent": 46},
    )
    place = {"x": horizontal({"field": "x"}, dates=dates), "y": y}
    tip = [{"field": "s", "title": "log"}, {"field": "y", "title": title}]
    layers: list[Spec] = [
        {
            "data": {"name": key},
            "mark": {"type": "line", "color": "#c3ccd6", "strokeWidth": 1.2},
            "encoding": place,
        },
        {
            "data": {"name": key},
            "mark": {"type": "circle", "size": 60, "opacity": 1},
            "encoding": place | {"color": {"field": "c", "type": "nominal", "scale": None}, "tooltip": tip},
        },
    ]
    spec = charts.specification(layers, 170, {"data": [key]})
    return Figure(
        key,
        title,
        spec,
        {key: data},
        [Key(BLUE, "log", "dot")] + ([Key(ODD_COLOUR, "odd", "dot")] if any(odd) else []),
    )


def shares_figure(logs: Sequence[FleetLog], at: list[float], names: list[str], *, dates: bool) -> Figure:
    """Shares of the modes of each log, stacked."""
    data: Columns = {"x": [], "y": [], "y2": [], "c": [], "s": [], "m": [], "p": []}
    seen = []
    for log, x, name in zip(logs, range(1, len(at) + 1), names, strict=True):
        low = 0.0
        for mode in (*MODES, ContactMode.UNDECIDED):
            share = log.number(f"share_{mode.label}") or 0.0
            if share > 0:
                row = {"x": x, "y": round(low, 4), "y2": round(low + share, 4), "c": COLOURS[mode], "s": name}
                for column, value in (row | {"m": mode_name(mode), "p": f"{share:.1%}"}).items():
                    data[column].append(value)
                low += share
                seen.append(mode)
    tip = [{"field": "s", "title": "log"}, {"field": "m", "title": "mode"}, {"field": "p", "title": "share"}]
    x_axis: Spec = {
        "title": "log, in the order of dates" if dates else "log",
        "labels": len(at) <= 60,
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


def detectable_figures(
    logs: Sequence[FleetLog], at: list[float], names: list[str], odd: list[bool], *, dates: bool
) -> list[Figure]:
    """The smallest size of a drag and of a payload that each log would have shown, where gap said so."""
    figures = []
    for effect in ("viscous_drag", "payload"):
        found = [None if log.gap is None else log.gap.minimum_detectable.get(effect) for log in logs]
        values = [None if one is None else one.value for one in found]
        if sum(v is not None for v in values) >= 2:
            unit = next(one.unit for one in found if one is not None)
            title = f"Smallest {effect} that would be seen" + ("" if unit == "1" else f" [{unit}]")
            figures.append(trend_figure(f"least_{effect}", title, at, values, names, odd, dates=dates))
    return figures
