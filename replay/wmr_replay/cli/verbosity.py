"""How much is said: --quiet, --verbose. A process has one command line, and so one level."""

import contextlib
import os
import sys
from collections.abc import Iterator
from enum import IntEnum
from pathlib import Path
from typing import TextIO


class Level(IntEnum):
    """``QUIET``: errors, and what --json prints; ``VERBOSE``: every stage with its time too."""

    QUIET = -1
    NORMAL = 0
    VERBOSE = 1


_level = Level.NORMAL
_heard: TextIO | None = None
"""Standard error as it is outside of :func:`unheard`."""


def speak(level: Level) -> None:
    """Set the level."""
    global _level  # noqa: PLW0603 – one a process
    _level = level


def speak_normally() -> None:
    """Back to the normal level, at the end of a call: what comes next in the process is heard."""
    speak(Level.NORMAL)


def is_quiet() -> bool:
    """Whether nothing but errors is said."""
    return _level is Level.QUIET


def is_verbose() -> bool:
    """Whether every stage is said."""
    return _level is Level.VERBOSE


@contextlib.contextmanager
def unheard(*, json: bool) -> Iterator[None]:
    """Let nobody hear what is printed; with ``json`` standard output is heard."""
    global _heard  # noqa: PLW0603 – one a process
    _heard = sys.stderr
    try:
        with contextlib.ExitStack() as stack:
            nowhere = stack.enter_context(Path(os.devnull).open("w", encoding="utf-8"))
            stack.enter_context(contextlib.redirect_stderr(nowhere))
            if not json:
                stack.enter_context(contextlib.redirect_stdout(nowhere))
            yield
    finally:
        _heard = None


def heard() -> TextIO:
    """Standard error for what was asked for, and so is said under --quiet too."""
    return _heard or sys.stderr
