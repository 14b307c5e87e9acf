"""What the program is doing now, on standard error, from the first second on.

At a terminal one line shows it, with a bar, the time and what is left. In a pipe or file one line is written,
once, when a command takes longer than five seconds. With --verbose every stage gets a line of its own; with
--quiet, or ``WMR_REPLAY_PROGRESS=never``, nothing is said.
"""

import contextlib
import os
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

from wmr_replay.cli.verbosity import is_quiet, is_verbose
from wmr_schemas.text import shown

VARIABLE = "WMR_REPLAY_PROGRESS"
QUIET_S = 5.0
"""A pipe is told nothing before this."""
FIRST_S, EVERY_S = 0.3, 0.2
"""The line at a terminal: first shown, shown again."""
BAR = 20
LEAST_SHARE, LEAST_S = 0.02, 1.0
"""Below these the time that is left is not known well enough."""
ERASE = "\r\x1b[K"


@dataclass
class Stage:
    """A piece of work: what it is, how much of it is done, and since when it has been going on."""

    text: str
    done: float = 0.0
    total: float = 0.0
    since_s: float = field(default_factory=time.monotonic)
    estimates: bool = True
    """Whether the time that is left follows from the time spent."""

    def share(self) -> float | None:
        """The share that is done; None where it is not known."""
        return min(self.done / self.total, 1.0) if self.total > 0 else None

    def left_s(self, now_s: float) -> float | None:
        """Time that is left, at the speed so far."""
        share, spent_s = self.share(), now_s - self.since_s
        if not self.estimates or share is None or share < LEAST_SHARE or spent_s < LEAST_S:
            return None
        return spent_s * (1 - share) / share


class Activity:
    """The stages of one command, told by a thread until :meth:`stop`."""

    def __init__(self) -> None:
        self._start_s = time.monotonic()
        self._stage = Stage("loading")
        self._ended = threading.Event()
        self._said_once = self._drawn = False
        self._at_terminal = sys.stderr.isatty()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def resume(self) -> None:
        """Begin, or begin again after :meth:`stop`."""
        if is_quiet() or os.environ.get(VARIABLE) == "never" or self._thread is not None:
            return
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(self._ended,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Remove the line; what follows on the terminal stands where it was."""
        thread, self._thread = self._thread, None
        if thread is None:
            return
        self._ended.set()
        thread.join()
        self.erase()

    def tell(self, text: str, done: float = 0.0, total: float = 0.0, *, estimates: bool = True) -> None:
        """The stage that is going on, and how far it is."""
        if text != self._stage.text:
            self._stage = Stage(text, done, total, estimates=estimates)
            if is_verbose():
                self._write(f"{time.monotonic() - self._start_s:7.2f} s  {shown(text)}\n")
        else:
            self._stage.done, self._stage.total = done, total

    def erase(self) -> None:
        """Remove the line at the terminal, if there is one."""
        with self._lock:
            if self._drawn:
                sys.stderr.write(ERASE)
                sys.stderr.flush()
                self._drawn = False

    def _run(self, ended: threading.Event) -> None:
        if is_verbose():
            return
        if self._at_terminal:
            wait_s = FIRST_S
            while not ended.wait(wait_s):
                self._draw()
                wait_s = EVERY_S
        elif not self._said_once and not ended.wait(max(self._start_s + QUIET_S - time.monotonic(), 0.0)):
            self._said_once = True
            self._write(f"{plain_line(self._stage)} …\n")

    def _draw(self) -> None:
        columns = shutil.get_terminal_size().columns - 1
        line = bar_line(self._stage, time.monotonic())[:columns]
        with self._lock, contextlib.suppress(OSError, ValueError):
            sys.stderr.write(ERASE + line)
            sys.stderr.flush()
            self._drawn = True

    def _write(self, text: str) -> None:
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.write(text)
            sys.stderr.flush()


def plain_line(stage: Stage) -> str:
    """The stage in words, with the share that is done."""
    share = stage.share()
    return shown(stage.text) + ("" if share is None else f", {share:.0%}")


def bar_line(stage: Stage, now_s: float) -> str:
    """The stage, a bar where its share is known, the time spent, and the time left."""
    share, left_s = stage.share(), stage.left_s(now_s)
    parts = [shown(stage.text)]
    if share is not None:
        filled = round(BAR * share)
        parts.append(f"[{'#' * filled}{'.' * (BAR - filled)}] {share:4.0%}")
    parts.append(clock(now_s - stage.since_s))
    if left_s is not None:
        parts.append(f"about {clock(left_s)} left")
    return "  ".join(parts)


def clock(seconds: float) -> str:
    """A time as 7 s, 3:05 or 2:03:05."""
    whole = round(seconds)
    minutes, hours = whole // 60, whole // 3600
    if not minutes:
        return f"{whole} s"
    return f"{hours}:{minutes % 60:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


_current: Activity | None = None


@contextlib.contextmanager
def activity() -> Iterator[Activity]:
    """The activity of a command, from its begin to its end."""
    global _current  # noqa: PLW0603 – a process runs one command at a time
    before, _current = _current, Activity()
    _current.resume()
    try:
        yield _current
    finally:
        _current.stop()
        _current = before


def tell(text: str, done: float = 0.0, total: float = 0.0, *, estimates: bool = True) -> None:
    """Say what is being done, where a command is running."""
    if _current is not None:
        _current.resume()
        _current.tell(text, done, total, estimates=estimates)


def stop() -> None:
    """Remove the line before something else is printed."""
    if _current is not None:
        _current.stop()


def erased() -> str:
    """What to write before a line on standard error, so that it stands alone."""
    if _current is not None:
        _current.erase()
    return ""
