"""One log through the engine: samples batch by batch, then the tables about the whole. Writes no file."""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import polars as pl

from wmr_replay.ingest import LogReader, Losses, RemotePath, gathered
from wmr_replay.jobs.hashing import LogHash
from wmr_replay.jobs.torque_record import TorqueRecord
from wmr_replay.jobs.writing_thread import WritingThread
from wmr_replay.pipeline.ahead import ahead
from wmr_replay.pipeline.columns import EFFORTS, Columns
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch, wheels_apart
from wmr_replay.tables import confusion_frame, hindsight_frame, samples_frame
from wmr_replay.tables.row_blocks import BLOCK_ROWS, RowBlocks
from wmr_replay.tables.samples import LATER, SCHEMA
from wmr_replay.tables.summary import LogFacts, SummaryCollector, summary_row
from wmr_replay.tables.truth import SideTruth
from wmr_schemas.batches import RawBatch
from wmr_schemas.errors import DamagedLog, LogUnusable
from wmr_schemas.findings import Finding
from wmr_schemas.signals import Log
from wmr_schemas.text import encodable

Progress = Callable[[int, int], None]
"""Called with bytes read and bytes in all."""
MOST_REASONS = 3
"""Losses that an error names."""


class Source(Protocol):
    """Where the rows of a replay come from: a log file or a log in memory."""

    name: str
    """As ``summary.log`` states it."""
    stem: str
    """Result files are named after it."""

    @property
    def sha256(self) -> str:
        """Hash of the content."""

    @property
    def file_sha256(self) -> str | None:
        """The same where it is the hash of a file: ``summary.log_sha256``."""

    @property
    def losses(self) -> Losses:
        """What could not be used so far."""

    def batches(self) -> Iterator[RawBatch]:
        """The rows in file order."""

    def position(self) -> tuple[int, int]:
        """Bytes read so far and bytes in all."""

    def channels(self) -> Mapping[str, Any]:
        """Which channel served as what."""

    def notes(self) -> list[str]:
        """What was noticed besides losses. Complete once the batches are exhausted."""

    def findings(self) -> list[Finding]:
        """What is wrong with clocks, channels and parameters. Complete once the batches are exhausted."""

    def check_rows(self, n_rows: int, n_warm: int, window_s: float | None) -> None:
        """Raises LogUnusable where the rows, of which ``n_warm`` are behind the warm-up, make no result."""


class FileSource:
    """The rows of an opened log file."""

    def __init__(self, reader: LogReader, sha256: str | None = None) -> None:
        self._reader = reader
        self.name, self.stem = encodable(reader.path), encodable(reader.path.stem)
        self._known_sha256 = sha256
        self._hash = None if sha256 else LogHash(reader.path)

    @property
    def sha256(self) -> str:
        """Hash of the file, found while it is read."""
        if self._hash is not None:
            self._known_sha256 = self._hash.result()
        return self._known_sha256 or ""

    @property
    def file_sha256(self) -> str | None:
        """The same; None of a URL."""
        return None if isinstance(self._reader.path, RemotePath) else self.sha256

    @property
    def losses(self) -> Losses:
        """What could not be used so far."""
        return self._reader.losses

    def batches(self) -> Iterator[RawBatch]:
        """The rows in file order; efforts of a steered robot are left aside."""
        for batch in self._reader.batches():
            yield batch.without_efforts() if self._reader.is_steered else batch

    def position(self) -> tuple[int, int]:
        """Bytes read so far and bytes in all."""
        return self._reader.position_bytes, self._reader.size_bytes

    def channels(self) -> Mapping[str, Any]:
        """Which channel served as what."""
        return self._reader.plan.as_dict()

    def notes(self) -> list[str]:
        """Remarks on channels and stamps."""
        return [*self._reader.remarks, *self._reader.stamp_notes]

    def findings(self) -> list[Finding]:
        """Findings of the reader."""
        return self._reader.findings

    def check_rows(self, n_rows: int, n_warm: int, window_s: float | None) -> None:
        """Raises LogUnusable without any pose, and where the range or the window that the user chose leaves
        no row behind the warm-up.
        """
        reader = self._reader
        if not n_rows and reader.limits is None:
            lost = "; ".join(reader.losses.notes[:MOST_REASONS])
            raise LogUnusable(
                reader.path, "it holds no pose that could be used" + (f": {lost}" if lost else "")
            )
        if not n_rows:
            raise reader.nothing_between("no usable pose lies")
        if not n_warm and window_s is not None:
            raise reader.nothing_between(f"the poses end before a window of {window_s:g} s is full,")
        if not n_warm and reader.limits is not None:
            raise reader.nothing_between("the poses end before the differentiator's window is full,")


class MemorySource:
    """The rows of a log in memory, in one batch."""

    def __init__(self, log: Log, name: str) -> None:
        self._log, self.name, self.stem = log, name, Path(name).stem
        self.sha256 = content_sha256(log)
        self.file_sha256: str | None = None
        self.losses = Losses()

    def batches(self) -> Iterator[RawBatch]:
        """All rows."""
        yield as_batch(self._log)

    def position(self) -> tuple[int, int]:
        """Everything is there at once."""
        return 1, 1

    def channels(self) -> Mapping[str, Any]:
        """No channels."""
        return {}

    def notes(self) -> list[str]:
        """No remarks."""
        return []

    def findings(self) -> list[Finding]:
        """Nothing was read."""
        return []

    def check_rows(self, n_rows: int, n_warm: int, window_s: float | None) -> None:
        """Signals in memory give the rows that they are."""


def content_sha256(log: Log) -> str:
    """Hash of a log's arrays."""
    digest = hashlib.sha256()
    for track in (log.pose, log.torque, log.mode, wheels_apart(log)):
        for column in () if track is None else vars(track).values():
            digest.update(np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class RunTables:
    """The tables about a whole log: ``summary`` as its row by column, ``segments``, ``confusion``, and the
    segments in hindsight, None without a second pass.
    """

    summary: dict[str, Any]
    segments: pl.DataFrame
    confusion: pl.DataFrame
    hindsight_segments: pl.DataFrame | None = None


@dataclass(frozen=True, eq=False)
class TimelineFacts:
    """What a timeline states besides the samples."""

    log_name: str
    alpha_nominal: float | None
    rate_hz: float
    truth: Callable[[int], Iterator[pl.DataFrame]] | None
    recording_id: str
    torque: Callable[[], pl.DataFrame] | None = None
    """The wheel torques so far: ``t_ns, left_nm, right_nm``."""


class Replay:
    """A source through an engine: exhaust :meth:`samples`, then ask for :meth:`tables`."""

    def __init__(
        self, source: Source, engine: Engine, truth: SideTruth | None = None, given: Mapping[str, str] = {}
    ) -> None:
        self.source, self.engine = source, engine
        self._truth, self._given = truth or SideTruth(), dict(given)
        self._tally, self._later = SummaryCollector(), SummaryCollector()
        self._looked_back = False
        self._torques = TorqueRecord()

    def samples(
        self, progress: Progress | None = None, *, strict: bool = False, block_rows: int = BLOCK_ROWS
    ) -> Iterator[pl.DataFrame]:
        """The samples table in blocks of ``block_rows`` rows. Raises LogUnusable where they make no result,
        and with ``strict`` DamagedLog when something was lost.
        """
        counting = WritingThread()
        try:
            for columns in self._blocks(progress, block_rows):
                samples = samples_frame(columns)
                self._torques.push(columns)
                counting.call(self._tally.push, samples)
                yield samples
            counting.finish()
        finally:
            counting.stop()
        if strict and self.source.losses.any():
            raise DamagedLog(
                self.source.name,
                "; ".join(self.source.losses.notes),
                "leave --strict out to analyse the intact part",
            )
        self.source.check_rows(self._tally.n_rows, self._tally.n_warm, self.engine.settings.window_s)

    def hindsight(self) -> Iterator[pl.DataFrame]:
        """The hindsight table in blocks, after the samples; empty without a second pass."""
        self._looked_back = True
        blocks = RowBlocks([*LATER])
        for columns in self.engine.hindsight():
            yield from map(self._counted_later, blocks.push(columns))
        yield from map(self._counted_later, blocks.finish())

    def tables(self) -> RunTables:
        """Segments, confusion and the summary's row, once the samples are exhausted."""
        if not self._looked_back:
            for _ in self.hindsight():
                pass
        runs, segments = self._tally.runs.finish(), self._tally.segments.finish()
        later = self._later if self._later.n_rows else None
        row = summary_row(self._facts(), self._tally, runs, later)
        return RunTables(row, segments, confusion_frame(runs), later.segments.finish() if later else None)

    def timeline_facts(self) -> TimelineFacts:
        """What the timeline needs; known with the first samples."""
        tuning, source = self.engine.tuning, self.source
        return TimelineFacts(
            log_name=Path(source.name).name,
            alpha_nominal=self.engine.model.robot.alpha,
            rate_hz=tuning.rate_hz if tuning else 1.0,
            truth=self._truth.states if self._truth.states_file else None,
            recording_id=f"{source.stem}-{source.sha256[:16]}",
            torque=self._torques.frame,
        )

    def _blocks(self, progress: Progress | None, block_rows: int) -> Iterator[Columns]:
        """The rows of the samples table in blocks."""
        blocks = RowBlocks([*SCHEMA, *EFFORTS], block_rows)
        for columns in self._columns(progress):
            yield from blocks.push(columns)
        yield from blocks.finish()

    def _columns(self, progress: Progress | None) -> Iterator[Columns]:
        """The rows of the samples table as the engine completes them."""
        for taken in ahead(map(self.engine.take_in, gathered(self.source.batches()))):
            yield from self.engine.advance(taken)
            if progress is not None:
                progress(*self.source.position())
        yield from self.engine.finish()

    def _counted_later(self, columns: Columns) -> pl.DataFrame:
        rows = hindsight_frame(columns)
        self._later.push(rows)
        return rows

    def _facts(self) -> LogFacts:
        source, engine, tuning = self.source, self.engine, self.engine.tuning
        robot = engine.model.robot
        settings = engine.settings.as_dict() | {"robot": robot.known()}
        settings |= {"effects": [asdict(effect) for effect in engine.model.effects]}
        settings |= {"given": self._given, "told_by": engine.told_by}
        settings |= {"channels": dict(source.channels()), "tuning": asdict(tuning) if tuning else None}
        return LogFacts(
            log=source.name,
            log_sha256=source.file_sha256,
            settings=settings,
            rate_hz=tuning.rate_hz if tuning else None,
            counts=engine.aligner.counts,
            losses=source.losses.counts(),
            n_gaps=engine.n_gaps,
            n_pose_jumps=engine.n_pose_jumps,
            n_outliers=engine.n_outliers,
            notes=[*source.losses.notes, *source.notes(), *engine.model.notes, *filter(None, [engine.note])],
            findings=[*source.findings(), *engine.findings],
            robot=robot,
            alpha_true=self._truth.alpha,
        )
