"""What a replay found, as one object: tables, settings, files, pictures."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from wmr_replay.api.names import MODE_COLUMNS, with_mode_names
from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.store import HINDSIGHT_SCHEMA, SampleStore
from wmr_replay.jobs.owner import Claim, outdated
from wmr_replay.jobs.replay import RunTables, TimelineFacts
from wmr_replay.jobs.result_files import open_timeline, write_results
from wmr_replay.jobs.run import write_report
from wmr_replay.report.run import RunTables as ReportTables
from wmr_replay.tables.summary import summary_frame
from wmr_schemas.tables import SEGMENTS, polars_schema
from wmr_schemas.text import shown

if TYPE_CHECKING:
    from wmr_replay.api.plots.figure import Figure


class Result:
    """The answer of ``run`` and ``replay``.

    Tables are polars frames with the columns of the documented schemas; ``mode`` and ``mode_true`` show names
    (``undecided``, ``ideal``, ``skidding``, ``slipping``, ``skidding_slipping``), on disk they are Int8.

    Attributes:
        stem: Name of the log without its ending; result files are named after it.
        files: The files that were written, by kind; empty for a result that was not asked to write any.
    """

    def __init__(
        self,
        stem: str,
        store: SampleStore,
        tables: RunTables,
        facts: TimelineFacts,
        files: Mapping[str, Path] | None = None,
        *,
        hindsight: SampleStore | None = None,
    ) -> None:
        self._later = hindsight or SampleStore(schema=HINDSIGHT_SCHEMA)
        self.stem, self.files = stem, dict(files or {})
        self._store, self._tables, self._facts = store, tables, facts

    @property
    def samples(self) -> pl.LazyFrame:
        """One row per pose sample, lazily: select what is needed, then ``collect()``.

        Samples of a long log lie in a temporary file, which is removed together with this result.
        """
        return with_mode_names(self._store.lazy(), MODE_COLUMNS)

    @property
    def hindsight(self) -> pl.LazyFrame:
        """One row per pose sample, lazily: what the recording as a whole says about every moment.

        Empty with ``hindsight=False`` and for a log that is too short.
        """
        return with_mode_names(self._later.lazy(), MODE_COLUMNS)

    @property
    def hindsight_segments(self) -> pl.DataFrame:
        """One row per stretch of one mode in hindsight."""
        segments = self._tables.hindsight_segments
        empty = pl.DataFrame(schema=polars_schema(SEGMENTS))
        return with_mode_names(empty if segments is None else segments, ("mode",))

    @property
    def segments(self) -> pl.DataFrame:
        """One row per stretch of one estimated mode; ``start_s`` and ``end_s`` count from the first pose."""
        segments = with_mode_names(self._tables.segments, ("mode",))
        if "start_s" in segments.columns or not len(segments):
            return segments
        start_ns = segments["start_ns"][0]
        times = (((pl.col(f"{end}_ns") - start_ns) / 1e9).alias(f"{end}_s") for end in ("start", "end"))
        return segments.with_columns(times)

    @property
    def summary(self) -> pl.DataFrame:
        """One row about the whole log: shares of the modes, α, scores, counts of anomalies, verdict."""
        return summary_frame(self._tables.summary)

    @property
    def confusion(self) -> pl.DataFrame:
        """Seconds by true and estimated mode; empty without a truth."""
        return with_mode_names(self._tables.confusion, MODE_COLUMNS)

    @property
    def settings(self) -> dict[str, Any]:
        """Everything that decided the numbers: settings, robot, effects, channels, the tuned kernel."""
        settings: dict[str, Any] = json.loads(self._tables.summary["settings"])
        return settings

    @property
    def verdict(self) -> str:
        """The result in a sentence or two."""
        return str(self._tables.summary["verdict"])

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed: losses, clocks, what was left out."""
        return tuple(json.loads(self._tables.summary["notes"]))

    @property
    def findings(self) -> tuple[dict[str, Any], ...]:
        """What is wrong with the data: ``code``, ``severity``, ``text``, ``meaning``, ``advice``, ``n``,
        ``where``.
        """
        return tuple(json.loads(self._tables.summary["findings"]))

    def save(self, directory: LocalPlace, *, timeline: bool = True, force: bool = False) -> dict[str, Path]:
        """Write the files that ``wmr-replay run --out DIRECTORY`` writes; the files by kind.

        They appear together or not at all. ``directory`` is made where it is missing. Results of another log
        of the same name are replaced with ``force`` alone. Raises InvalidSetting without.
        """
        claim = self._claim(local_path(directory))
        replaces = claim.settled(force=force)
        facts = (lambda: self._facts) if timeline else None
        tables = self._tables
        files, _ = write_results(
            claim.directory,
            self.stem,
            self._store.batches(),
            self._later.batches(),
            lambda: tables,
            facts,
        )
        if replaces:
            claim.remove_others(files.values())
        return files

    def outdated(self) -> list[Path]:
        """Results beside this one's files that were made of an earlier content of the log."""
        folders = {path.parent for path in self.files.values()}
        return [file for folder in folders for file in outdated(folder, self.stem, self._sha256)]

    @property
    def _sha256(self) -> str | None:
        sha256: str | None = self._tables.summary["log_sha256"]
        return sha256

    def _claim(self, directory: Path) -> Claim:
        return Claim(directory, self.stem, self._tables.summary["log"], lambda: self._sha256)

    def timeline(self, path: LocalPlace) -> Path:
        """Write the Rerun timeline to ``path`` (``.rrd``); open it with ``rerun FILE``."""
        target = local_path(path)
        home_of(target)
        timeline = open_timeline(target, self._facts)
        try:
            for samples in self._store.batches():
                timeline.push(samples)
            for rows in self._later.batches():
                timeline.push_hindsight(rows)
            timeline.finish(self.verdict, self.findings)
        except BaseException:
            timeline.discard()
            raise
        return target

    def report(self, path: LocalPlace) -> Path:
        """Write the report to ``path`` (``.html``): one file to mail, with everything inside.

        Raises MissingExtra without the extra ``report``.
        """
        target = local_path(path)
        home_of(target)
        write_report(target, self.report_tables(), self.stem)
        return target

    def report_tables(self) -> ReportTables:
        """What a report is drawn from: the tables as they are on disk."""
        tables = self._tables
        return ReportTables(tables.summary, self._store.lazy(), self._later.lazy(), tables.confusion)

    def plot(self) -> "Figure":
        """Path, modes, velocities and α over time as a matplotlib figure.

        Raises MissingExtra without matplotlib (``pip install 'wmr-replay[plot]'``).
        """
        from wmr_replay.api.plots import run_figure  # noqa: PLC0415 – an extra

        return run_figure(self)

    @property
    def stored_segments(self) -> pl.DataFrame:
        """The segments as they are on disk, modes as numbers."""
        return self._tables.segments

    def stored_batches(self) -> Iterator[pl.DataFrame]:
        """The samples as they are on disk, modes as numbers, piece by piece."""
        return self._store.batches()

    def batches(self) -> Iterator[pl.DataFrame]:
        """The samples table in order, piece by piece, with bounded memory; modes by name."""
        for samples in self._store.batches():
            yield with_mode_names(samples, MODE_COLUMNS)

    def __repr__(self) -> str:
        return shown(f"<Result of {self._tables.summary['log']}: {self.verdict}>")

    def _repr_html_(self) -> str:
        from wmr_replay.api.html import result_html  # noqa: PLC0415 – for notebooks alone

        return result_html(self)
