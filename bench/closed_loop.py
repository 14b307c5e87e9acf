"""Modes by ``run`` on a second log of a robot: with its base model, and with what ``gap`` found on a first.

    python bench/closed_loop.py --library torque --n 2
    python bench/closed_loop.py --library wheel-speed --n 2 --effect slip_ratio
    python bench/closed_loop.py --show bench/results/closed_loop.jsonl

Every static effect of the library is hidden in turn, ``--n`` times at each of three noises. The drivers and
plants are those that are only reported; the two logs of a pair have different drivers. ``true`` stands for
the model with the hidden effect itself. A mode that is not named counts as wrong.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import numpy as np  # noqa: E402
from loop import together, torques, wheels  # noqa: E402
from loop.forward import path_errors  # noqa: E402
from loop.pair import Pair  # noqa: E402
from worlds.case import RanAway  # noqa: E402

import wmr_replay as wr  # noqa: E402 (numpy reads the environment)
from wmr_schemas.errors import InvalidSignal  # noqa: E402
from wmr_schemas.model_file import Model  # noqa: E402
from wmr_synth.sensors import NOISE_LEVELS  # noqa: E402

LIBRARIES = {"torque": torques, "wheel-speed": wheels, "both": together}
FIRST_SEED = {
    ("torque", "develop"): 5_000,
    ("torque", "report"): 410_000,
    ("both", "develop"): 6_000,
    ("both", "report"): 230_000,
    ("wheel-speed", "develop"): 5_000,
    ("wheel-speed", "report"): 210_000,
}
SECONDS = (90.0, 60.0)
KINDS = ("causal", "hindsight")
Row = dict[str, Any]


def accuracies(pair: Pair, model: Model) -> dict[str, float]:
    """Shares of the counted rows whose mode is right, as known at the time and in hindsight."""
    result = wr.replay(pair.other, model=model, evidence=pair.evidence)
    tables = result.samples.collect(), result.hindsight.collect()
    codes = ("ideal", "skidding", "slipping", "skidding_slipping")
    found = {}
    for kind, table in zip(KINDS, tables, strict=True):
        said = table["mode"].cast(str).to_numpy()
        true = np.array(codes)[pair.mode]
        found[kind] = float(np.mean((said == true)[pair.counted]))
    return found


def judged(split: str, library: str, effect: str, noise: str, seed: int, cell: int, *, told: bool) -> Row:
    """One pair: accuracies on the second log with each model, and what was found on the first."""
    row: Row = {"library": library, "effect": effect, "noise": noise, "seed": seed, "cell": cell}
    try:
        pair = LIBRARIES[library].pair(split, effect, noise, seed, cell, SECONDS)
    except RanAway as error:
        return row | {"error": str(error)}
    before = time.process_time()
    model, found = pair.true, [effect]
    if not told:
        try:
            result = pair.analyse(pair.fitted, pair.base)
            model, found = result.model, [e.name for e in result.effects]
        except InvalidSignal as error:
            model, found = pair.base, [str(error)]
    row |= {"found": found, "gap_cpu_s": time.process_time() - before}
    row["base"] = accuracies(pair, pair.base)
    row["extended"] = accuracies(pair, model) if found else row["base"]
    row["true"] = row["extended"] if told else accuracies(pair, pair.true)
    models = {"base": pair.base, "extended": model, "true": pair.true}
    row["path_m"] = {name: path_errors(pair, one) for name, one in models.items()}
    return row | {"cpu_s": time.process_time() - before}


def differences(rows: list[Row], model: str, kind: str) -> np.ndarray:
    """Accuracy with the model less that with the base, pair by pair."""
    return np.array([row[model][kind] - row["base"][kind] for row in rows])


def table(rows: list[Row]) -> str:
    """Means by effect and by noise: accuracy with the base; what each model adds, with standard error."""
    rows = [row for row in rows if "base" in row]
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(f"`{row['effect']}`", []).append(row)
    for row in rows:
        groups.setdefault(row["noise"], []).append(row)
    groups["all"] = rows
    lines = [
        "| hidden | n | found | causal: base | extended adds | true adds "
        "| hindsight: base | extended adds | true adds |",
        "|" + " --- |" * 9,
    ]
    for name, mine in groups.items():
        cells = []
        for kind in KINDS:
            cells.append(f"{np.mean([row['base'][kind] for row in mine]):.3f}")
            for model in ("extended", "true"):
                gain = differences(mine, model, kind)
                se = np.std(gain, ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.nan
                cells.append(f"{gain.mean():+.4f} ± {se:.4f}")
        told = sum(bool(row["found"]) for row in mine)
        lines.append(f"| {name} | {len(mine)} | {told} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Judge the pairs, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", choices=tuple(LIBRARIES), default="torque")
    parser.add_argument("--split", choices=("develop", "report"), default="report")
    parser.add_argument("--effect")
    parser.add_argument("--told", action="store_true", help="without gap: the hidden effect is told")
    parser.add_argument("--n", type=int, default=1, help="pairs of an effect at each noise")
    parser.add_argument("--first-seed", type=int)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--show", type=Path)
    asked = parser.parse_args()
    if asked.show:
        print(table([json.loads(line) for line in asked.show.read_text(encoding="utf-8").splitlines()]))
        return
    first = FIRST_SEED[asked.library, asked.split] if asked.first_seed is None else asked.first_seed
    effects = LIBRARIES[asked.library].EFFECTS
    rows = []
    for place, effect in enumerate(effects):
        if asked.effect not in (None, effect):
            continue
        for k in range(asked.n * len(NOISE_LEVELS)):
            noise = list(NOISE_LEVELS)[k % len(NOISE_LEVELS)]
            number = place * 100 + k
            row = judged(
                asked.split, asked.library, effect, noise, first + number, place + 2 * k, told=asked.told
            )
            rows.append(row)
            print(json.dumps(row), file=sys.stderr, flush=True)
            if asked.out:
                asked.out.parent.mkdir(parents=True, exist_ok=True)
                with asked.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
