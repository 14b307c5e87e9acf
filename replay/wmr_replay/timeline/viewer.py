"""Starts the Rerun viewer, and states the command that opens a recording."""

import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from wmr_schemas.errors import WmrError

RERUN = (sys.executable, "-c", "import sys; from rerun_cli.__main__ import main; sys.exit(main())")
"""The viewer installed for this interpreter, whatever PATH says; ``-m rerun_cli`` loses the exit code."""
LOOPBACK = "127.0.0.1"


class ViewerUnavailable(WmrError):
    """The viewer cannot be started here; the recording itself is complete."""


def viewer_command(path: Path) -> str:
    """The line that opens ``path``: ``rerun FILE``, with its folder where PATH does not lead to it."""
    installed = Path(sysconfig.get_path("scripts"), "rerun")
    found = shutil.which("rerun")
    on_path = found is not None and (not installed.exists() or Path(found).samefile(installed))
    program = "rerun" if on_path or not installed.exists() else os.path.relpath(installed)
    return shlex.join([program, str(path)])


def open_viewer(path: Path) -> None:
    """Start the viewer on ``path`` and return at once. Raises ViewerUnavailable where there is no screen."""
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise ViewerUnavailable("no screen here (neither DISPLAY nor WAYLAND_DISPLAY is set)")
    command = [*RERUN, str(path), "--bind", LOOPBACK, "--port", "auto", "--detach-process"]
    started = subprocess.run(command, capture_output=True, text=True, check=False)
    if started.returncode != 0:
        raise ViewerUnavailable(f"the viewer did not start: {started.stderr[-500:]}")
