"""The side files: what the simulator hid, for scoring only."""

import json
from pathlib import Path

import polars as pl

from wmr_schemas import __version__
from wmr_synth.synthesis import SimulatedLog, truth_columns

TRUTH_SCHEMA = pl.Schema(
    {
        "t_ns": pl.Int64,
        "x_m": pl.Float64,
        "y_m": pl.Float64,
        "yaw_rad": pl.Float64,
        "v_long_mps": pl.Float64,
        "v_lat_mps": pl.Float64,
        "yaw_rate_radps": pl.Float64,
        "a_long_mps2": pl.Float64,
        "yaw_acc_radps2": pl.Float64,
        "sigma_sum_mps": pl.Float64,
        "sigma_diff_mps": pl.Float64,
        "effort_left_nm": pl.Float64,
        "effort_right_nm": pl.Float64,
        "mode": pl.Int8,
    }
)


def side_files(log: Path) -> tuple[Path, Path]:
    """``<stem>.truth.json`` and ``<stem>.truth.parquet`` beside the log."""
    return log.with_name(f"{log.stem}.truth.json"), log.with_name(f"{log.stem}.truth.parquet")


def truth_frame(simulated: SimulatedLog) -> pl.DataFrame:
    """The true state series, one row per logged pose."""
    return pl.DataFrame(truth_columns(simulated.truth), schema=TRUTH_SCHEMA)


def write_truth(simulated: SimulatedLog, facts_path: Path, states_path: Path) -> None:
    """Write both side files."""
    facts = {"version": __version__, **simulated.facts}
    facts_path.write_text(json.dumps(facts, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    truth_frame(simulated).write_parquet(states_path)
