"""Simulate, record and replay a scenario, for the page of the paper's figures."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import polars as pl

from wmr_replay.jobs.run import run_log
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.robot import PAPER_ROBOT
from wmr_synth import SCENARIOS, record, synthesise

PAPER_SCHEME = Settings(identifier="paper", tune=False)
"""The paper's thresholds with a kernel of the paper's kind."""
QUICK_DURATION_S, QUICK_RATE_HZ = 24.0, 200.0


@dataclass(frozen=True)
class Replayed:
    """The samples table, the true states (side file, with ``t_s`` from the same start), the summary row."""

    samples: pl.DataFrame
    truth: pl.DataFrame
    summary: dict[str, Any]


def replay(scenario: str, *, seed: int = 0, quick: bool = False) -> Replayed:
    """``wmr-replay synth`` and ``run --identifier paper --no-tune`` in a temporary folder.

    ``quick`` uses a short log at a low rate, to try the command rather than to measure.
    """
    chosen = SCENARIOS[scenario]
    sensors = replace(chosen.sensors, rate_hz=QUICK_RATE_HZ) if quick else chosen.sensors
    simulated = synthesise(
        chosen, seed=seed, sensors=sensors, duration_s=QUICK_DURATION_S if quick else chosen.duration_s
    )
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, f"{scenario}.mcap")
        record(simulated, log)
        result = run_log(log, Path(folder, "results"), settings=PAPER_SCHEME, timeline=False)
        samples = pl.read_parquet(result.files["samples"])
        truth = pl.read_parquet(log.with_name(f"{scenario}.truth.parquet"))
    start_ns = samples["t_ns"][0]
    return Replayed(samples, truth.with_columns(t_s=(pl.col("t_ns") - start_ns) / 1e9), result.summary)


def quotient() -> pl.Expr:
    """The paper's α at each row, (14) and (15): (dv_long/dt − v_lat ω/3) / Σeffort, as ``quotient``.

    Σeffort through the window is (dv_long/dt − C_d)/α with the α of the log's metadata.
    """
    effort = (pl.col("a_long_mps2") - pl.col("c_d_mps2")) / PAPER_ROBOT.alpha
    response = pl.col("a_long_mps2") - pl.col("v_lat_mps") * pl.col("yaw_rate_radps") / 3
    return (response / effort).alias("quotient")
