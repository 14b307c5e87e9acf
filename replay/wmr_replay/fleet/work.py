"""The tasks of a worker, on any process or machine: functions of plain values, errors as text."""

import os
from collections.abc import Callable
from typing import Any

from wmr_replay.fleet.job import Job, Orders, Outcome, make_job
from wmr_replay.fleet.store import timeline_name
from wmr_replay.fleet.stores import store_at
from wmr_replay.ingest import LogPath
from wmr_schemas import __version__
from wmr_schemas.errors import WmrError


def identify(log: LogPath, orders: Orders) -> Job | Outcome:
    """The job of a log, or the outcome that states why it cannot be read."""
    found: list[Job] = []
    problem = problem_of(lambda: found.append(make_job(log, orders)))
    return found[0] if found else Outcome(str(log), problem=problem)


def replay(job: Job, out: LogPath) -> Outcome:
    """Do a job, unless it is done already."""
    if job.version != __version__:
        problem = f"this worker has wmr-replay {__version__}, the batch was started by {job.version}"
        return Outcome(str(job.log), job.key, problem)
    skipped: list[bool] = []
    problem = problem_of(lambda: skipped.append(_replay(job, out)))
    return Outcome(str(job.log), job.key, problem, skipped == [True])


def _replay(job: Job, out: LogPath) -> bool:
    from wmr_replay.fleet.dataset import replay_into  # noqa: PLC0415 – a job that is done needs none of it

    store = store_at(out)
    if is_done(job, store.record(job.key)):
        return True
    replay_into(store, job)
    return False


def is_done(job: Job, record: dict[str, Any] | None) -> bool:
    """Whether a completion record is that of this job, with a timeline where one is wanted.

    A timeline that is there stays with a batch that wants none: it is of the same rows.
    """
    if record is None or record["task"] != job.task:
        return False
    return not job.orders.timeline or timeline_name(job.key) in record["files"]


def problem_of(work: Callable[[], object]) -> str:
    """The error message that ``wmr-replay run`` would print; empty on success."""
    try:
        work()
    except WmrError as error:
        return str(error)
    except OSError as error:
        return f"{error.filename or 'the file'}: cannot be read or written ({error.strerror or error})"
    except Exception as error:
        if os.environ.get("WMR_REPLAY_TRACEBACK"):
            raise
        return f"internal error: {type(error).__name__}: {error}"
    return ""
