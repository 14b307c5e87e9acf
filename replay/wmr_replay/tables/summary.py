"""The summary: one row, collected from batches of the samples table."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import polars as pl

from wmr_replay.align.aligner import AlignmentCounts
from wmr_replay.tables import (
    CalibrationCollector,
    ModeRuns,
    RunCollector,
    Score,
    SegmentCollector,
    score_runs,
)
from wmr_replay.tables.verdict import verdict_sentence
from wmr_schemas import __version__
from wmr_schemas.findings import Finding, findings_json
from wmr_schemas.modes import MODES, ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.status import BARRING, Status
from wmr_schemas.tables import LEARNT_OF_WHEELS, SUMMARY, polars_schema

LEARNT = tuple(column.name for column in LEARNT_OF_WHEELS)
NOTHING_LEARNT = {Status.POSE_NOT_INDEPENDENT.label, *(status.label for status in BARRING)}
"""Rows of these end the validity of what wheel speeds taught before them."""
BARRED_LABELS = frozenset(status.label for status in BARRING)
"""Rows of these end the validity of the α before them."""


@dataclass
class SummaryCollector:
    """``push(samples)`` batches in order: everything that the summary takes from the samples table."""

    runs: RunCollector = field(default_factory=RunCollector)
    segments: SegmentCollector = field(default_factory=SegmentCollector)
    calibration: CalibrationCollector = field(default_factory=CalibrationCollector)
    statuses: Counter[str] = field(default_factory=Counter)
    first_ns: int | None = None
    last_ns: int = 0
    alpha: tuple[float, float] | None = None
    learnt: dict[str, float] = field(default_factory=dict)
    """Last known values of what wheel speeds teach about the robot."""

    def push(self, samples: pl.DataFrame) -> None:
        """Take a batch of the samples table in."""
        if not len(samples):
            return
        self.runs.push(samples)
        self.segments.push(samples)
        self.calibration.push(samples)
        self.statuses.update(dict(samples.group_by(pl.col("status").cast(pl.String)).len().rows()))
        self.first_ns = samples["t_ns"][0] if self.first_ns is None else self.first_ns
        self.last_ns = samples["t_ns"][-1]
        known = (
            samples.select(pl.col("alpha", "alpha_sd").drop_nulls().last())
            if samples["alpha"].count()
            else None
        )
        self.alpha = known.row(0) if known is not None else self.alpha
        if samples["status"][-1] in BARRED_LABELS:
            self.alpha = None
        self.learnt |= last_known(samples, LEARNT)
        if samples["status"][-1] in NOTHING_LEARNT:
            self.learnt = {}

    @property
    def duration_s(self) -> float:
        """Last minus first pose stamp, in s."""
        return 0.0 if self.first_ns is None else (self.last_ns - self.first_ns) / 1e9

    @property
    def n_rows(self) -> int:
        """Rows so far."""
        return self.statuses.total()

    @property
    def n_warm(self) -> int:
        """Rows behind the warm-up."""
        return self.n_rows - self.statuses[Status.WARMING_UP.label]

    def status_shares(self) -> dict[str, float]:
        """Shares of the rows after warm-up by status."""
        warm = {name: n for name, n in self.statuses.items() if name != Status.WARMING_UP.label}
        return {name: n / sum(warm.values()) for name, n in warm.items()}


def last_known(samples: pl.DataFrame, names: Sequence[str]) -> dict[str, float]:
    """The last value of each of these columns that has any."""
    known = [name for name in names if name in samples and samples[name].count()]
    return {name: float(samples[name].drop_nulls()[-1]) for name in known}


@dataclass(frozen=True)
class LogFacts:
    """What is known of the log besides its samples."""

    log: str
    log_sha256: str | None
    settings: dict[str, Any]
    rate_hz: float | None
    counts: AlignmentCounts
    losses: dict[str, int | bool]
    n_gaps: int
    n_pose_jumps: int
    n_outliers: int
    notes: Sequence[str]
    findings: Sequence[Finding]
    robot: RobotParameters
    alpha_true: float | None


def mode_shares(runs: ModeRuns) -> dict[str, float]:
    """Shares of the rows after warm-up by mode label; empty without such rows."""
    warm = ~runs.warming
    total = int(runs.n_rows[warm].sum())
    modes = (*MODES, ContactMode.UNDECIDED)
    return (
        {m.label: float(runs.n_rows[warm & (runs.mode == m)].sum()) / total for m in modes} if total else {}
    )


def hindsight_columns(later: SummaryCollector) -> dict[str, Any]:
    """What the summary says of the hindsight table."""
    runs = later.runs.finish()
    score = score_runs(runs)
    columns: dict[str, Any] = {
        f"hindsight_{name}": getattr(score, name)
        for name in ("accuracy", "decided_share", "accuracy_decided")
    }
    columns |= {"hindsight_brier": later.calibration.brier, "hindsight_ece": later.calibration.ece}
    return columns | {f"hindsight_share_{label}": share for label, share in mode_shares(runs).items()}


def summary_row(
    facts: LogFacts, collected: SummaryCollector, runs: ModeRuns, later: SummaryCollector | None = None
) -> dict[str, Any]:
    """The row of the summary table, every column by name; the verdict is that of ``later``, the hindsight
    table, where there is one.
    """
    shares = mode_shares(runs)
    alpha, alpha_sd = collected.alpha or (None, None)
    row: dict[str, Any] = dict.fromkeys(polars_schema(SUMMARY))
    row |= {"log": facts.log, "log_sha256": facts.log_sha256, "version": __version__}
    row["findings"] = findings_json(facts.findings)
    row |= {"settings": json.dumps(facts.settings, sort_keys=True), "notes": json.dumps(list(facts.notes))}
    row |= {"duration_s": collected.duration_s, "rate_hz": facts.rate_hz, "n_gaps": facts.n_gaps}
    row |= {"n_pose_jumps": facts.n_pose_jumps, "n_outliers": facts.n_outliers}
    row |= asdict(facts.counts) | facts.losses | {f"share_{label}": share for label, share in shares.items()}
    row |= collected.learnt
    row |= {"alpha": alpha, "alpha_sd": alpha_sd} | asdict(score_runs(runs))
    row |= {"brier": collected.calibration.brier, "ece": collected.calibration.ece}
    if alpha is not None and facts.alpha_true:
        row["alpha_error"] = alpha / facts.alpha_true - 1
    torque = facts.counts.n_torque > int(facts.losses.get("n_torque_empty", 0))
    told, said = collected, shares
    if later is not None:
        row |= hindsight_columns(later)
        told, said = later, mode_shares(later.runs.finish())
    row["verdict"] = verdict_sentence(
        said,
        told.status_shares(),
        torque or bool(collected.learnt),
        collected.alpha,
        facts.robot,
        collected.learnt,
    )
    return row


def summary_frame(row: dict[str, Any]) -> pl.DataFrame:
    """The summary row as a table of one row."""
    return pl.DataFrame([row], schema=polars_schema(SUMMARY))


__all__ = ["LogFacts", "Score", "SummaryCollector", "mode_shares", "summary_frame", "summary_row"]
