"""Benchmark of the gap analysis on logs with hidden effects, and on logs in which nothing is missing.

    python bench/gap.py [--cases all|quick|NAME,…] [--jobs 2] [--seed 500000] [--out FILE]
    python bench/gap.py --report [--out FILE]     writes the tables of docs/gap-benchmark.md
    python bench/gap.py --baselines [--out FILE]  the baselines on a part of the same logs

Rows are appended to a JSON-lines file as they are computed. A run that is started again continues there,
unless the sources have changed. All logs are made in memory from seeds; the truth never enters the analysis.
"""

import argparse
import json
import os
import random
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

from gap_cases import Case, cases_of, chosen_sets  # noqa: E402 (numpy reads the environment)
from gap_report import write_report  # noqa: E402
from gap_rows import Task, row_of, state_of_sources, warm_up  # noqa: E402

DEFAULT_SEED = 500_000
DEFAULT_FILE = Path(__file__).parent / "results" / "gap.jsonl"

Row = dict[str, Any]


def read_rows(path: Path) -> list[Row]:
    """The rows of a results file; an incomplete last row is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            print(f"left out a line of {path} that was broken off", file=sys.stderr)
    return rows


def interleaved(lists: list[list[Case]]) -> Iterator[Case]:
    """The cases of all lists, shuffled together, so that an interrupted run covers every list."""
    mixed = random.Random(1)
    tagged = []
    for i, cases in enumerate(lists):
        order = mixed.sample(range(len(cases)), len(cases))
        tagged += [(place / len(cases), i, cases[k]) for place, k in enumerate(order)]
    return (case for _, _, case in sorted(tagged, key=lambda entry: entry[:2]))


def run_all(
    work: Callable[[Any], Row], tasks: list[Any], path: Path, jobs: int, prepare: Callable[[], None]
) -> None:
    """Append the row of every task to the file, and print progress and remaining time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    with path.open("a") as file, ProcessPoolExecutor(jobs, initializer=prepare) as pool:
        for done, row in enumerate(finished(pool, work, tasks), 1):
            file.write(json.dumps(row) + "\n")
            file.flush()
            left_s = (time.monotonic() - start) / done * (len(tasks) - done)
            print(f"\r{done}/{len(tasks)}  {left_s / 60:.0f} min left ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def finished(pool: ProcessPoolExecutor, work: Callable[[Any], Row], tasks: Iterable[Any]) -> Iterator[Row]:
    """Rows in the order of completion."""
    futures = [pool.submit(work, task) for task in tasks]
    try:
        for future in as_completed(futures):
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)


def run_cases(choice: str, seed: int, path: Path, jobs: int) -> None:
    """The cases that are not yet in the file."""
    state = state_of_sources()
    known = {row["key"]: row["state"] for row in read_rows(path)}
    cases = interleaved([list(cases_of(s, seed)) for s in chosen_sets(choice)])
    tasks = [Task(case, state) for case in cases if known.get(case.key) != state]
    print(f"{len(tasks)} logs to analyse, into {path}", file=sys.stderr)
    run_all(row_of, tasks, path, jobs, warm_up)


def main() -> None:
    """Run the benchmark or its baselines, or write the report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", default="quick", help="all, quick, or names of sets with commas")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=DEFAULT_SEED)
    parser.add_argument("--out", type=Path, default=DEFAULT_FILE)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--baselines", action="store_true")
    options = parser.parse_args()
    if options.report:
        write_report(read_rows(options.out), read_rows(baseline_file(options.out)))
    elif options.baselines:
        from gap_baselines import run_baselines  # noqa: PLC0415 (needs PySINDy, which the rest does not)

        run_baselines(options.seed, baseline_file(options.out), options.jobs)
    else:
        run_cases(options.cases, options.seed, options.out, options.jobs)


def baseline_file(out: Path) -> Path:
    """Path of the file with the baselines' rows."""
    return out.with_suffix(".baselines.jsonl")


if __name__ == "__main__":
    main()
