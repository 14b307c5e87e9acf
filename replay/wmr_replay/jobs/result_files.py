"""The files of a run: samples and timeline grow while rows stream by, and all get their names at the end."""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import polars as pl

from wmr_replay.jobs.replay import RunTables, TimelineFacts
from wmr_replay.jobs.writing_thread import WritingThread
from wmr_replay.tables import ParquetStream
from wmr_replay.tables.summary import summary_frame
from wmr_schemas.files import made_folder, whole_files
from wmr_schemas.tables import HINDSIGHT, SAMPLES, polars_schema
from wmr_schemas.text import json_text

if TYPE_CHECKING:
    from wmr_replay.timeline.writer import Timeline

Live: TypeAlias = str | Callable[[], str | None]
"""Where a viewer takes rows as they come, or what gives that, None without a viewer."""
ENDINGS = {
    "summary_json": "summary.json",
    "summary": "summary.parquet",
    "segments": "segments.parquet",
    "confusion": "confusion.parquet",
    "samples": "samples.parquet",
    "hindsight": "hindsight.parquet",
    "hindsight_segments": "hindsight_segments.parquet",
    "timeline": "rrd",
    "report": "report.html",
}
"""What follows ``<stem>.`` in the name of each kind of file."""
OPTIONAL = ("confusion", "hindsight", "hindsight_segments", "timeline", "report")
"""Kinds that not every run has. Where a run has none, that of an earlier run goes."""


def write_results(
    directory: Path,
    stem: str,
    batches: Iterable[pl.DataFrame],
    hindsight: Iterable[pl.DataFrame],
    tables: Callable[[], RunTables],
    facts: Callable[[], TimelineFacts] | None,
    live: Live | None = None,
) -> tuple[dict[str, Path], RunTables]:
    """Write the results of one log to ``directory``; the files by kind, and the tables about the whole.

    ``hindsight`` is iterated once the batches are exhausted, and then ``tables`` is called. ``facts`` is
    called with the first rows; without it no timeline is written. ``live`` is where a viewer takes its rows
    meanwhile, or is called for that with the first rows. After a failure no file has changed, and a
    directory made for the results is gone.
    """
    with made_folder(directory):
        files = ResultFiles(directory, stem, facts, live)
        try:
            for samples in batches:
                files.push(samples)
            for rows in hindsight:
                files.push_hindsight(rows)
            whole = tables()
            return files.finish(whole), whole
        except BaseException:
            files.discard()
            raise


class ResultFiles:
    """The files of one run, growing under temporary names until all are complete.

    Rows are written in a thread, and drawn in another. What the timeline states is asked for in the caller's,
    with the first rows: later rows may change it.
    """

    def __init__(
        self,
        directory: Path,
        stem: str,
        facts: Callable[[], TimelineFacts] | None,
        live: Live | None = None,
    ) -> None:
        self._names = {kind: directory / f"{stem}.{ending}" for kind, ending in ENDINGS.items()}
        self._facts, self._live = facts, live
        self._samples = ParquetStream(self._names["samples"], polars_schema(SAMPLES))
        self._hindsight: ParquetStream | None = None
        self._timeline: Timeline | None = None
        self._stated: tuple[TimelineFacts, str | None] | None = None
        self._thread, self._drawing = WritingThread(), WritingThread()

    def push(self, samples: pl.DataFrame) -> None:
        """Append a batch of samples, which must not change any more."""
        if not len(samples):
            return
        if self._stated is None and self._facts is not None:
            self._stated = self._facts(), self._live() if callable(self._live) else self._live
        self._thread.call(self._samples.push, samples)
        if self._stated is not None:
            self._drawing.call(self._draw, samples)

    def push_hindsight(self, rows: pl.DataFrame) -> None:
        """Append a batch of the hindsight table, once all samples are there."""
        self._thread.call(self._write_hindsight, rows)
        if self._stated is not None:
            self._drawing.call(self._draw_hindsight, rows)

    def _draw(self, samples: pl.DataFrame) -> None:
        if self._timeline is None and self._stated is not None:
            self._timeline = open_timeline(self._names["timeline"], *self._stated)
        if self._timeline is not None:
            self._timeline.push(samples)

    def _write_hindsight(self, rows: pl.DataFrame) -> None:
        if self._hindsight is None:
            self._hindsight = ParquetStream(self._names["hindsight"], polars_schema(HINDSIGHT))
        self._hindsight.push(rows)

    def _draw_hindsight(self, rows: pl.DataFrame) -> None:
        if self._timeline is not None:
            self._timeline.push_hindsight(rows)

    def finish(self, tables: RunTables) -> dict[str, Path]:
        """Complete every file and rename all."""
        self._thread.finish()
        self._drawing.finish()
        small = self._small(tables)
        with whole_files({kind: self._names[kind] for kind in small}) as parts:
            for kind, write in small.items():
                write(parts[kind])
            self._samples.close()
            if self._hindsight is not None:
                self._hindsight.close()
            if self._timeline is not None:
                found = json.loads(tables.summary["findings"])
                self._timeline.finish(tables.summary["verdict"], found)
            if self._hindsight is not None:
                self._hindsight.finish()
            self._samples.finish()
        streams = {"samples": self._samples, "hindsight": self._hindsight, "timeline": self._timeline}
        written = {*small, *(kind for kind, stream in streams.items() if stream is not None)}
        for kind in set(OPTIONAL) - written:
            self._names[kind].unlink(missing_ok=True)
        return {kind: path for kind, path in self._names.items() if kind in written}

    def discard(self) -> None:
        """Remove what is unfinished."""
        self._thread.stop()
        self._drawing.stop()
        self._samples.discard()
        if self._hindsight is not None:
            self._hindsight.discard()
        if self._timeline is not None:
            self._timeline.discard()

    def _small(self, tables: RunTables) -> dict[str, Callable[[Path], Any]]:
        """How each table about the whole log is written, the one that appears last first."""
        text = summary_json(tables.summary) + "\n"
        writers: dict[str, Callable[[Path], Any]] = {
            "summary_json": lambda part: part.write_text(text, encoding="utf-8"),
            "summary": summary_frame(tables.summary).write_parquet,
            "segments": tables.segments.write_parquet,
        }
        if tables.hindsight_segments is not None:
            writers["hindsight_segments"] = tables.hindsight_segments.write_parquet
        return writers | ({"confusion": tables.confusion.write_parquet} if len(tables.confusion) else {})


def summary_json(row: Mapping[str, Any]) -> str:
    """The summary's row as JSON, settings, notes and findings unfolded."""
    unfolded = {name: json.loads(row[name]) for name in ("settings", "notes", "findings")}
    return json_text({**row, **unfolded})


def open_timeline(path: Path, facts: TimelineFacts, live: str | None = None) -> "Timeline":
    """A timeline that grows into ``path``, and into the viewer at ``live``."""
    from wmr_replay.timeline.writer import Timeline  # noqa: PLC0415 – Rerun is slow to import

    return Timeline(
        path,
        log_name=facts.log_name,
        alpha_nominal=facts.alpha_nominal,
        rate_hz=facts.rate_hz,
        truth=facts.truth,
        torque=facts.torque,
        live=live,
        recording_id=facts.recording_id,
    )
