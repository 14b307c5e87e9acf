"""The simulator's side files, read for scoring only: deleting them changes no estimate."""

import json
from dataclasses import dataclass
from pathlib import Path

import polars as pl


@dataclass(frozen=True, eq=False)
class SideTruth:
    """What lies beside a synthetic log: true states at the pose stamps, true α."""

    states: pl.DataFrame | None = None
    alpha: float | None = None


def read_side_truth(log: Path) -> SideTruth:
    """``<stem>.truth.parquet`` and ``<stem>.truth.json`` beside the log, where they exist and can be read."""
    states, facts = log.with_name(f"{log.stem}.truth.parquet"), log.with_name(f"{log.stem}.truth.json")
    alpha = None
    if facts.is_file():
        alpha = json.loads(facts.read_text(encoding="utf-8")).get("robot", {}).get("alpha")
    return SideTruth(pl.read_parquet(states) if states.is_file() else None, alpha)
