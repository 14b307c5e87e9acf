"""``wmr-replay run`` as a function: a log in, tables and a timeline out."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import polars as pl

from wmr_replay.ingest import Between, LogPath, LogReader, RemotePath, open_log, sha256_of
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import replay_model
from wmr_replay.pipeline.settings import Settings
from wmr_replay.tables import ParquetStream, confusion_frame, replace_file, samples_frame
from wmr_replay.tables.summary import LogFacts, SummaryCollector, summary_frame, summary_row
from wmr_replay.tables.truth import SideTruth, read_side_truth
from wmr_replay.timeline import Timeline
from wmr_schemas.errors import DamagedLog
from wmr_schemas.mapping_file import LogMapping, mapping_toml
from wmr_schemas.model_file import Model, model_to_toml
from wmr_schemas.tables import SAMPLES, polars_schema

Progress = Callable[[int, int], None]
"""Called with bytes read and bytes in all."""


@dataclass(frozen=True, eq=False)
class RunResult:
    """What a run wrote and found: ``files`` by kind, ``summary`` as its row, ``segments`` and ``confusion``
    as tables.
    """

    files: dict[str, Path]
    summary: dict[str, Any]
    segments: pl.DataFrame
    confusion: pl.DataFrame


def sample_batches(
    reader: LogReader, engine: Engine, progress: Progress | None = None
) -> Iterator[pl.DataFrame]:
    """The samples table of a log, batch by batch."""
    for batch in reader.batches():
        for columns in engine.push(batch):
            yield samples_frame(columns)
        if progress is not None:
            progress(reader.position_bytes, reader.size_bytes)
    for columns in engine.finish():
        yield samples_frame(columns)


def default_directory(log: LogPath) -> Path:
    """Where results go without ``--out``: ``./<stem>.wmr/``."""
    return Path(f"{log.stem}.wmr")


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

    Every file appears complete or not at all. ``sha256``: the log's hash, where it is known already. Raises
    LogUnusable (with ``strict`` also when something was damaged).
    """
    reader = open_log(log, mapping or LogMapping(), between=between or Between())
    engine = Engine(settings or Settings(), replay_model(model or Model(), reader.robot))
    truth = read_side_truth(log)
    directory = out or default_directory(log)
    directory.mkdir(parents=True, exist_ok=True)
    told = given(mapping, between, model)
    results = ResultFiles(directory, log, reader, truth, timeline=timeline, given=told, sha256=sha256)
    tally = SummaryCollector()
    try:
        for samples in sample_batches(reader, engine, progress):
            tally.push(samples)
            results.push(samples, engine)
        if strict and reader.losses.any():
            raise DamagedLog(
                log, "; ".join(reader.losses.notes), "leave --strict out to analyse the intact part"
            )
        return results.finish(tally, engine)
    except BaseException:
        results.discard()
        raise


def given(mapping: LogMapping | None, between: Between | None, model: Model | None) -> dict[str, str]:
    """What a run was told besides its settings, for ``summary.settings``: files as TOML, limits as text."""
    said = {
        "mapping": mapping_toml(mapping) if mapping else "",
        "model": model_to_toml(model) if model else "",
        "start": (between.start if between else None) or "",
        "end": (between.end if between else None) or "",
    }
    return {name: text for name, text in said.items() if text}


class ResultFiles:
    """The files of one run, growing under temporary names until all are complete."""

    def __init__(
        self,
        directory: Path,
        log: LogPath,
        reader: LogReader,
        truth: SideTruth,
        *,
        timeline: bool,
        given: dict[str, str],
        sha256: str | None = None,
    ) -> None:
        self._given = given
        self._directory, self._log, self._reader, self._truth = directory, log, reader, truth
        self._sha256 = sha256 or sha256_of(log)
        self._samples = ParquetStream(self._file("samples.parquet"), polars_schema(SAMPLES))
        self._timeline: Timeline | None = None
        self._wants_timeline = timeline

    def push(self, samples: pl.DataFrame, engine: Engine) -> None:
        """Take a batch of samples in."""
        if not len(samples):
            return
        self._samples.push(samples)
        if self._wants_timeline and self._timeline is None:
            rate_hz = engine.tuning.rate_hz if engine.tuning else 1.0
            self._timeline = self._open_timeline(rate_hz, engine.model.robot.alpha)
        if self._timeline is not None:
            self._timeline.push(samples)

    def finish(self, tally: SummaryCollector, engine: Engine) -> RunResult:
        """Complete every file and give each its name."""
        runs, segments = tally.runs.finish(), tally.segments.finish()
        row = summary_row(self._facts(engine), tally, runs)
        confusion = confusion_frame(runs)
        files = {"samples": self._file("samples.parquet"), "segments": self._file("segments.parquet")}
        if self._timeline is not None:
            self._timeline.finish(row["verdict"])
            files["timeline"] = self._file("rrd")
        self._samples.finish()
        write_parquet(files["segments"], segments)
        files |= {"summary": self._file("summary.parquet"), "summary_json": self._file("summary.json")}
        if len(confusion):
            files["confusion"] = self._file("confusion.parquet")
            write_parquet(files["confusion"], confusion)
        else:
            self._file("confusion.parquet").unlink(missing_ok=True)
        write_parquet(files["summary"], summary_frame(row))
        with replace_file(files["summary_json"]) as part:
            part.write_text(
                json.dumps(
                    row | {"settings": json.loads(row["settings"]), "notes": json.loads(row["notes"])},
                    indent=2,
                    ensure_ascii=False,
                )
                + "\n",
                encoding="utf-8",
            )
        return RunResult(files, row, segments, confusion)

    def discard(self) -> None:
        """Remove what is unfinished."""
        self._samples.discard()
        if self._timeline is not None:
            self._timeline.discard()

    def _file(self, ending: str) -> Path:
        return self._directory / f"{self._log.stem}.{ending}"

    def _open_timeline(self, rate_hz: float, alpha: float | None) -> Timeline:
        return Timeline(
            self._file("rrd"),
            log_name=self._log.name,
            alpha_nominal=alpha,
            rate_hz=rate_hz,
            truth=self._truth.states if self._truth.states_file else None,
            recording_id=f"{self._log.stem}-{self._sha256[:16]}",
        )

    def _facts(self, engine: Engine) -> LogFacts:
        reader, tuning = self._reader, engine.tuning
        robot = engine.model.robot
        settings = engine.settings.as_dict() | {"robot": robot.known()}
        settings |= {"effects": [asdict(effect) for effect in engine.model.effects]}
        settings |= {"given": self._given}
        settings |= {"channels": reader.plan.as_dict(), "tuning": asdict(tuning) if tuning else None}
        return LogFacts(
            log=str(self._log),
            log_sha256=None if isinstance(self._log, RemotePath) else self._sha256,
            settings=settings,
            rate_hz=tuning.rate_hz if tuning else None,
            counts=engine.aligner.counts,
            losses=reader.losses.counts(),
            n_gaps=engine.n_gaps,
            n_pose_jumps=engine.n_pose_jumps,
            n_outliers=engine.n_outliers,
            notes=[*reader.losses.notes, *reader.remarks, *reader.stamp_notes, *engine.model.notes],
            robot=robot,
            alpha_true=self._truth.alpha,
        )


def write_parquet(path: Path, frame: pl.DataFrame) -> None:
    """A whole table, or none."""
    with replace_file(path) as part:
        frame.write_parquet(part)
