"""The fleet summary: a row per log, and the totals over all."""

import io
import json
from collections.abc import Sequence
from typing import Any

import polars as pl

from wmr_replay.fleet.dataset import part_name
from wmr_replay.fleet.job import Outcome
from wmr_replay.fleet.store import Store
from wmr_schemas import __version__
from wmr_schemas.modes import MODES, ContactMode
from wmr_schemas.tables import SUMMARY, polars_schema
from wmr_schemas.text import json_text

S_PER_HOUR = 3600.0
SHARES = [f"share_{mode.label}" for mode in (*MODES, ContactMode.UNDECIDED)]


def fleet_frame(store: Store, failed: Sequence[Outcome]) -> pl.DataFrame:
    """A row for every log in the dataset, and for those that failed this time: ``log`` (the partition),
    ``state`` (done, failed), ``problem``, ``path`` and the columns of the summary table.
    """
    summary = polars_schema(SUMMARY)
    schema: dict[str, Any] = {"log": pl.String, "state": pl.String, "problem": pl.String, "path": pl.String}
    schema |= {name: dtype for name, dtype in summary.items() if name != "log"}
    rows = [done_row(store, key) for key in store.done()]
    rows += [
        {"log": outcome.key or None, "state": "failed", "problem": outcome.problem, "path": outcome.log}
        for outcome in failed
    ]
    return pl.DataFrame([dict.fromkeys(schema) | row for row in rows], schema=schema).sort(
        "state", "path", "log", nulls_last=True
    )


def done_row(store: Store, key: str) -> dict[str, Any]:
    """The summary row of a log that is done."""
    (row,) = pl.read_parquet(io.BytesIO(store.read(part_name("summary", key)))).to_dicts()
    return {"log": key, "state": "done", **row}


def totals(fleet: pl.DataFrame) -> dict[str, Any]:
    """Logs, hours, shares of the modes by time, and accuracy by time where there is a truth."""
    done = fleet.filter(pl.col("state") == "done")
    seconds = float(done["duration_s"].sum())
    scored = done.filter(pl.col("accuracy").is_not_null())
    return {
        "n_done": len(done),
        "n_failed": len(fleet) - len(done),
        "hours": seconds / S_PER_HOUR,
        **{name: weighted(done, name) for name in SHARES},
        "n_with_truth": len(scored),
        "accuracy": weighted(scored, "accuracy"),
    }


def weighted(rows: pl.DataFrame, column: str) -> float | None:
    """Mean by duration over the rows where it is known; None where it is known nowhere."""
    known = rows.filter(pl.col(column).is_not_null())
    seconds, whole = float(known["duration_s"].sum()), float((known[column] * known["duration_s"]).sum())
    return whole / seconds if seconds else None


def write_fleet(store: Store, fleet: pl.DataFrame) -> None:
    """``fleet.parquet`` and ``fleet.json``."""
    buffer = io.BytesIO()
    fleet.write_parquet(buffer)
    store.put_bytes(buffer.getvalue(), "fleet.parquet")
    store.put_bytes((fleet_json(fleet) + "\n").encode(), "fleet.json")


def fleet_json(fleet: pl.DataFrame) -> str:
    """Totals and rows as JSON, settings, notes and findings unfolded."""
    rows = fleet.to_dicts()
    for row in rows:
        row |= {
            name: json.loads(row[name]) for name in ("settings", "notes", "findings") if row[name] is not None
        }
    content = {"version": __version__, "totals": totals(fleet), "logs": rows}
    return json_text(content)
