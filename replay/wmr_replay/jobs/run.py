"""Replaying one log: open it, choose engine and model, and write the results where they are wanted."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from wmr_replay.ingest import Between, LogPath, open_log
from wmr_replay.jobs.replay import FileSource, Progress, Replay
from wmr_replay.jobs.replay import RunTables as WholeTables
from wmr_replay.jobs.request_texts import request_texts
from wmr_replay.jobs.result_files import ENDINGS, Live, write_results
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import replay_model
from wmr_replay.pipeline.settings import Settings
from wmr_replay.report.bundle import check_extra
from wmr_replay.report.run import RunTables, run_page
from wmr_replay.tables.row_blocks import BLOCK_ROWS, LIVE_BLOCK_ROWS
from wmr_replay.tables.truth import read_side_truth
from wmr_schemas.files import whole_file
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Model


@dataclass(frozen=True, eq=False)
class RunResult:
    """What a run wrote and found: ``files`` by kind, and the tables about the whole log."""

    files: dict[str, Path]
    tables: WholeTables

    @property
    def summary(self) -> dict[str, Any]:
        """The summary's row by column."""
        return self.tables.summary

    @property
    def segments(self) -> pl.DataFrame:
        """The segments table."""
        return self.tables.segments

    @property
    def confusion(self) -> pl.DataFrame:
        """The confusion table."""
        return self.tables.confusion


def default_directory(log: LogPath) -> Path:
    """Where results go without ``--out``: ``./<stem>.wmr/``."""
    return Path(f"{log.stem}.wmr")


def replay_of(
    log: LogPath,
    *,
    settings: Settings | None = None,
    mapping: LogMapping | None = None,
    between: Between | None = None,
    model: Model | None = None,
    sha256: str | None = None,
) -> Replay:
    """Open ``log`` for a replay. ``sha256``: the log's hash, where it is known already.

    Raises LogUnusable, and InvalidSetting for a model that a replay cannot apply.
    """
    also = () if settings is not None and settings.evidence == "torques" else ("wheel_speed",)
    reader = open_log(log, mapping or LogMapping(), between=between or Between(), also=also)
    replayed = replay_model(model or Model(), reader.robot)
    engine = Engine(
        settings or Settings(), replayed, steered=reader.is_steered, wheels_alone=reader.has_wheels_alone
    )
    return Replay(
        FileSource(reader, sha256), engine, read_side_truth(log), request_texts(mapping, between, model)
    )


def run_log(  # noqa: PLR0913 – keyword arguments
    log: LogPath,
    out: Path | None = None,
    *,
    settings: Settings | None = None,
    mapping: LogMapping | None = None,
    between: Between | None = None,
    model: Model | None = None,
    timeline: bool = True,
    strict: bool = False,
    sha256: str | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Replay ``log`` and write its results to ``out`` (default ``./<stem>.wmr/``).

    The files appear together or not at all. ``sha256``: the log's hash, where it is known already. Raises
    LogUnusable (with ``strict`` also when something was damaged).
    """
    replay = replay_of(log, settings=settings, mapping=mapping, between=between, model=model, sha256=sha256)
    return run_into(
        replay, out or default_directory(log), timeline=timeline, strict=strict, progress=progress
    )


def run_into(
    replay: Replay,
    out: Path,
    *,
    timeline: bool = True,
    report: bool = False,
    strict: bool = False,
    progress: Progress | None = None,
    live: Live | None = None,
) -> RunResult:
    """Run a replay to its end and write its results to ``out``. Raises MissingExtra."""
    if report:
        check_extra()
    files, tables = write_results(
        out,
        replay.source.stem,
        replay.samples(progress, strict=strict, block_rows=BLOCK_ROWS if live is None else LIVE_BLOCK_ROWS),
        replay.hindsight(),
        replay.tables,
        replay.timeline_facts if timeline else None,
        live,
    )
    if report:
        files["report"] = out / f"{replay.source.stem}.{ENDINGS['report']}"
        write_report(files["report"], RunTables.of_files(files), replay.source.stem)
    return RunResult(files, tables)


def write_report(target: Path, tables: RunTables, name: str) -> None:
    """Write the page of a replay, whole or not at all."""
    text = run_page(tables, name)
    with whole_file(target) as part:
        part.write_text(text, encoding="utf-8")
