"""The end of the command: what it printed, what was registered for the end, and its exit code."""

import subprocess
import sys

import pytest

PROBE = """
import atexit, sys
import wmr_replay.__main__ as command

def main():
    atexit.register(print, "registered")
    sys.stdout.write("printed, ")
    if sys.argv[1]:
        raise SystemExit(eval(sys.argv[1]))

command.main = main
command.program()
"""


@pytest.mark.parametrize(("raised", "code"), [("", 0), ("3", 3), ("None", 0), ("'a text'", 1)])
def test_nothing_is_lost_at_the_end(raised: str, code: int, environment: dict[str, str]) -> None:
    command = [sys.executable, "-c", PROBE, raised]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("printed, registered\n", code), done.stderr


def test_a_mistake_of_the_program_is_told_by_python(environment: dict[str, str]) -> None:
    probe = PROBE.replace("raise SystemExit(eval(sys.argv[1]))", "raise KeyError(sys.argv[1])")
    command = [sys.executable, "-c", probe, "lost"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "KeyError: 'lost'" in done.stderr
