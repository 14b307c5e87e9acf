"""A robot whose stated parameters are far off: accuracy, calibration, and whether intervals of α hold.

    python bench/wide_priors.py [--split develop|report] [--logs 2]

Every log's nominal α is the true one times a factor, its cornering stiffness likewise, and its mode switches
at a rate between one in half a second (stop-go, friction-limit) and one a minute (square-wave, straight). The
split is by combinations of factors and by families: what was tuned on is not reported.
"""

import argparse
import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from mode_worlds import answers, pooled, replayed_tables, scores
from worlds.case import Case
from worlds.simulate import simulated

from wmr_replay.pipeline.settings import Settings
from wmr_schemas.robot import RobotParameters
from wmr_synth.sensors import NOISE_LEVELS

PARTS: dict[str, dict[str, Any]] = {
    "develop": {
        "alpha": (1.0, 2.0, 1 / 3, 5.0),
        "stiffness": (1.0, 0.1),
        "families": ("stop-go", "straight"),
        "seed": 500,
    },
    "report": {
        "alpha": (1.0, 1 / 2, 3.0, 1 / 5),
        "stiffness": (1.0, 10.0, 0.2),
        "families": ("square-wave", "teleoperated", "friction-limit"),
        "seed": 100_500,
    },
}
SETTLED_S = 5.0
Row = dict[str, Any]


def misstated(robot: RobotParameters, alpha: float, stiffness: float) -> RobotParameters:
    """The robot with α, α_yaw and the cornering stiffness off by factors."""
    assert robot.alpha is not None
    assert robot.alpha_yaw is not None
    assert robot.cornering_stiffness_over_epsilon is not None
    return replace(
        robot,
        alpha=robot.alpha * alpha,
        alpha_yaw=robot.alpha_yaw * alpha,
        cornering_stiffness_over_epsilon=robot.cornering_stiffness_over_epsilon * stiffness,
    )


def judged(case: Case, alpha: float, stiffness: float) -> Row:
    """One log with these factors."""
    world = simulated(case)
    told = replace(world, log=replace(world.log, robot=misstated(world.robot, alpha, stiffness)))
    samples, later = replayed_tables(told, Settings())
    counted = world.truth.t_s >= SETTLED_S
    true = world.truth.mode[counted]
    row: Row = {"family": case.family, "alpha": alpha, "stiffness": stiffness, "noise": case.noise}
    for name, table in (("causal", samples), ("hindsight", later)):
        posterior, mode = answers(table)
        row[name] = scores(posterior[:, counted], true, mode[counted])
        row[name]["undecided"] = float(np.mean(mode[counted] < 0))
        known = table.select("alpha", "alpha_sd").to_numpy().T
        at = np.flatnonzero(np.isfinite(known.astype(float)).all(axis=0))
        off, sd = (known[0, at[-1]] - world.robot.alpha, known[1, at[-1]]) if len(at) else (np.nan, np.nan)
        row[name]["alpha_error"] = float(abs(off) / world.robot.alpha)
        row[name]["alpha_holds"] = bool(abs(off) <= 1.96 * sd)
    return row


def table(rows: list[Row]) -> str:
    """Means by factor, by family and over all: causal / hindsight."""
    heads = ("logs with", "n", "accuracy", "ece", "undecided", "α: median error", "α: 95 % interval holds")
    lines = [f"| {' | '.join(heads)} |", "|" + " --- |" * len(heads)]
    groups: dict[str, list[Row]] = {}
    for row in rows:
        keys = (
            f"α × {row['alpha']:.2g}",
            f"stiffness × {row['stiffness']:.2g}",
            row["family"],
            row["noise"],
            "all",
        )
        for key in keys:
            groups.setdefault(key, []).append(row)
    for key in sorted(groups, key=lambda k: (k == "all", k)):
        group, cells = groups[key], []
        for column in ("accuracy", "ece", "undecided", "alpha_error", "alpha_holds"):
            both = []
            for kind in ("causal", "hindsight"):
                values = [row[kind][column] for row in group]
                middle = np.nanmedian if column == "alpha_error" else np.mean
                both.append(pooled(group, kind) if column == "ece" else float(middle(values)))
            cells.append(" / ".join(f"{value:.3f}" for value in both))
        lines.append(f"| {key} | {len(group)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--split", choices=tuple(PARTS), default="develop")
    parser.add_argument("--logs", type=int, default=3, help="per family and combination")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    part, rows = PARTS[asked.split], []
    for family, alpha, stiffness in product(part["families"], part["alpha"], part["stiffness"]):
        for k in range(asked.logs):
            case = Case(1, family, list(NOISE_LEVELS)[k % 3], "", part["seed"] + k, asked.seconds)
            rows.append(judged(case, alpha, stiffness))
            if asked.out:
                with asked.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
