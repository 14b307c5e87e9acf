"""Checking logs: replay each, hold it against its reference and its criteria, or accept what is new."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from wmr_replay.regress.criteria import Criterion, Judged, judge
from wmr_replay.regress.differences import DIFFERENCES, TableComparison, compare_tables
from wmr_replay.regress.replayed import Asked, Changes, replay, stored_request
from wmr_replay.regress.results import Results, read_results, rows_of_reference, stems, write_reference
from wmr_replay.regress.tolerance import TABLES, Tolerances, read_tolerances
from wmr_schemas.errors import LogUnusable, WmrError

DIFF = pl.Schema([("log", pl.String), ("table", pl.String), *DIFFERENCES.items()])
"""The diff file's columns."""
Asking = Callable[[Asked], Asked]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class LogCheck:
    """The outcome of one log. ``problem``: why nothing could be compared at all."""

    log: Path
    tables: tuple[TableComparison, ...] = ()
    criteria: tuple[Judged, ...] = ()
    problem: str | None = None
    unusable: bool = False
    notes: tuple[str, ...] = ()
    accepted: bool = False

    @property
    def same(self) -> bool:
        """Whether the tables are those of the reference."""
        return bool(self.tables) and all(table.passed for table in self.tables)

    @property
    def passed(self) -> bool:
        """Whether at least one comparison or criterion applied, and all of them hold."""
        if self.problem is not None:
            return False
        compared = self.tables or self.criteria or self.accepted
        return bool(compared) and self.tables_passed and all(judged.passed for judged in self.criteria)

    @property
    def tables_passed(self) -> bool:
        """Whether no table differs, or the new ones were accepted."""
        return self.accepted or all(table.passed for table in self.tables)

    def differences(self) -> pl.DataFrame:
        """Every value beyond its tolerance."""
        columns = (pl.lit(self.log.stem).alias("log"), pl.col("*"))
        parts = [
            table.differences.select(columns[0], pl.lit(table.table).alias("table"), columns[1])
            for table in self.tables
        ]
        return pl.concat([pl.DataFrame(schema=DIFF), *parts])


@dataclass(frozen=True, eq=False)
class Checker:
    """Compares logs with references in a directory, with criteria, or both.

    ``asking`` changes what a replay is asked for, from what the reference says; ``first_asking`` from the
    defaults, for a log without one. With ``update`` what differs becomes the new reference, with every N-th
    row of its samples, N = ``every``; None: as many as before.
    """

    references: Path | None
    criteria: tuple[Criterion, ...] = ()
    asking: Asking = field(default_factory=Changes)
    first_asking: Asking = field(default_factory=Changes)
    update: bool = False
    every: int | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)

    @classmethod
    def of(
        cls,
        references: Path | None,
        criteria: Sequence[Criterion],
        asking: Asking,
        first_asking: Asking,
        *,
        update: bool = False,
        every: int | None = None,
    ) -> "Checker":
        """A checker with the tolerances that lie beside the references."""
        tolerances = read_tolerances(references) if references else Tolerances()
        return cls(references, tuple(criteria), asking, first_asking, update, every, tolerances)

    def check(self, log: Path, progress: Progress | None = None) -> LogCheck:
        """Replay one log and compare."""
        reference = self._reference(log)
        try:
            new = replay(log, self._asked(log, reference), progress)
        except LogUnusable as error:
            return LogCheck(log, problem=str(error), unusable=True)
        criteria = tuple(judge(log.stem, new.summary.row(0, named=True), self.criteria))
        if self.references is None:
            return LogCheck(
                log, criteria=criteria, problem=None if criteria else "no criterion applies to it"
            )
        tables = () if reference is None else compare_results(reference, new, self.tolerances)
        same = bool(tables) and all(table.passed for table in tables)
        if self.update and not same:
            every = self.every or (1 if reference is None else reference.every)
            write_reference(self.references, log.stem, new, self.tolerances, every)
        accepted = self.update and not same
        problem = "it has no reference" if reference is None and not accepted else None
        notes = () if reference is None else other_bytes(reference, new)
        return LogCheck(log, tables, criteria, problem, notes=notes, accepted=accepted)

    def missing(self, logs: Sequence[Path]) -> list[str]:
        """References whose log was not given."""
        given = {log.stem for log in logs}
        return (
            [] if self.references is None else [stem for stem in stems(self.references) if stem not in given]
        )

    def _asked(self, log: Path, reference: Results | None) -> Asked:
        if reference is None:
            return self.first_asking(Asked())
        return self.asking(stored_request(reference, self.references or log))

    def _reference(self, log: Path) -> Results | None:
        if self.references is None or log.stem not in stems(self.references):
            return None
        return read_results(self.references, log.stem)


@dataclass(frozen=True)
class Refused:
    """The error that ended a check before it had an outcome, as text."""

    problem: str


def check_alone(checker: Checker, log: Path) -> LogCheck | Refused:
    """One log, as the task of a process: errors come back as text."""
    try:
        return checker.check(log)
    except WmrError as error:
        return Refused(str(error))


def compare_results(reference: Results, new: Results, tolerances: Tolerances) -> tuple[TableComparison, ...]:
    """Each table against its reference; of thinned samples the rows that the reference holds."""
    thinned = len(reference.samples) < len(new.samples) and "t_ns" in reference.samples.columns
    samples = rows_of_reference(reference.samples, new.samples) if thinned else new.samples
    new = Results(samples, new.segments, new.summary)
    return tuple(
        compare_tables(table, reference.table(table), new.table(table), tolerances.tables[table])
        for table in TABLES
    )


def other_bytes(reference: Results, new: Results) -> tuple[str, ...]:
    """A note where the log's file is not the one that the reference was made from."""
    before, now = (result.summary["log_sha256"][0] for result in (reference, new))
    return () if before == now else ("the log's bytes are not those that the reference was made from",)
