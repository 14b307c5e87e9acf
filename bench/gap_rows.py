"""One case analysed: a self-contained row with the result of the analysis and the hidden effects."""

import time
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from gap_cases import SETS, Case
from gap_truth import effects_of, true_errors

from wmr_replay.gap import GapOptions, analyse
from wmr_replay.gap.evidence.holdout import windows_within
from wmr_replay.gap.result.result import FoundEffect, GapMetric, GapResult
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log

ROOT = Path(__file__).parents[1]
SOURCES = (
    "schemas",
    "synth",
    "replay/wmr_replay/gap",
    "replay/wmr_replay/identify",
    "replay/wmr_replay/differentiate",
)


def state_of_sources() -> str:
    """A checksum of all sources that a row depends on; rows of another state are not reused."""
    files = sorted(path for root in SOURCES for path in (ROOT / root).rglob("*.py"))
    return f"{zlib.crc32(b''.join(path.read_bytes() for path in files)):08x}"


@dataclass(frozen=True)
class Task:
    """A case to be analysed, at a state of the sources."""

    case: Case
    state: str


def row_of(task: Task) -> dict[str, Any]:
    """The row of one case. The analysis gets only the log. An exception is recorded as text."""
    case = task.case
    simulated = case.simulated()
    hidden = [{"name": e.name, "parameters": e.parameters} for e in effects_of(simulated.facts)]
    row = {
        "key": case.key,
        "state": task.state,
        "set": case.set.name,
        "scenario": case.set.scenario,
        "modes": case.set.modes,
        "noise": case.noise,
        "seed": case.seed,
        "hidden": hidden,
    }
    log = simulated.log if case.set.modes == "given" else without_modes(simulated.log)
    start = time.process_time()
    try:
        result = analyse(log, None, GapOptions(modes=case.set.modes))
    except Exception as error:  # a crash of the analysis is a result of the benchmark
        return row | {"error": f"{type(error).__name__}: {error}"}
    cpu_s = time.process_time() - start
    true = true_errors(simulated, *held_out_windows(result)) if hidden else np.empty((0, 2))
    return (
        row
        | said(result)
        | {
            "cpu_s": cpu_s,
            "position": metric(result.position, true[:, 0]),
            "yaw": metric(result.yaw, true[:, 1]),
        }
    )


def without_modes(log: Log) -> Log:
    """The log without its mode track, so that the analysis cannot use it."""
    return Log(log.pose, log.torque, None, log.robot)


def said(result: GapResult) -> dict[str, Any]:
    """Verdict and named effects of a result, as part of a row."""
    return {
        "verdict": result.verdict,
        "sentence": result.sentence,
        "notes": list(result.notes),
        "effects": [effect_row(effect) for effect in result.effects],
    }


def effect_row(effect: FoundEffect) -> dict[str, Any]:
    """One named effect, as part of a row."""
    return {
        "name": effect.name,
        "class": list(effect.confound_class),
        "alternatives": {a.name: a.delta_bic for a in effect.alternatives},
        "p_value": effect.p_value,
        "parameters": {key: [e.value, *e.ci95] for key, e in effect.parameters.items()},
    }


def held_out_windows(result: GapResult) -> tuple[list[tuple[float, float]], float]:
    """First and last time [s] of each window of the result's held-out gap, and the length [s] of a bin."""
    traces = result.traces
    t_s, identified = traces.t_s, result.modes == "identified"
    settings, slips = GateSettings(), traces.mode >= ContactMode.SLIPPING
    skids = np.isin(traces.mode, (ContactMode.SKIDDING, ContactMode.SKIDDING_SLIPPING))
    binned = SimpleNamespace(t_s=t_s, slips=slips, skids=skids, identified=identified, settings=settings)
    problem = SimpleNamespace(binned=binned, settings=settings)
    period_s, held_out_s = settings.split.period_s, settings.split.held_out_s
    folds = [(t_s - k * held_out_s) % period_s >= period_s - held_out_s for k in range(3)]
    rows = [window for fold in folds for window in windows_within(problem, fold)]
    bin_s = float(np.median(np.diff(t_s)))
    return [(float(t_s[a]) - bin_s / 2, float(t_s[b - 1]) + bin_s / 2) for a, b in rows], bin_s


def metric(said_gap: GapMetric, true: np.ndarray) -> dict[str, float]:
    """The held-out gap before and after, its floor, and the true model's gap on the same windows."""
    held = said_gap.held_out
    error = float(np.sqrt(np.mean(true**2))) if len(true) == said_gap.windows else float("nan")
    return {
        "windows": said_gap.windows,
        "before": held.before,
        "after": held.after,
        "floor": held.floor,
        "true": error,
    }


def warm_up() -> None:
    """Compile everything before times are measured."""
    for case_set in SETS[:2]:
        row_of(Task(Case(case_set, -1, ("viscous_drag",), "rtk", 7), ""))
