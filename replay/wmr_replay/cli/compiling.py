"""A line on stderr when functions are compiled: seconds in which nothing else is seen."""

import sys
import warnings

from wmr_replay.cli import activity
from wmr_replay.cli.verbosity import is_verbose
from wmr_schemas.compiled import on_compiling
from wmr_schemas.text import shown_lines

STAGE = "compiling for the first use of this version, about 15 s"
LINE = "compiling for the first use of this version (about 15 s, kept for later) …"

_listening = False


def say_when_compiling() -> None:
    """Say once in this process that compiling has begun, and word warnings in one line each."""
    global _listening  # noqa: PLW0603 – a process has one stderr
    if _listening:
        return
    _listening = True
    warnings.formatwarning = lambda message, *_, **__: f"{activity.erased()}warning: {shown_lines(message)}\n"

    def say(name: str) -> None:
        if sys.stderr.isatty() and not is_verbose():
            activity.tell(STAGE)
        else:
            print(LINE, file=sys.stderr, flush=True)
        stop()

    stop = on_compiling(say)
