"""Progress bars for long work on standard error; without a terminal there is none."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from wmr_schemas.text import shown

if TYPE_CHECKING:
    from wmr_replay.api.batch import Outcome
    from wmr_replay.api.batch import Progress as BatchProgress


@contextlib.contextmanager
def byte_progress(description: str) -> Iterator[Callable[[int, int], None] | None]:
    """Yields a callback (bytes done, bytes in all), or None when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

    from wmr_replay.cli.printing.plain import console_of

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        DownloadColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console_of(stderr=True), transient=True) as bar:
        task = bar.add_task(shown(description), total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextlib.contextmanager
def share_progress() -> Iterator[Callable[[str, float], None] | None]:
    """Yields a callback (what is being done, share done), or None when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from wmr_replay.cli.printing.plain import console_of

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console_of(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda doing, share: bar.update(task, description=shown(doing), completed=share)


@contextlib.contextmanager
def batch_progress() -> Iterator["BatchProgress"]:
    """Yields a callback for each log that has ended: a bar at a terminal, else a line per log, both with the
    time that is left by the bytes that were done.
    """
    if not sys.stderr.isatty():
        yield log_lines()
        return
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

    from wmr_replay.cli.printing.plain import console_of

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        DownloadColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console_of(stderr=True), transient=True) as bar:
        task = bar.add_task("looking at the logs", total=None)
        counts = {"done": 0, "failed": 0}

        def tell(outcome: "Outcome | None", done: int, total: int) -> None:
            if outcome is not None:
                counts["failed" if outcome.problem else "done"] += 1
            text = ", ".join(f"{n} {what}" for what, n in counts.items() if n)
            bar.update(task, description=text or "replaying", completed=done, total=total)

        yield tell


def log_lines() -> "BatchProgress":
    """A line on standard error for each log that has ended."""
    start_s = time.monotonic()

    def tell(outcome: "Outcome | None", done: int, total: int) -> None:
        if outcome is None:
            return
        what = "failed" if outcome.problem else "done before" if outcome.skipped else "done"
        left_s = (time.monotonic() - start_s) * (total - done) / done if done else None
        eta = "" if left_s is None else f"  (about {left_s:.0f} s left)"
        share = done / total if total else 1.0
        print(f"{share:4.0%}  {what}: {shown(outcome.log)}{eta}", file=sys.stderr, flush=True)

    return tell


LONG_LOG_MESSAGES = 200_000


@contextlib.contextmanager
def message_progress(n_messages: int) -> Iterator[Callable[[int, int], None] | None]:
    """Yields a callback (messages done, messages in all) for a long log at a terminal, else None."""
    if n_messages < LONG_LOG_MESSAGES or not sys.stderr.isatty():
        yield None
        return
    from rich.progress import Progress

    from wmr_replay.cli.printing.plain import console_of

    with Progress(console=console_of(stderr=True), transient=True) as bar:
        task = bar.add_task("writing", total=n_messages)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextlib.contextmanager
def suite_progress(
    n_logs: int,
) -> Iterator[tuple[Callable[[str], Any], Callable[[int, int], None] | None]]:
    """Yields a callback for each log that is done, and one (messages done, messages in all)."""
    if not sys.stderr.isatty():
        yield (lambda _: None), None
        return
    from rich.progress import Progress

    from wmr_replay.cli.printing.plain import console_of

    n_done = 0
    with Progress(console=console_of(stderr=True), transient=True) as bar:
        task = bar.add_task(f"0 of {n_logs} logs", total=None)

        def announce(_: str) -> None:
            nonlocal n_done
            n_done += 1
            bar.update(task, description=f"{n_done} of {n_logs} logs")

        yield announce, lambda done, total: bar.update(task, completed=done, total=total)
