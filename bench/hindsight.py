"""Hindsight against the causal answer, by driver family, noise and lag.

    python bench/hindsight.py [--logs 6] [--first-seed 20] [--lags 4]
    python bench/hindsight.py --lags 1,2,4,8

Logs are those of ``quality_logs``: made-up robots with a coloured disturbance, one minute each, at 100 Hz.
A row of the table is the mean over the logs of one family and one noise.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from quality_logs import FAMILIES, clean_log, replayed

from wmr_replay.pipeline.settings import Settings
from wmr_schemas.signals import Log
from wmr_synth.sensors import NOISE_LEVELS

RATE_HZ = 100.0


@dataclass(frozen=True)
class Score:
    """Of one log: share of rows with the true mode, causally and by lag; calibration error by lag."""

    causal: float
    hindsight: tuple[float, ...]
    ece: tuple[float, ...]


def score(log: Log, lags_s: list[float]) -> Score:
    """The log replayed once per lag."""
    rows = [replayed(log, settings=Settings(hindsight_lag_s=lag_s)).tables().summary for lag_s in lags_s]
    return Score(
        rows[0]["accuracy"],
        tuple(row["hindsight_accuracy"] for row in rows),
        tuple(row["hindsight_ece"] for row in rows),
    )


def line(family: str, noise: str, scores: list[Score]) -> str:
    """A row of the table."""
    causal = np.mean([s.causal for s in scores])
    hindsight, ece = np.mean([s.hindsight for s in scores], 0), np.mean([s.ece for s in scores], 0)
    cells = [f"{value:.3f}" for value in (causal, *hindsight, *ece)]
    return f"| {family} | {noise} | {len(scores)} | " + " | ".join(cells) + " |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=6, help="per family, shared among the noises")
    parser.add_argument("--first-seed", type=int, default=20)
    parser.add_argument("--lags", default="4", help="in s, separated by commas")
    parser.add_argument("--family", choices=sorted(FAMILIES))
    options = parser.parse_args()
    lags_s = [float(lag) for lag in options.lags.split(",")]
    heads = [f"{lag:g} s" for lag in lags_s]
    names = ["family", "noise", "logs", "causal", *heads, *(f"ece {head}" for head in heads)]
    print(f"| {' | '.join(names)} |\n|{' --- |' * len(names)}")
    every: list[Score] = []
    for family in [options.family] if options.family else FAMILIES:
        for k, noise in enumerate(NOISE_LEVELS):
            seeds = range(options.first_seed + k, options.first_seed + options.logs, len(NOISE_LEVELS))
            logs = (clean_log(family, seed, noise=noise, rate_hz=RATE_HZ) for seed in seeds)
            scores = [score(log, lags_s) for log in logs]
            every += scores
            print(line(family, noise, scores), flush=True)
    print(line("all", "all", every))


if __name__ == "__main__":
    main()
