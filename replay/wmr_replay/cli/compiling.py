"""A line on stderr when functions are compiled: seconds in which nothing else is seen."""

import sys
import warnings

from wmr_schemas.compiled import on_compiling
from wmr_schemas.text import shown_lines

LINE = "compiling for the first use of this version (about 15 s, kept for later) …"

_listening = False


def say_when_compiling() -> None:
    """Say once in this process that compiling has begun, and word warnings in one line each."""
    global _listening  # noqa: PLW0603 – a process has one stderr
    if _listening:
        return
    _listening = True
    warnings.formatwarning = lambda message, *_, **__: f"warning: {shown_lines(message)}\n"

    def say(name: str) -> None:
        print(LINE, file=sys.stderr, flush=True)
        stop()

    stop = on_compiling(say)
