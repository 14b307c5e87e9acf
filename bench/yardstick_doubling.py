"""How far doubling its histories moves the yardstick of the modes: twenty families, a log of 30 s each.

    python bench/yardstick_doubling.py [--most 48 96 192] [--logs 20] [--out FILE]

The yardstick is that of ``mode_worlds.py``. Plants and noises take turns; all families are for development.
Rows are appended to --out, and logs that it holds are not run again. 192 histories take half a minute a log.
"""

import argparse
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from mode_worlds import Row, counted_rows, moved_by, rows_in, scores, switch_rates
from worlds.case import Case
from worlds.mode_model import linear_model, to_rows
from worlds.mode_smoother import told_posteriors
from worlds.simulate import simulated

from wmr_synth.sensors import NOISE_LEVELS

CELLS = (
    ("stop-go", 2),
    ("patrol", 1),
    ("teleoperated", 2),
    ("friction-limit", 1),
    ("straight", 2),
    ("slalom", 3),
    ("chase", 1),
    ("ladder", 3),
    ("plough", 2),
    ("search", 1),
    ("skidpad", 3),
    ("museum", 2),
    ("mail", 1),
    ("saws", 3),
    ("pacer", 1),
    ("ferry", 2),
    ("tug", 3),
    ("line", 1),
    ("dash", 2),
    ("forklift", 3),
)
FIRST_SEED = 4_107_000


def told(case: Case, most: int) -> Row:
    """Accuracy of the yardstick with as many histories."""
    world = simulated(case)
    counted, model = counted_rows(world), linear_model(world)
    row: Row = {"family": case.family, "plant": case.plant, "noise": case.noise, "seed": case.seed}
    row["most"] = most
    causal, smoothed = told_posteriors(model, switch_rates(case.family), most)
    for name, posterior, behind in (("causal", causal, True), ("hindsight", smoothed, False)):
        rows = to_rows(posterior, world.log.pose.t_ns, model.rows, behind=behind)
        row["told_" + name] = scores(rows[:, counted], world.truth.mode[counted])
    return row


def main() -> None:
    """Run the logs with each number of histories, and print how far each doubling moves."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--most", type=int, nargs="+", default=[48, 96, 192])
    parser.add_argument("--logs", type=int, default=len(CELLS))
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = rows_in(asked.out) if asked.out and asked.out.exists() else []
    done = {(row["seed"], row["most"]) for row in rows}
    for most in asked.most:
        for k, (family, plant) in enumerate(CELLS[: asked.logs]):
            if (FIRST_SEED + k, most) in done:
                continue
            noise = list(NOISE_LEVELS)[k % len(NOISE_LEVELS)]
            row = told(Case(plant, family, noise, "", FIRST_SEED + k, 30.0), most)
            rows.append(row)
            means = [row["told_" + name]["accuracy"] for name in ("causal", "hindsight")]
            print(f"{family} / {plant} / {noise}, {most} histories: {np.round(means, 3)}", flush=True)
            if asked.out:
                with asked.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    for fewer, more in pairwise(asked.most):
        halves = [[row for row in rows if row["most"] == most] for most in (fewer, more)]
        print(f"{fewer} to {more} histories: {moved_by(*halves)}")


if __name__ == "__main__":
    main()
