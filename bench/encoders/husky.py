"""The Husky's calibration steps: random halves, and each third held out, from wheel speeds or commands.

    python -m bench.encoders.husky husky_windows.csv [--halves 20] [--thirds] [--inputs commands]

A half names its effects; an effect recurs where its p is below 1e-4. A third held out is predicted by dead
reckoning with the nominal robot and with the effects that the other two thirds name.
"""

import argparse
import csv
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import wmr_replay as wr
from wmr_replay.gap.result.result import GapResult

MAP = Path(__file__).parents[2] / "docs" / "examples" / "husky.toml"
LEVEL = 1e-4


def log_of(table: list[dict[str, str]], folder: Path, name: str, chosen: Callable[[int], bool]) -> Path:
    """The log of the steps that are chosen."""
    with (folder / f"{name}.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(table[0]))
        writer.writeheader()
        writer.writerows(row for row in table if chosen(int(row["calib_step"])))
    (folder / f"{name}.mcap").unlink(missing_ok=True)
    wr.convert(folder / f"{name}.csv", MAP, folder / f"{name}.mcap")
    return folder / f"{name}.mcap"


def named(document: GapResult) -> list[tuple[str, ...]]:
    """The classes of the effects with a p below the level, each with the effect's own name first."""
    return [effect.confound_class for effect in document.effects if effect.p_value < LEVEL]


def in_halves(table: list[dict[str, str]], folder: Path, number: int, inputs: str) -> None:
    """Which effects recur in random halves of the steps, by name and by class."""
    steps = sorted({int(row["calib_step"]) for row in table})
    by_name, by_class = Counter[str](), Counter[tuple[str, ...]]()
    for seed in range(number):
        start = time.perf_counter()
        half = set(np.random.default_rng(seed).choice(steps, len(steps) // 2, replace=False).tolist())
        found = named(wr.gap(log_of(table, folder, "half", half.__contains__), inputs=inputs).document)
        by_name.update(one[0] for one in found)
        by_class.update(tuple(sorted(one)) for one in found)
        print(seed, [one[0] for one in found], f"{time.perf_counter() - start:.0f} s", flush=True)
    print("by name:", dict(by_name.most_common()))
    print("by class:", {" = ".join(names): n for names, n in by_class.most_common()})


def thirds(table: list[dict[str, str]], folder: Path, inputs: str) -> None:
    """Dead reckoning over each third of the steps while it is held out."""
    for third in (2, 0, 1):
        fitted = log_of(table, folder, "fitted", lambda step, k=third: step % 3 != k)  # type: ignore[misc]
        held_out = log_of(table, folder, "held_out", lambda step, k=third: step % 3 == k)  # type: ignore[misc]
        found = wr.gap(fitted, inputs=inputs)
        proof = wr.gap(held_out, model=found.model, base="wheel-speed", max_effects=1, inputs=inputs).document
        nominal = wr.gap(held_out, base="wheel-speed", max_effects=1, inputs=inputs).document
        print(f"step mod 3 = {third}:", [effect.name for effect in found.document.effects])
        for name, left in (("nominal", nominal.odometry), ("named", proof.odometry)):
            assert left is not None
            mm = [1e3 * v for v in (left.position_rms_before_m, left.position_median_before_m)]
            yaw = 1e3 * left.yaw_rms_before_rad
            print(f"  {name}: {mm[0]:.0f} ({mm[1]:.0f}) mm, yaw {yaw:.0f} mrad", flush=True)


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv", type=Path)
    parser.add_argument("--halves", type=int, default=0)
    parser.add_argument("--thirds", action="store_true")
    parser.add_argument("--inputs", default="measured", choices=["measured", "commands"])
    given = parser.parse_args()
    with given.csv.open() as file:
        table = list(csv.DictReader(file))
    with TemporaryDirectory() as name:
        if given.thirds:
            thirds(table, Path(name), given.inputs)
        if given.halves:
            in_halves(table, Path(name), given.halves, given.inputs)


if __name__ == "__main__":
    main()
