"""How much is said: --quiet, --verbose. A process has one command line, and so one level."""

from enum import IntEnum


class Level(IntEnum):
    """``QUIET``: errors, and what --json prints; ``VERBOSE``: every stage with its time too."""

    QUIET = -1
    NORMAL = 0
    VERBOSE = 1


_level = Level.NORMAL


def speak(level: Level) -> None:
    """Set the level."""
    global _level  # noqa: PLW0603 – one a process
    _level = level


def speak_normally() -> None:
    """Back to the normal level, at the begin of a call."""
    speak(Level.NORMAL)


def is_quiet() -> bool:
    """Whether nothing but errors is said."""
    return _level is Level.QUIET


def is_verbose() -> bool:
    """Whether every stage is said."""
    return _level is Level.VERBOSE
