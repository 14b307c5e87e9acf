"""How long a warm command takes: a log of 60 s, beside an interpreter that imports the libraries alone.

Compiled code is kept before. Commands and imports take turns, so that a busy machine slows both; the ratio of
their processor times is what says whether a command has become slower. Bounds: `run` of 60 s at 100 Hz 2 s,
and at most RATIO times the imports.

    python bench/latency.py [--repeats 9] [--strict]
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

LIBRARIES = "import numpy, polars, numba, rerun"
COMMAND = "from wmr_replay.cli import main; main()"
RUN, MOST_S, RATIO = "run", 2.0, 2.6


class Cost(NamedTuple):
    """Wall time and processor time of a process and its children, in s."""

    wall_s: float
    processor_s: float


def cost(*arguments: str) -> Cost:
    """What ``python ARGUMENTS`` costs. Ends the measurement where it fails."""
    before, start_s = os.times(), time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)
    wall_s, after = time.perf_counter() - start_s, os.times()
    if done.returncode:
        raise SystemExit(done.stderr)
    spent = (after.children_user - before.children_user, after.children_system - before.children_system)
    return Cost(wall_s, sum(spent))


def in_turns(calls: dict[str, Sequence[str]], repeats: int) -> dict[str, list[Cost]]:
    """Each call once to warm up, then all of them in turns."""
    for call in calls.values():
        cost(*call)
    found: dict[str, list[Cost]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            found[name].append(cost(*call))
    return found


def main() -> None:
    """Print the table; with --strict a bound that does not hold is an error."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--strict", action="store_true")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        slow, fast, out = (str(Path(folder) / name) for name in ("slow.mcap", "fast.mcap", "out"))
        for log, rate in ((slow, "100"), (fast, "1000")):
            cost("-c", COMMAND, "synth", "patrol", "--duration", "60", "--rate", rate, "--out", log)
        calls = {
            "imports": ("-c", LIBRARIES),
            RUN: ("-c", COMMAND, "run", slow, "--out", out),
            "run, 1 kHz": ("-c", COMMAND, "run", fast, "--out", out),
            "info": ("-c", COMMAND, "info", slow),
        }
        found = in_turns(calls, asked.repeats)
    base_s = min(one.processor_s for one in found["imports"])
    for name, costs in found.items():
        wall_s, least_s = median(one.wall_s for one in costs), min(one.processor_s for one in costs)
        line = f"{name:11s} {wall_s:5.2f} s (median), {least_s:5.2f} s of processor time (least)"
        print(f"{line}, {least_s / base_s:4.1f} times the imports")
    ratio = min(one.processor_s for one in found[RUN]) / base_s
    print(f"asked of {RUN}: {MOST_S:.1f} s, and {RATIO:.1f} times the imports at most")
    if asked.strict and (ratio > RATIO or median(one.wall_s for one in found[RUN]) > MOST_S):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
