"""Many cases in several processes, their rows appended to a file of JSON lines; a run can be resumed."""

import json
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from worlds.case import Case

Row = dict[str, Any]


def read_rows(path: Path) -> list[Row]:
    """The rows of a file; an incomplete last row is left out."""
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            print(f"left out a line of {path} that was broken off", file=sys.stderr)
    return rows


def effects_said(effects: Iterable[Any]) -> list[Row]:
    """The effects of an answer: names, exact classes, what alternatives lack, parameters with intervals."""
    return [
        {
            "name": effect.name,
            "class": list(effect.confound_class),
            "alternatives": {other.name: other.delta_bic for other in effect.alternatives},
            "parameters": {key: [e.value, *e.ci95] for key, e in effect.parameters.items()},
        }
        for effect in effects
    ]


def run(work: Callable[[Case], Row], cases: Iterable[Case], path: Path, jobs: int) -> list[Row]:
    """The rows of all cases: those of the file, and the others computed and appended."""
    path.parent.mkdir(parents=True, exist_ok=True)
    wanted = {case.key: case for case in cases}
    known = {row["key"] for row in read_rows(path)}
    left = [case for key, case in wanted.items() if key not in known]
    begun = time.monotonic()
    with path.open("a", encoding="utf-8") as file, ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(work, case) for case in left]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                file.write(json.dumps(future.result()) + "\n")
                file.flush()
                left_s = (time.monotonic() - begun) / done * (len(left) - done)
                print(f"\r{done}/{len(left)}  {left_s / 60:.0f} min left ", end="", file=sys.stderr)
        finally:
            pool.shutdown(cancel_futures=True)
    return [row for row in read_rows(path) if row["key"] in wanted]
