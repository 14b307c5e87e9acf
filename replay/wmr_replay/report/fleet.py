"""The page of a batch: a row per log, what is odd about it, and trends over dates."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wmr_replay.report import page
from wmr_replay.report.fleet_logs import (
    JUDGED,
    RULE,
    FleetLog,
    Judged,
    date_of,
    have_dates,
    odd_ones,
    short_name,
)
from wmr_replay.report.modes import COLOURS
from wmr_replay.report.run import length
from wmr_replay.report.trends import trends
from wmr_replay.timeline.colours import mode_name
from wmr_schemas import __version__
from wmr_schemas.modes import MODES, ContactMode


def fleet_page(logs: Sequence[FleetLog], total: Mapping[str, Any], name: str) -> str:
    """The page of a batch, as the text of a file. Raises MissingExtra."""
    sheet = page.Page(name, "fleet", wide=True)
    done = [log for log in logs if log.row["state"] == "done"]
    failed = [log for log in logs if log.row["state"] != "done"]
    shown = [one for one in JUDGED if any(log.number(one.name) for log in done)]
    odd = odd_ones(done, shown)
    n_odd = sum(bool(o) for o in odd)
    sheet.add(verdict(done, failed, n_odd), bar(total), page.facts(fact_list(done, failed, n_odd, total)))
    if failed:
        sheet.section("Failed")
        sheet.add(failures(failed))
    sheet.section("Logs", "Click a heading to sort.")
    sheet.add(page.paragraph(RULE, "note"), log_table(done, shown, odd))
    drawn = trends(done, shown)
    if drawn:
        how = (
            "Over the start of each log."
            if have_dates(done)
            else "In the order of the logs, which have no dates of their own."
        )
        sheet.section("Trends", how)
        sheet.figures(drawn[0::2], drawn[1::2])
    sheet.add(page.footer([f"wmr-replay {__version__}"]))
    return sheet.text()


def failures(failed: Sequence[FleetLog]) -> str:
    """Each log that failed, and the message that ``run`` gives."""
    items = (
        f"<li><b>{page.escape(short_name(log))}</b><br>{page.lines(log.row['problem'])}</li>"
        for log in failed
    )
    return f'<ul class="plain problems">{"".join(items)}</ul>'


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
        ("odd", "count"),
        ("date", "text"),
        ("length", "number"),
        *((one.heading, "number") for one in shown),
    ]
    if any(log.gap is not None for log in logs):
        heads.insert(4, ("missing", "text"))
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
    marks = "<br>".join(map(page.escape, odd))
    cells = [
        f'<td data-v="{page.escape(log.row["path"])}">{link}</td>',
        f'<td class="mark" data-v="{len(odd)}">{marks}</td>',
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
    return f"<tr{' class=odd' if odd else ''}>{''.join(cells)}</tr>"


def cell(value: object, text: str, *, number: bool = False) -> str:
    """A cell with the value that sorts it."""
    kept = "" if value is None else page.escape(value)
    return f'<td data-v="{kept}"{" class=n" if number else ""}>{page.escape(text)}</td>'
