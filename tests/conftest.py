"""The command line in this process, since a new process would import all packages again."""

import contextlib
import io
import os
import sys
from collections.abc import Callable
from typing import NamedTuple
from unittest import mock

import pytest
from hypothesis import settings

os.environ.setdefault("WMR_REPLAY_PROGRESS", "never")  # a slow machine writes no further lines
settings.register_profile("compiled", deadline=None)  # a first call may compile
settings.load_profile("compiled")


class Outcome(NamedTuple):
    code: int
    stdout: str
    stderr: str


def run_command_line(*arguments: object) -> Outcome:
    """``wmr-replay`` with these arguments, to its exit code."""
    from wmr_replay.cli import main

    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", ["wmr-replay", *map(str, arguments)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
            code = 0
        except SystemExit as done:
            code = int(done.code or 0)
    return Outcome(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="session")
def command_line() -> Callable[..., Outcome]:
    """``command_line(*arguments) -> (code, stdout, stderr)``."""
    return run_command_line


@pytest.fixture(scope="session")
def command() -> Callable[..., Outcome]:
    """The same with ``code=0`` as the exit code that it must end with."""

    def run(*arguments: object, code: int = 0) -> Outcome:
        done = run_command_line(*arguments)
        assert done.code == code, done.stdout + done.stderr
        return done

    return run
