"""Baselines on a part of the benchmark's logs: PySINDy's STLSQ, single shooting + BIC, "always drive gain".

They have two advantages: the true contact modes, and the best of all settings at each noise level.
"""

import json
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any

from gap_cases import NOISES, SETS, SINGLES, Case, cases_of
from gap_scores import score
from gap_shooting import shot_names
from gap_sindy import EXPRESSIBLE, SETTINGS, sindy_names
from gap_truth import effects_of, schedule_of

from wmr_schemas.signals import Log, ModeTrack
from wmr_synth.synthesis import START_NS

Row = dict[str, Any]
N_SINGLE, N_NOTHING = len(SINGLES) * len(NOISES), 30


def baseline_cases(seed: int) -> list[Case]:
    """Cases: every effect once at every noise, and logs with nothing missing."""
    sets = {s.name: s for s in SETS}
    nothing = islice(cases_of(sets["nothing"], seed), N_NOTHING)
    return [*islice(cases_of(sets["single"], seed), N_SINGLE), *nothing]


def rows_of(case: Case) -> list[Row]:
    """Rows of one log: the effects named by each method and setting, the first name first."""
    simulated = case.simulated()
    log, modes = simulated.log, schedule_of(simulated.facts)
    told = Log(log.pose, log.torque, ModeTrack(START_NS + modes.t_ns, modes.mode), log.robot)
    said = {f"PySINDy STLSQ|{setting}": names for setting, names in sindy_names(told).items()}
    said["single shooting + BIC"] = shot_names(told)
    said["always drive gain"] = ["drive_gain"]
    common = {
        "key": case.key,
        "set": case.set.name,
        "noise": case.noise,
        "seed": case.seed,
        "hidden": [{"name": e.name, "parameters": e.parameters} for e in effects_of(simulated.facts)],
        "expressible": bool(case.hide) and set(case.hide) <= EXPRESSIBLE,
    }
    return [common | {"method": method} | claimed(names) for method, names in said.items()]


def claimed(names: list[str]) -> Row:
    """Names in the form of a result of the analysis."""
    effects = [{"name": name, "class": [name], "alternatives": {}, "parameters": {}} for name in names]
    return {"verdict": "named" if names else "nothing_missing", "effects": effects, "notes": []}


def best_setting(rows: list[Row]) -> str:
    """The setting with the best sum of two shares.

    They are the share of right first names among effects with a term, and the share of logs with nothing
    missing on which nothing is named.
    """
    by_setting: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_setting[row["method"].partition("|")[2]].append(row)

    def worth(setting: str) -> float:
        scores = [score(row) for row in by_setting[setting]]
        right = [one.first for one in scores if one.row["expressible"]]
        silent = [not one.claims for one in scores if not one.row["hidden"]]
        return sum(right) / max(len(right), 1) + sum(silent) / max(len(silent), 1)

    return max(by_setting, key=worth)


def kept_rows(rows: list[Row]) -> list[Row]:
    """Rows to report: of a method with settings, only those of the best setting at each noise."""
    kept = [row for row in rows if "|" not in row["method"]]
    for noise in NOISES:
        tried = [row for row in rows if "|" in row["method"] and row["noise"] == noise]
        if tried:
            best = best_setting(tried)
            print(f"PySINDy STLSQ, {noise}: best of {len(SETTINGS)} settings is {best}")
            chosen = [row for row in tried if row["method"].endswith(f"|{best}")]
            kept += [row | {"method": "PySINDy STLSQ", "setting": best} for row in chosen]
    return kept


def run_baselines(seed: int, path: Path, jobs: int) -> None:
    """Run all baselines and write their rows to a separate file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(jobs) as pool:
        rows = [row for rows in pool.map(rows_of, baseline_cases(seed)) for row in rows]
    part = path.with_suffix(".part")
    part.write_text("".join(json.dumps(row) + "\n" for row in kept_rows(rows)))
    part.replace(path)
