"""Contact modes on the benchmark worlds: ``run`` beside a yardstick that is told everything but the modes.

    python bench/modes_worlds.py --split develop --n 18
    python bench/modes_worlds.py --split report --n 108 --jobs 2
    python bench/modes_worlds.py --split develop --n 9 --hypotheses 160     (doubled: moves by < .003)

Nothing is hidden. Rows are appended to a file; a run that is started again continues there, ``--fresh``
starts over. A table's cell is the mean over the logs of one family, plant and noise; the last four columns
are in hindsight.
"""

import argparse
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import numpy as np  # noqa: E402 (numpy reads the environment)
from quality_logs import replayed  # noqa: E402
from worlds import modes_yardstick, runs, tables  # noqa: E402
from worlds.case import Case  # noqa: E402
from worlds.simulate import simulated  # noqa: E402
from worlds.split import part  # noqa: E402

from wmr_synth.sensors import NOISE_LEVELS  # noqa: E402

Row = dict[str, Any]
RESULTS = Path(__file__).parent / "results"
RUN = {"run": "accuracy", "run_ece": "ece", "later": "hindsight_accuracy", "later_ece": "hindsight_ece"}
"""Columns of a row by columns of the summary."""
COMPARED = ("run", "yardstick", "ece of run", "ece of yardstick")
HEAD = ("family / plant", "noise", "logs", *(f"causal: {name}" for name in COMPARED), *COMPARED)
SHOWN = ("run", "told", "run_ece", "told_ece", "later", "told_later", "later_ece", "told_later_ece")


def cases(split: str, n: int) -> Iterator[Case]:
    """``n`` cases that go round the cells of the split; the noise changes from lap to lap."""
    chosen = part(split)
    noises = list(NOISE_LEVELS)
    for k in range(n):
        lap, cell = divmod(k, len(chosen.cells))
        plant, family = chosen.cells[cell]
        yield Case(plant, family, noises[lap % len(noises)], "", chosen.first_seed + k)


def row_of(case: Case, hypotheses: int) -> Row:
    """One log through ``run`` and the yardstick."""
    world = simulated(case)
    summary = replayed(world.log).tables().summary
    causal = modes_yardstick.causal(world, hypotheses)
    later = modes_yardstick.hindsight(world, hypotheses)
    row: Row = {"key": case.key, **vars(case)} | {name: summary[column] for name, column in RUN.items()}
    row |= {"told": causal.accuracy, "told_ece": causal.ece}
    return row | {"told_later": later.accuracy, "told_later_ece": later.ece}


def lines(rows: list[Row]) -> Iterator[list[str]]:
    """Means by cell and noise, and over all."""
    keys = sorted({(tables.where(row), row["noise"]) for row in rows})
    groups = [(key, [row for row in rows if (tables.where(row), row["noise"]) == key]) for key in keys]
    for key, group in [*groups, (("all", ""), rows)]:
        means = [np.mean([row[name] for row in group]) for name in SHOWN]
        yield [*key, str(len(group)), *(f"{mean:.3f}" for mean in means)]


def main() -> None:
    """Run the cases, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--split", choices=("develop", "report"), default="develop")
    parser.add_argument("--n", type=int, default=18)
    parser.add_argument("--hypotheses", type=int, default=modes_yardstick.HYPOTHESES)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--fresh", action="store_true", help="forget the rows of the file")
    options = parser.parse_args()
    name = f"modes_worlds.{options.split}.{options.hypotheses}.jsonl"
    out = options.out or RESULTS / name
    if options.fresh:
        out.unlink(missing_ok=True)
    work = partial(row_of, hypotheses=options.hypotheses)
    rows = runs.run(work, cases(options.split, options.n), out, options.jobs)
    print(tables.table(HEAD, lines(rows)))


if __name__ == "__main__":
    main()
