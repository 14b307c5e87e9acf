"""Replay as a regression test: logs against stored references, or summaries against criteria."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

import polars as pl

from wmr_replay.api.places import LocalPlace, local_path
from wmr_replay.api.request import (
    Instant,
    MappingLike,
    ModelLike,
    SettingsArguments,
    between_of,
    mapping_of,
    model_of,
    settings_of,
    untuned,
)
from wmr_replay.fleet.pool import Pool
from wmr_replay.jobs.replay import Progress
from wmr_replay.regress.check import Checker, LogCheck, Refused, check_alone
from wmr_replay.regress.criteria import read_criteria, required
from wmr_replay.regress.files import write_diff, write_text
from wmr_replay.regress.logs import find_logs
from wmr_replay.regress.replayed import Changes
from wmr_replay.regress.report import check_json, check_lines, junit_xml
from wmr_replay.regress.results import stems
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.text import shown

Watch = Callable[[str], AbstractContextManager[Progress | None]]
"""Given the name of a log, a context that yields the progress callback of its replay."""


@dataclass(frozen=True, eq=False)
class Check:
    """The answer of ``check``.

    Attributes:
        logs: The outcome of each log: ``passed``, ``tables``, ``criteria``, ``problem``.
        missing: References whose log was not given.
        accept: The command that stores what differs as the new reference, where the caller named one.
    """

    logs: tuple[LogCheck, ...]
    missing: tuple[str, ...]
    accept: str | None = None

    @property
    def passed(self) -> bool:
        """Whether every log passed."""
        return all(log.passed for log in self.logs)

    @property
    def unusable(self) -> bool:
        """Whether what failed are logs that cannot be used, and nothing else."""
        failed = [log for log in self.logs if not log.passed]
        return bool(failed) and all(log.unusable for log in failed)

    @property
    def acceptable(self) -> list[Path]:
        """Logs whose new answer could become the reference."""
        return [log.log for log in self.logs if not (log.unusable or log.same or log.accepted)]

    def differences(self) -> pl.DataFrame:
        """Every value beyond its tolerance."""
        return pl.concat([log.differences() for log in self.logs])

    def lines(self) -> list[str]:
        """The outcome as text."""
        lines = [line for log in self.logs for line in check_lines(log)]
        lines += [f"{shown(stem)}: not checked, its log was not given" for stem in self.missing]
        return [*lines, f"{sum(log.passed for log in self.logs)} of {len(self.logs)} logs passed"]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return check_json(self.logs, self.missing, self.accept)

    def write_differences(self, path: LocalPlace) -> Path:
        """Write every value beyond its tolerance: a Parquet table by its ending, else columns of text."""
        return self._written(local_path(path), lambda target: write_diff(target, self.logs))

    def write_junit(self, path: LocalPlace) -> Path:
        """Write the outcome as JUnit XML."""
        text = junit_xml(self.logs, self.missing, self.accept)
        return self._written(local_path(path), lambda target: write_text(target, text))

    def _written(self, target: Path, write: Callable[[Path], None]) -> Path:
        try:
            write(target)
        except OSError as error:
            raise InvalidSetting(f"{error.filename or ''}: cannot be written ({error.strerror})") from None
        return target

    def __str__(self) -> str:
        return "\n".join(self.lines())


def check(
    references: LocalPlace | None,
    logs: LocalPlace | Sequence[LocalPlace],
    *,
    criteria: LocalPlace | None = None,
    require: Sequence[str] = (),
    update: bool = False,
    every: int | None = None,
    model: ModelLike | None = None,
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    watch: Watch | None = None,
    jobs: int = 1,
    unreferenced: Mapping[str, Any] | None = None,
    **settings: Unpack[SettingsArguments],
) -> Check:
    """Replay logs and compare the tables with stored references, or hold the summaries to criteria.

    A log is replayed with the settings that its reference was made with; what is given here stands above
    them. Types and counts are compared first, then every value within ``max(abs, rel·|reference|)`` of its
    column.

    Args:
        references: Directory of references, each named after its log; None: criteria alone.
        logs: Logs, bags, or directories of them.
        criteria: TOML file with bounds on columns of the summary.
        require: Bounds on columns of the summary as texts, ``accuracy >= .93``, besides those of the file.
        update: Store what differs, or has no reference, as the reference.
        every: With ``update``: keep every n-th row of samples; None: as stored, else 1.
        model: Model or model file.
        mapping: Mapping or mapping file.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        watch: Called with the name of each log; a context that yields a progress callback.
        jobs: Logs replayed at the same time, each in a process of its own.
        unreferenced: ``mapping``, ``start``, ``end``, ``model`` and settings for logs without a reference,
            where they differ from those given here; None: the same.
        **settings: Fields of ``wmr_replay.Settings`` that stand above those of the references.

    Raises:
        InvalidSetting: Neither references nor criteria, or a directory that is not there.
    """
    folder = None if references is None else local_path(references)
    check_folder(folder, update=update, has_criteria=criteria is not None or bool(require))
    places = [logs] if isinstance(logs, str) or not isinstance(logs, Sequence) else list(logs)
    found = find_logs([local_path(place) for place in places])
    bounds = () if criteria is None else read_criteria(local_path(criteria))
    bounds = (*bounds, *map(required, require))
    asking = changes_of(settings, mapping_of(mapping), start, end, model)
    first = asking if unreferenced is None else changes_by(**unreferenced)
    checker = Checker.of(folder, bounds, asking, first, update=update, every=every)
    if jobs > 1:
        checked = check_in_processes(checker, found, jobs, watch)
    else:
        checked = tuple(check_log(checker, log, watch) for log in found)
    return Check(checked, tuple(checker.missing(found)))


def check_folder(folder: Path | None, *, update: bool, has_criteria: bool) -> None:
    """Raises InvalidSetting unless there is something to hold the logs against."""
    if folder is None and not has_criteria:
        raise InvalidSetting("neither references nor criteria: there is nothing to hold the logs against")
    if folder is not None and not update and not folder.is_dir():
        raise InvalidSetting(
            f"{folder}: there is no such directory; `--update` makes one of what is found now"
        )


def holds_references(folder: LocalPlace) -> bool:
    """Whether a directory holds results that can serve as references."""
    path = local_path(folder)
    return path.is_dir() and bool(stems(path))


def changes_of(
    settings: Mapping[str, Any],
    mapping: LogMapping | None,
    start: Instant | None,
    end: Instant | None,
    model: ModelLike | None,
) -> Changes:
    """What the caller changes of a reference's request."""
    settings_of(settings)
    between, read = between_of(start, end), model_of(model)
    chosen = None if mapping == LogMapping() else mapping
    return Changes(untuned(settings), chosen, between or None, read)


def check_in_processes(
    checker: Checker, logs: Sequence[Path], jobs: int, watch: Watch | None
) -> tuple[LogCheck, ...]:
    """Every log, ``jobs`` at a time. Raises InvalidSetting with the first error that is no outcome."""
    found: dict[int, LogCheck] = {}
    with nullcontext() if watch is None else watch(f"{len(logs)} logs"), Pool[Any](jobs) as workers:
        for index, outcome in workers.map(check_alone, [(checker, log) for log in logs]):
            if isinstance(outcome, Refused):
                raise InvalidSetting(outcome.problem)
            if isinstance(outcome, LogCheck):
                found[index] = outcome
            else:
                found[index] = LogCheck(logs[index], problem=str(outcome))
    return tuple(found[index] for index in range(len(logs)))


def changes_by(
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    model: ModelLike | None = None,
    **settings: Any,
) -> Changes:
    """The same from keyword arguments."""
    return changes_of(settings, mapping_of(mapping), start, end, model)


def check_log(checker: Checker, log: Path, watch: Watch | None) -> LogCheck:
    """One log."""
    with nullcontext() if watch is None else watch(log.name) as progress:
        return checker.check(log, progress)
