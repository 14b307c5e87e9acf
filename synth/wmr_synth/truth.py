"""The side files: what the simulator hid, for scoring only."""

import json
from pathlib import Path

import polars as pl

from wmr_schemas import __version__
from wmr_schemas.tables import TRUTH, polars_schema
from wmr_synth.synthesis import SimulatedLog, truth_columns

TRUTH_SCHEMA = polars_schema(TRUTH)


def side_files(log: Path) -> tuple[Path, Path]:
    """``<stem>.truth.json`` and ``<stem>.truth.parquet`` beside the log."""
    return log.with_name(f"{log.stem}.truth.json"), log.with_name(f"{log.stem}.truth.parquet")


def truth_frame(simulated: SimulatedLog) -> pl.DataFrame:
    """The true state series, one row per logged pose."""
    frame = pl.DataFrame(truth_columns(simulated.truth), schema=TRUTH_SCHEMA)
    return frame.with_columns(pl.col("effort_left_nm", "effort_right_nm").fill_nan(None))


def write_truth(simulated: SimulatedLog, facts_path: Path, states_path: Path) -> None:
    """Write both side files."""
    facts = {"version": __version__, **simulated.facts}
    facts_path.write_text(json.dumps(facts, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    truth_frame(simulated).write_parquet(states_path)
