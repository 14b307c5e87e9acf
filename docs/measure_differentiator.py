"""Compares the tuned default with the rule: ``python docs/measure_differentiator.py [--seeds 3]``.

Prints errors against the truth at the instants t − delay, from 10 s on, and the accuracy of each identifier,
as Markdown. ``--write`` puts the tables into ``docs/differentiator.md``; ``--seeds`` sets the number of logs.
"""

import argparse
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import numpy as np
import polars as pl
from measure_paper import filled

import wmr_replay as wr
from wmr_replay.pipeline.settings import Settings
from wmr_synth import Sensors, synthesise
from wmr_synth.synthesis import SimulatedLog

PAGE = Path(__file__).with_name("differentiator.md")
SCENARIOS = ("paper-acceleration", "random", "stop-and-go", "figure-eight")
NOISES, RATES_HZ = (1e-1, 1e-2, 1e-4), (1000.0, 100.0)
QUANTITIES = ("v_long_mps", "yaw_rate_radps", "a_long_mps2")
IDENTIFIERS = ("paper", "algebraic", "bank")
FROM_S = 10.0


def simulated(scenario: str, rate_hz: float, noise: float, seed: int) -> SimulatedLog:
    """A log of 60 s with noise of this standard deviation [m and rad], torques at 100 Hz."""
    sensors = Sensors(rate_hz=rate_hz, noise_xy_sd_m=noise, noise_yaw_sd_rad=noise)
    return synthesise(scenario, seed=seed, duration_s=60.0, sensors=sensors)


def errors(log: SimulatedLog, samples: pl.DataFrame) -> list[float]:
    """Root mean square errors of the three quantities, from 10 s on."""
    late = samples.filter(pl.col("t_s") > FROM_S).drop_nulls("v_long_mps")
    at_ns = late["t_ns"].to_numpy() - late["delay_s"].to_numpy() * 1e9
    true = {name: getattr(log.truth, name) for name in QUANTITIES[:2]}
    true["a_long_mps2"] = np.gradient(log.truth.v_long_mps, log.log.pose.t_ns / 1e9)
    return [
        float(
            np.sqrt(np.mean((late[name].to_numpy() - np.interp(at_ns, log.log.pose.t_ns, true[name])) ** 2))
        )
        for name in QUANTITIES
    ]


def accuracy(_: SimulatedLog, samples: pl.DataFrame) -> list[float]:
    """Share of rows, from 10 s on, whose mode is right; undecided counts as wrong."""
    late = samples.filter(pl.col("t_s") > FROM_S)
    return [float((late["mode"] == late["mode_true"]).mean())]  # type: ignore[arg-type]


def compared(
    log: SimulatedLog, score: Callable[[SimulatedLog, pl.DataFrame], list[float]], identifier: str
) -> list[list[float]]:
    """Scores with the tuned default and with the rule."""
    choices = (Settings(identifier=identifier), Settings(identifier=identifier, tune=False))
    results = (wr.replay(log.log, **settings.as_dict()) for settings in choices)
    return [score(log, pl.concat(result.stored_batches())) for result in results]


def line(cells: list[str]) -> str:
    """A line of a Markdown table."""
    return "| " + " | ".join(cells) + " |"


def table(head: list[str], rows: Iterator[list[str]]) -> str:
    """A Markdown table; each line is printed as soon as it is measured."""
    lines = [line(head), line(["---"] * len(head))]
    print("\n".join(lines), flush=True)
    for cells in rows:
        lines.append(line(cells))
        print(lines[-1], flush=True)
    return "\n".join(lines) + "\n"


def error_rows(seeds: int) -> Iterator[list[str]]:
    """Rows by scenario and rate: tuned over rule by noise (geometric mean over seeds), then the worst log."""
    for scenario, rate_hz in product(SCENARIOS, RATES_HZ):
        cells, worst = [scenario, f"{rate_hz:g} Hz"], 0.0
        for noise in NOISES:
            logs = (simulated(scenario, rate_hz, noise, seed) for seed in range(seeds))
            both = np.array([compared(log, errors, "paper") for log in logs])
            ratios = both[:, 0] / both[:, 1]
            cells.append(" / ".join(f"{value:.2f}" for value in np.exp(np.mean(np.log(ratios), axis=0))))
            worst = max(worst, float(ratios.max()))
        yield [*cells, f"{worst:.2f}"]


def accuracy_rows(seeds: int) -> Iterator[list[str]]:
    """Rows by scenario and noise: accuracy of each identifier, tuned and rule."""
    paper = product(("paper-acceleration", "paper-deceleration"), (0.1**0.5,), (1000.0,))
    cases = [*paper, *product(SCENARIOS[1:], (1e-2, 1e-4), (100.0,))]
    for scenario, noise, rate_hz in cases:
        logs = [simulated(scenario, rate_hz, noise, seed) for seed in range(seeds)]
        cells = [scenario, f"{noise:.3g}", f"{rate_hz:g} Hz"]
        for identifier in IDENTIFIERS:
            tuned, rule = np.mean([compared(log, accuracy, identifier) for log in logs], axis=0)[:, 0]
            cells.append(f"{tuned:.1%} / {rule:.1%}".replace("%", " %"))
        yield cells


def main() -> None:
    """Print both tables; with ``--write``, also put them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/differentiator.md")
    options = parser.parse_args()
    noises = [f"{noise:g}" for noise in NOISES]
    tables = {
        "tuned errors": table(["scenario", "rate", *noises, "worst"], error_rows(options.seeds)),
        "tuned accuracy": table(["scenario", "noise", "rate", *IDENTIFIERS], accuracy_rows(options.seeds)),
    }
    if options.write:
        PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), tables), encoding="utf-8")


if __name__ == "__main__":
    main()
