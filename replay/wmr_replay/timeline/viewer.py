"""Starts the Rerun viewer, serves recordings to browsers, and states the command that opens a recording."""

import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO
from urllib.parse import quote

from wmr_schemas.errors import WmrError

RERUN = (sys.executable, "-c", "import sys; from rerun_cli.__main__ import main; sys.exit(main())")
"""The viewer installed for this interpreter, whatever PATH says; ``-m rerun_cli`` loses the exit code."""
_ENDING_WITH_US = """\
import os, signal, sys, threading
from rerun_cli.__main__ import main
def watch():
    sys.stdin.buffer.read()
    os.killpg(0, signal.SIGTERM)
if sys.platform != "win32":
    threading.Thread(target=watch, daemon=True).start()
sys.exit(main())
"""
RERUN_WITH_US = (sys.executable, "-c", _ENDING_WITH_US)
"""The same, to be begun with a pipe: when this program ends, however it does, the pipe ends and Rerun too."""
LOOPBACK = "127.0.0.1"
EVERYWHERE = ("0.0.0.0", "::")
START_LIMIT_S = 30.0


class ViewerUnavailable(WmrError):
    """The viewer cannot be started here; the recording itself is complete."""


def viewer_command(path: Path) -> str:
    """The line that opens ``path``: ``rerun FILE``, with its folder where PATH does not lead to it."""
    installed = Path(sysconfig.get_path("scripts"), "rerun")
    found = shutil.which("rerun")
    on_path = found is not None and (not installed.exists() or Path(found).samefile(installed))
    program = "rerun" if on_path or not installed.exists() else os.path.relpath(installed)
    return shlex.join([program, str(path)])


def open_viewer(*paths: Path) -> str:
    """Start the viewer on recordings, or on an empty window, and return at once: the address at which the
    viewer listens. Raises ViewerUnavailable where there is no screen.
    """
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise ViewerUnavailable("no screen here (neither DISPLAY nor WAYLAND_DISPLAY is set)")
    port = free_port()
    command = [*RERUN, *map(str, paths), "--bind", LOOPBACK, "--port", str(port), "--detach-process"]
    if not paths:
        command += ["--expect-data-soon"]
    started = subprocess.run(command, capture_output=True, text=True, check=False)
    if started.returncode != 0:
        raise ViewerUnavailable(f"the viewer did not start: {started.stderr[-500:]}")
    if not paths and not answers(LOOPBACK, port):
        raise ViewerUnavailable("the viewer does not answer")
    return grpc_address(LOOPBACK, port)


@dataclass(frozen=True, eq=False)
class Server:
    """Recordings for browsers and viewers elsewhere. ``page`` is the address of the page that shows them,
    ``address`` that at which they are streamed, and at which further rows are taken.
    """

    page: str
    address: str
    process: "subprocess.Popen[bytes]"

    def wait(self) -> None:
        """Serve until the program is interrupted, or the server ends."""
        with suppress(KeyboardInterrupt):
            self.process.wait()
        self.stop()

    def stop(self) -> None:
        """End the server."""
        end(self.process)


def start_server(paths: Sequence[Path] = (), bind: str = LOOPBACK) -> Server:
    """Serve recordings, or what will be streamed to it, at the address ``bind``: to this machine alone unless
    told otherwise. Raises ViewerUnavailable where the server does not start.
    """
    grpc_port, web_port = free_port(bind), free_port(bind)
    command = [*RERUN_WITH_US, *map(str, paths), "--serve-web", "--bind", bind]
    command += ["--port", str(grpc_port), "--web-viewer-port", str(web_port)]
    host = socket.gethostname() if bind in EVERYWHERE else bind
    near = LOOPBACK if bind in EVERYWHERE else bind
    with tempfile.TemporaryFile() as output:
        process = begin(command, output, {"RUST_LOG": "error"})
        if not (answers(near, web_port, process) and answers(near, grpc_port, process)):
            end(process)
            output.seek(0)
            said = output.read().decode(errors="replace")[-500:]
            raise ViewerUnavailable(f"the server did not start at {bind}: {said}")
    shown = quote(grpc_address(host, grpc_port), safe="")
    return Server(f"http://{in_url(host)}:{web_port}/?url={shown}", grpc_address(near, grpc_port), process)


def begin(
    command: Sequence[str], output: IO[bytes], settings: Mapping[str, str]
) -> "subprocess.Popen[bytes]":
    """Start a program with further environment variables; in a session of its own, since Rerun's is two
    processes, of which ending the first leaves the second.
    """
    return subprocess.Popen(
        command,
        env=os.environ | settings,
        start_new_session=True,
        stdin=subprocess.PIPE,
        stdout=output,
        stderr=subprocess.STDOUT,
    )


def end(process: "subprocess.Popen[bytes]") -> None:
    """End a program that was begun, with all its processes."""
    if process.poll() is None:
        if sys.platform == "win32":
            process.terminate()
        else:
            os.killpg(process.pid, signal.SIGTERM)
    process.wait()
    if process.stdin is not None:
        process.stdin.close()


def grpc_address(host: str, port: int) -> str:
    """Where a viewer or server at a port takes and gives rows."""
    return f"rerun+http://{in_url(host)}:{port}/proxy"


def in_url(host: str) -> str:
    """A host as it stands in an address."""
    return f"[{host}]" if ":" in host else host


def free_port(bind: str = LOOPBACK) -> int:
    """A port on which nobody listens. Raises ViewerUnavailable for an address that is not this machine's."""
    try:
        family, _, _, _, place = socket.getaddrinfo(bind, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family) as probe:
            probe.bind(place)
            return int(probe.getsockname()[1])
    except OSError as error:
        raise ViewerUnavailable(f"cannot listen at {bind}: {error}") from error


def answers(host: str, port: int, process: "subprocess.Popen[bytes] | None" = None) -> bool:
    """Wait until somebody listens at a port; False after 30 s, or when ``process`` has ended."""
    deadline = time.monotonic() + START_LIMIT_S
    while time.monotonic() < deadline and (process is None or process.poll() is None):
        try:
            socket.create_connection((host, port), timeout=1.0).close()
        except OSError:
            time.sleep(0.1)
        else:
            return True
    return False
