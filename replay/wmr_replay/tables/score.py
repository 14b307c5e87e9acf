"""Scoring against the truth: shares, recall, detection delays, false alarms."""

from dataclasses import dataclass

import numpy as np
import polars as pl

from wmr_replay.tables.runs import ModeRuns
from wmr_schemas.arrays import I8, I64
from wmr_schemas.modes import MODES
from wmr_schemas.tables import CONFUSION, polars_schema

HOLD_NS = 200_000_000
FALSE_ALARM_NS = 2_000_000_000
NS_PER_HOUR = 3_600e9


@dataclass(frozen=True)
class Score:
    """The part of the summary that compares modes; None where there is nothing to compare."""

    accuracy: float | None = None
    decided_share: float | None = None
    accuracy_decided: float | None = None
    recall_ideal: float | None = None
    recall_skidding: float | None = None
    recall_slipping: float | None = None
    recall_skidding_slipping: float | None = None
    median_detection_delay_s: float | None = None
    p95_detection_delay_s: float | None = None
    missed_switches: int | None = None
    false_alarms_per_hour: float | None = None


def score_runs(runs: ModeRuns) -> Score:
    """Scores over the rows after warm-up that have a truth; all None without any."""
    judged = ~runs.warming & (runs.mode_true >= 0)
    n_rows, true, mode = runs.n_rows[judged], runs.mode_true[judged], runs.mode[judged]
    if not n_rows.size:
        return Score()
    right = true == mode
    decided = mode >= 0
    recall = {f"recall_{m.label}": share(n_rows[right & (true == m)], n_rows[true == m]) for m in MODES}
    delays, missed = detection_delays(runs)
    return Score(
        accuracy=share(n_rows[right], n_rows),
        decided_share=share(n_rows[decided], n_rows),
        accuracy_decided=share(n_rows[right], n_rows[decided]),
        **recall,
        median_detection_delay_s=float(np.median(delays)) if delays else None,
        p95_detection_delay_s=float(np.percentile(delays, 95)) if delays else None,
        missed_switches=missed,
        false_alarms_per_hour=false_alarms_per_hour(runs),
    )


def share(part: I64, whole: I64) -> float | None:
    """Rows in ``part`` over rows in ``whole``."""
    return float(part.sum() / whole.sum()) if whole.size else None


def changes(start_ns: I64, mode: I8) -> tuple[I64, I8]:
    """Stamps at which a mode sets in, the first one included, and that mode."""
    new = np.concatenate([[True], np.diff(mode) != 0]) if mode.size else np.zeros(0, bool)
    return start_ns[new], mode[new]


def detection_delays(runs: ModeRuns) -> tuple[list[float], int]:
    """From each true switch to the first estimate that then holds .2 s; switches missed until the next one.

    Switches during warm-up are left out. An estimate that was there already has delay 0.
    """
    true_ns, true = changes(runs.start_ns, runs.mode_true)
    est_ns, est = changes(runs.start_ns, runs.mode)
    est_end = np.append(est_ns[1:], runs.end_ns)
    warm_ns = warm_from(runs)
    delays, missed = [], 0
    for k in range(1, len(true_ns)):
        switch_ns = true_ns[k]
        until_ns = true_ns[k + 1] if k + 1 < len(true_ns) else runs.end_ns
        if switch_ns < warm_ns or true[k] < 0:
            continue
        found_ns = np.maximum(est_ns, switch_ns)
        held = (est == true[k]) & (est_end - found_ns >= HOLD_NS) & (found_ns < until_ns)
        if held.any():
            delays.append(float(found_ns[np.argmax(held)] - switch_ns) / 1e9)
        else:
            missed += 1
    return delays, missed


def warm_from(runs: ModeRuns) -> int:
    """Stamp of the first row after warm-up."""
    warm = np.flatnonzero(~runs.warming)
    return int(runs.start_ns[warm[0]]) if warm.size else runs.end_ns


def false_alarms_per_hour(runs: ModeRuns) -> float | None:
    """Estimated switches, from one named mode to another, with no true switch within the 2 s before."""
    warm_ns = warm_from(runs)
    named = (runs.mode >= 0) & ~runs.warming
    est_ns, _ = changes(runs.start_ns[named], runs.mode[named])
    true_ns, _ = changes(runs.start_ns, runs.mode_true)
    switches = true_ns[1:]
    before = np.searchsorted(switches, est_ns[1:], side="right") - 1
    last = (
        np.where(before >= 0, switches[np.maximum(before, 0)], np.iinfo(np.int64).min // 2)
        if switches.size
        else None
    )
    false = np.ones(max(len(est_ns) - 1, 0), bool) if last is None else est_ns[1:] - last > FALSE_ALARM_NS
    hours = (runs.end_ns - warm_ns) / NS_PER_HOUR
    return float(np.count_nonzero(false) / hours) if hours > 0 else None


def confusion_frame(runs: ModeRuns) -> pl.DataFrame:
    """Seconds by true and estimated mode, after warm-up."""
    judged = ~runs.warming & (runs.mode_true >= 0)
    table = pl.DataFrame(
        {"mode_true": runs.mode_true[judged], "mode": runs.mode[judged], "seconds": runs.seconds[judged]}
    )
    return (
        table.group_by("mode_true", "mode")
        .agg(pl.col("seconds").sum())
        .sort("mode_true", "mode")
        .cast(polars_schema(CONFUSION))
    )
