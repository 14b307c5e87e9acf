"""What ``run`` prints: the summary as text or as JSON."""

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from rich.table import Table

from wmr_replay.cli.printing.json import echo_json
from wmr_replay.cli.printing.layout import labelled, output_width, print_title, wrapped
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_schemas.modes import MODES, ContactMode
from wmr_schemas.tables import counted_anomalies, driven_by
from wmr_schemas.text import figure

LABEL = 10
"""Columns of the labels."""

if TYPE_CHECKING:
    from wmr_replay.api.result import Result


def print_result(result: "Result", *, as_json: bool) -> None:
    """The summary as JSON; or modes, scores where there is a truth, what was noticed, the verdict, and how
    to open the viewer.
    """
    from wmr_replay.timeline.viewer import viewer_command

    row, console = result.summary.row(0, named=True), console_of(soft_wrap=True)
    width = output_width()
    if as_json:
        echo_json(
            row | {"settings": result.settings, "notes": result.notes, "findings": list(result.findings)}
        )
        return
    print_title(console, row["log"], overview(row), width)
    for line in hung(design_lines(row), width):
        console.print(styled(line))
    console.print(mode_table(row))
    notes = [f"note      {note}" for note in result.notes]
    for line in hung(
        [*score_lines(row), *anomaly_lines(row), *notes, *finding_lines(result.findings)], width
    ):
        console.print(styled(line))
    console.print()
    for line in wrapped(row["verdict"], width):
        console.print(styled((line, "bold")))
    console.print()
    console.print(styled(f"results   {result.files['samples'].parent}/"))
    if "report" in result.files:
        console.print(styled(f"report    {result.files['report']}"))
    if "timeline" in result.files:
        console.print(styled(f"viewer    {viewer_command(result.files['timeline'])}"))


def hung(lines: Iterable[str], width: int) -> Iterator[str]:
    """Lines that begin with a label, wrapped behind it."""
    for line in lines:
        yield from labelled(line[:LABEL].rstrip(), line[LABEL:], LABEL, width)


def overview(row: Mapping[str, Any]) -> str:
    """Length, rate and window in a line."""
    tuning = json.loads(row["settings"])["tuning"]
    rate = "" if row["rate_hz"] is None else f" at {figure(row['rate_hz'])} Hz"
    window = f", window {tuning['window_s']:.3g} s, delay {tuning['delay_s']:.3g} s" if tuning else ""
    inputs = f"{row['n_torque']} {driven_by(row)}"
    return f"{row['duration_s']:.1f} s, {row['n_pose']} poses{rate}, {inputs}{window}"


def design_lines(row: Mapping[str, Any]) -> list[str]:
    """The differentiator's kernel and why it is that one."""
    tuning = json.loads(row["settings"])["tuning"]
    if not tuning:
        return []
    shares = "".join(
        f", {share:.2f} of {n}" for n, share in enumerate(tuning["shares"], tuning["degree"] + 1)
    )
    kernel = f"degree {tuning['degree']}{shares}, kappa {tuning['kappa']}, mu {tuning['mu']}"
    why = tuning["design_reason"]
    if tuning["error_ratio"] is not None:
        why += f", expected error {tuning['error_ratio']:.2f} of the rule's"
    return [f"kernel    {kernel}, theta {tuning['theta']:.2g} ({why})"]


def mode_table(row: Mapping[str, Any]) -> Table:
    """Share of each mode, and its recall where there is a truth."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    for name, justify in (("mode", "left"), ("share", "right"), ("recall", "right")):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    for mode in (*MODES, ContactMode.UNDECIDED):
        share, recall = row[f"share_{mode.label}"], row.get(f"recall_{mode.label}")
        if share or recall is not None:
            table.add_row(mode.label.replace("_", " and "), percent(share), percent(recall))
    return table


def score_lines(row: Mapping[str, Any]) -> list[str]:
    """How the estimates compare with the truth."""
    if row["accuracy"] is None:
        return []
    later = row.get("hindsight_accuracy")
    delay, p95 = row["median_detection_delay_s"], row["p95_detection_delay_s"]
    decided = f"{percent(row['accuracy_decided'])} of the {percent(row['decided_share'])} decided"
    lines = [f"accuracy  {percent(row['accuracy'])} ({decided})"]
    if later is not None:
        lines.append(f"hindsight {percent(later)} accurate, by the whole log")
    if delay is not None:
        lines.append(
            f"detection {delay:.2f} s median, {p95:.2f} s 95th percentile, {row['missed_switches']} missed"
        )
    if row["false_alarms_per_hour"] is not None:
        lines.append(f"false     {row['false_alarms_per_hour']:.0f} alarms an hour")
    if row["brier"] is not None:
        lines.append(f"posterior Brier score {row['brier']:.3f}, calibration error {row['ece']:.3f}")
    if row["alpha_error"] is not None:
        lines.append(f"alpha     {row['alpha_error']:+.1%} off the true value")
    return lines


def anomaly_lines(row: Mapping[str, Any]) -> list[str]:
    """Every anomaly that was counted."""
    return [f"found     {n} {meaning}" for n, meaning in counted_anomalies(row)]


def percent(value: float | None) -> str:
    """A share as per cent, or a dash."""
    return "–" if value is None else f"{value:.1%}"


def finding_lines(findings: Iterable[Mapping[str, Any]]) -> list[str]:
    """Every finding on the data's quality: its weight and code, what was found, what it means, what to do."""
    lines = []
    for f in findings:
        where = ", ".join(f"{start:.1f}–{end:.1f} s" for start, end in f["where"][:3])
        rest = " …" if len(f["where"]) > 3 else ""
        lines.append(f"{f['severity']:<9} {f['code']}: {f['text']}" + (f" ({where}{rest})" if where else ""))
        lines.append(f"          {f['meaning']}; {f['advice']}")
    return lines
