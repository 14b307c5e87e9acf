"""What ``batch`` prints: a row per log, each failure, the totals."""

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from wmr_replay.cli.printing.json import echo_document
from wmr_replay.cli.printing.layout import output_width, print_table
from wmr_replay.cli.printing.plain import console_of, styled
from wmr_replay.cli.printing.run import percent
from wmr_schemas.modes import MODES, ContactMode
from wmr_schemas.text import shown, shown_lines

if TYPE_CHECKING:
    from wmr_replay.api.batch import BatchResult
    from wmr_replay.api.places import LogPath

_MAX_ROWS = 60
_MODES = (*MODES, ContactMode.UNDECIDED)


def print_batch(result: "BatchResult", out: "LogPath", *, as_json: bool) -> None:
    """A row per log, each failure in full, and the totals; or all of it as JSON."""
    from wmr_replay.api.batch import fleet_json, totals

    if as_json:
        echo_document(fleet_json(result.fleet))
        return
    console = console_of(width=output_width())
    done = result.fleet.filter(result.fleet["state"] == "done")
    with console.capture() as capture:
        if len(done):
            print_table(console, fleet_table(done.head(_MAX_ROWS).to_dicts()))
        if len(done) > _MAX_ROWS:
            console.print(f"… and {len(done) - _MAX_ROWS} more in fleet.parquet")
        if result.failed:
            print_table(console, failure_table(result))
        for line in total_lines(totals(result.fleet), result):
            console.print(line)
        console.print(styled(f"results   {out}"), soft_wrap=True)
    sys.stdout.write("".join(f"{line.rstrip()}\n" for line in capture.get().splitlines()))


def fleet_table(rows: list[dict[str, Any]]) -> Table:
    """Length, shares of the modes, and accuracy where there is a truth."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("log", no_wrap=True)
    for name in ("minutes", *(mode.label.replace("_", "+") for mode in _MODES), "accuracy"):
        table.add_column(name, justify="right")
    for row in rows:
        shares = [percent(row[f"share_{mode.label}"]) for mode in _MODES]
        table.add_row(shown(row["log"]), f"{row['duration_s'] / 60:.1f}", *shares, percent(row["accuracy"]))
    return table


def failure_table(result: "BatchResult") -> Table:
    """Each log that failed, and the message that ``run`` gives."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("failed", no_wrap=True)
    table.add_column("why", no_wrap=True)
    for outcome in result.failed:
        table.add_row(shown(outcome.log), shown_lines(outcome.problem))
    return table


def total_lines(total: Mapping[str, Any], result: "BatchResult") -> list[Text]:
    """The dataset as a whole, and what this batch did."""
    shares = ", ".join(
        f"{mode.label.replace('_', ' and ')} {percent(total[f'share_{mode.label}'])}"
        for mode in _MODES
        if total[f"share_{mode.label}"]
    )
    lines = [styled((f"{total['n_done']} logs, {total['hours']:.2f} h", "bold"), f"  {shares}")]
    if total["accuracy"] is not None:
        over = f"{total['n_with_truth']} logs with a truth"
        lines.append(styled(f"accuracy  {percent(total['accuracy'])} over {over}"))
    same = [outcome for outcome in result.outcomes if outcome.same_as]
    rest = [outcome for outcome in result.outcomes if not outcome.same_as]
    n_failed, n_skipped = sum(bool(o.problem) for o in rest), sum(o.skipped for o in rest)
    counted = {"new": len(rest) - n_failed - n_skipped, "done before": n_skipped, "failed": n_failed}
    counted["of the same content as another"] = len(same)
    this_time = ", ".join(f"{n} {what}" for what, n in counted.items() if n or what == "new")
    return [*lines, styled(f"this time {this_time}")]
