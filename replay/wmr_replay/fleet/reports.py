"""The reports of a dataset: a page per log, drawn from its stored tables, and the page of the fleet."""

import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import polars as pl

from wmr_replay.fleet.dataset import part_name, report_name
from wmr_replay.fleet.job import Outcome
from wmr_replay.fleet.store import Store
from wmr_replay.fleet.summary import totals
from wmr_replay.report.fleet import fleet_page
from wmr_replay.report.fleet_logs import FleetLog
from wmr_replay.report.run import RunTables, run_page
from wmr_schemas.gap_file import GapFile

FLEET_PAGE = "report.html"
GAPS = "gap"
"""Folder of the dataset in which gap analyses of its logs are looked for."""


def write_reports(store: Store, fleet: pl.DataFrame, outcomes: Iterable[Outcome]) -> None:
    """Write the page of each log that was replayed now or has none yet, then the fleet's page."""
    fresh = {outcome.key for outcome in outcomes if not outcome.skipped and not outcome.problem}
    gaps = gaps_by_hash(store)
    logs = []
    for row in fleet.iter_rows(named=True):
        if row["state"] != "done":
            logs.append(FleetLog(row))
            continue
        name = report_name(row["log"])
        if row["log"] in fresh or store.size(name) is None:
            store.put_bytes(log_page(store, row["log"]).encode(), name)
        findings = json.loads(row["findings"] or "[]")
        logs.append(FleetLog(row, started(store, row["log"]), name, gaps.get(row["log_sha256"]), findings))
    title = Path(str(store.place)).name or "fleet"
    store.put_bytes(fleet_page(logs, totals(fleet), title).encode(), FLEET_PAGE)


def log_page(store: Store, key: str) -> str:
    """The page of one log, out of its tables in the dataset."""

    def frame(table: str) -> pl.DataFrame | None:
        name = part_name(table, key)
        return None if store.size(name) is None else pl.read_parquet(io.BytesIO(store.read(name)))

    summary, samples = frame("summary"), frame("samples")
    assert summary is not None  # the record lists both
    assert samples is not None
    row: dict[str, Any] = summary.row(0, named=True)
    row["log"] = row["path"]
    later = frame("hindsight")
    tables = RunTables(row, samples.lazy(), None if later is None else later.lazy(), frame("confusion"))
    return run_page(tables, Path(str(row["path"])).name)


def started(store: Store, key: str) -> int | None:
    """Stamp of the log's first row."""
    segments = pl.read_parquet(io.BytesIO(store.read(part_name("segments", key))), columns=["start_ns"])
    return int(segments["start_ns"][0]) if len(segments) else None


def gaps_by_hash(store: Store) -> dict[str, GapFile]:
    """The gap analyses in the dataset's folder ``gap``, by the hash of their log; what is no such file is
    passed over.
    """
    found = {}
    for name in store.names(GAPS, ".gap.json"):
        try:
            gap = msgspec.json.decode(store.read(f"{GAPS}/{name}"), type=GapFile)
        except (msgspec.DecodeError, OSError):
            continue
        found[gap.log_sha256] = gap
    return found
