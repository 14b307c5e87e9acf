"""How far a command is, for :mod:`wmr_replay.cli.activity`: callbacks that the public functions call."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from wmr_replay.cli import activity
from wmr_replay.cli.verbosity import is_quiet
from wmr_schemas.text import shown

if TYPE_CHECKING:
    from wmr_replay.api.batch import Outcome
    from wmr_replay.api.batch import Progress as BatchProgress


AGAIN = "going over the log again with hindsight, writing the results"


@contextlib.contextmanager
def byte_progress(description: str, then: str = "") -> Iterator[Callable[[int, int], None]]:
    """Yields a callback (bytes done, bytes in all). ``then``: what follows when all bytes are read."""
    activity.tell(description)

    def tell(done: int, total: int) -> None:
        if then and done >= total:
            activity.tell(then)
        else:
            activity.tell(description, done, total)

    try:
        yield tell
    finally:
        activity.stop()


@contextlib.contextmanager
def share_progress(begin: str) -> Iterator[Callable[[str, float], None]]:
    """Yields a callback (what is being done, share done). Steps differ in length: no time is estimated."""
    activity.tell(begin)
    try:
        yield lambda doing, share: activity.tell(doing, share, 1.0, estimates=False)
    finally:
        activity.stop()


@contextlib.contextmanager
def message_progress(description: str) -> Iterator[Callable[[int, int], None]]:
    """Yields a callback (messages done, messages in all)."""
    with byte_progress(description) as tell:
        yield tell


@contextlib.contextmanager
def suite_progress(n_logs: int) -> Iterator[tuple[Callable[[str], Any], Callable[[int, int], None]]]:
    """Yields a callback for each log that is done, and one (messages done, messages in all)."""
    n_done, so_far, in_all = 0, 0, 0

    def show() -> None:
        activity.tell("writing logs", so_far, in_all)

    def announce(_: str) -> None:
        nonlocal n_done
        n_done += 1
        if n_done == n_logs:
            activity.tell("writing the manifest")

    def tell(done: int, total: int) -> None:
        nonlocal so_far, in_all
        so_far, in_all = done, total
        show()

    show()
    try:
        yield announce, tell
    finally:
        activity.stop()


class TimeLeft:
    """The time that a batch still takes, by the bytes of the logs that were replayed.

    A log that failed, or was done before, took no time that says anything of those to come: its bytes leave
    both what is done and what is to do.
    """

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s, self._start_s = now_s, now_s()
        self._done = self._worked = 0

    def ended(self, done: int, *, replayed: bool) -> None:
        """A log has ended; ``done`` bytes of all logs have."""
        self._worked += done - self._done if replayed else 0
        self._done = done

    def left_s(self, total: int) -> float | None:
        """Time left for what remains of ``total`` bytes; None before any log was replayed."""
        if not self._worked:
            return None
        return (self._now_s() - self._start_s) * (total - self._done) / self._worked


@contextlib.contextmanager
def batch_progress() -> Iterator["BatchProgress"]:
    """Yields a callback for each log that has ended: at a terminal the line of the activity, elsewhere a line
    per log; both with the time that is left.
    """
    activity.tell("looking at the logs")
    at_terminal, left, counts = sys.stderr.isatty(), TimeLeft(), {"done": 0, "done before": 0, "failed": 0}

    def tell(outcome: "Outcome | None", done: int, total: int) -> None:
        nonlocal left
        if outcome is None:
            left = TimeLeft()
            activity.tell("replaying", 0, total)
            return
        what = "failed" if outcome.problem else "done before" if outcome.skipped else "done"
        counts[what] += 1
        left.ended(done, replayed=what == "done")
        left_s = left.left_s(total)
        eta = "" if left_s is None or done >= total else f"  (about {activity.clock(left_s)} left)"
        if at_terminal:
            said = ", ".join(f"{n} {name}" for name, n in counts.items() if n)
            activity.tell(said + eta, done, total, estimates=False)
        elif not is_quiet():
            share = done / total if total else 1.0
            print(f"{share:4.0%}  {what}: {shown(outcome.log)}{eta}", file=sys.stderr, flush=True)

    try:
        yield tell
    finally:
        activity.stop()
