"""``wmr-replay batch`` as a function: logs in, one dataset and a fleet summary out."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import polars as pl

from wmr_replay.fleet.cluster import Cluster
from wmr_replay.fleet.job import Job, Orders, Outcome
from wmr_replay.fleet.pool import Pool
from wmr_replay.fleet.reports import FLEET_PAGE, write_reports
from wmr_replay.fleet.store import Store
from wmr_replay.fleet.stores import store_at
from wmr_replay.fleet.summary import fleet_frame, write_fleet
from wmr_replay.fleet.work import identify, replay
from wmr_replay.fleet.worklist import find_logs
from wmr_replay.ingest import LogPath
from wmr_replay.report.bundle import check_extra

Progress = Callable[[Outcome | None, int, int], None]
"""Called with the outcome of the log that has just ended (None at the start), bytes done and bytes in all."""


class Workers(Protocol):
    """Runs tasks in parallel: :class:`Pool` or :class:`Cluster`."""

    def map(
        self, function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Any]]:
        """Results by index as they complete; of a failed task, an object whose text states the reason."""


@dataclass(frozen=True, eq=False)
class BatchResult:
    """Outcomes in the order of the logs, and the fleet table over the whole dataset."""

    outcomes: list[Outcome]
    fleet: pl.DataFrame

    @property
    def failed(self) -> list[Outcome]:
        """Those that failed."""
        return [outcome for outcome in self.outcomes if outcome.problem]


def run_batch(
    places: Iterable[LogPath],
    out: LogPath,
    orders: Orders,
    *,
    n_jobs: int = 1,
    scheduler: str | None = None,
    report: bool = False,
    progress: Progress | None = None,
) -> BatchResult:
    """Replay many logs into the dataset at ``out``, on ``n_jobs`` processes or a Dask cluster.

    Logs whose results are there already, for the same content, orders and version, are skipped; a log that
    fails stops no other. Raises InvalidSetting and MissingExtra before any work is begun.
    """
    if report:
        check_extra()
    logs, store = find_logs(places), store_at(out)
    with store.opened():
        workers = Pool[Any](n_jobs) if scheduler is None else Cluster[Any](scheduler)
        with workers:
            outcomes = do_all(workers, logs, orders, store, progress)
        failed = [outcome for outcome in outcomes if outcome.problem]
        fleet = fleet_frame(store, failed)
        write_fleet(store, fleet)
        store.remove(FLEET_PAGE)
        if report:
            write_reports(store, fleet, outcomes)
    return BatchResult(outcomes, fleet)


def do_all(
    workers: Workers, logs: list[LogPath], orders: Orders, store: Store, progress: Progress | None
) -> list[Outcome]:
    """Identify every log by its content, then replay each content once; outcomes in the order of the logs."""
    named: list[Any] = [None] * len(logs)
    for index, found in workers.map(identify, [(log, orders) for log in logs]):
        named[index] = found if isinstance(found, Job | Outcome) else lost(logs[index], "", found)
    jobs = once_each(named)
    done, total = 0, sum(job.size_bytes for job in jobs)
    outcomes: dict[str, Outcome] = {}
    if progress is not None:
        progress(None, 0, total)
    for index, result in workers.map(replay, [(job, store.place) for job in jobs]):
        job = jobs[index]
        outcome = result if isinstance(result, Outcome) else lost(job.log, job.key, result)
        outcomes[job.sha256] = outcome
        done += job.size_bytes
        if progress is not None:
            progress(outcome, done, total)
    return [outcome_of(entry, outcomes) for entry in named]


def once_each(named: Iterable[Job | Outcome]) -> list[Job]:
    """The jobs; of those with equal content only the first."""
    jobs: dict[str, Job] = {}
    for entry in named:
        if isinstance(entry, Job):
            jobs.setdefault(entry.sha256, entry)
    return list(jobs.values())


def outcome_of(entry: Job | Outcome, outcomes: dict[str, Outcome]) -> Outcome:
    """The outcome of a log, or of the log with the same content that was replayed in its place."""
    if isinstance(entry, Outcome):
        return entry
    outcome = outcomes[entry.sha256]
    if outcome.log == str(entry.log):
        return outcome
    return Outcome(str(entry.log), outcome.key, outcome.problem, outcome.skipped, outcome.log)


def lost(log: LogPath, key: str, reason: object) -> Outcome:
    """The outcome of a log whose worker returned no result."""
    return Outcome(str(log), key, f"{log}: {reason}")
