"""``python -m wmr_replay`` is ``wmr-replay``."""

import atexit
import contextlib
import os
import sys
from typing import NoReturn

from wmr_replay.cli import main


def program() -> NoReturn:
    """The command: :func:`~wmr_replay.cli.main`, and the end of the process.

    What was registered for the end is called. Python's own teardown is left out: it frees one by one what the
    system takes back at once, in a tenth of the time of a short command.
    """
    code: object = 0
    try:
        main()
    except SystemExit as end:
        code = end.code
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, OSError, ValueError):  # none, gone or closed
            stream.flush()
    os._exit(code if isinstance(code, int) else int(code is not None))


if __name__ == "__main__":
    program()
