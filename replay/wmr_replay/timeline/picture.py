"""Pictures of a recording without a screen, for the documentation and the tests."""

import os
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from wmr_replay.timeline.viewer import LOOPBACK, RERUN, ViewerUnavailable

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

SETTLE_S = 6.0
"""Pop-ups fade and axes come to rest within this time."""
_START_LIMIT_S, _END_LIMIT_S = 30.0, 5.0
_NO_GRAPHICS = 102
_MENU_BAR = 36
"""Height of the bar that is cut off: it shows the machine's state, not the log."""


def take_picture(rrd: Path, png: Path, width: int = 1600, height: int = 1000, at_s: float = 0.0) -> None:
    """Write a picture of ``rrd`` as the viewer shows it, the cursor ``at_s`` seconds after the log's start.

    Raises ViewerUnavailable without a Vulkan driver; a software one will do.
    """
    from PIL import Image  # noqa: PLC0415 – comes with Rerun, and only pictures need it

    with tempfile.TemporaryDirectory() as folder, _headless_viewer(Path(folder), width, height) as viewer:
        viewer.open(str(rrd.resolve()))
        viewer.set_time("log_t", duration=at_s, play_state="paused")
        time.sleep(SETTLE_S)
        taken = Path(folder, "picture.png")
        viewer.save_screenshot(str(taken))
        with Image.open(taken) as picture:
            picture.crop((0, _MENU_BAR, width, height + _MENU_BAR)).convert("RGB").save(png, optimize=True)


@contextmanager
def _headless_viewer(home: Path, width: int, height: int) -> Iterator["ViewerClient"]:
    """A viewer with settings of its own in ``home``, ended with all its processes."""
    port = _free_port()
    command = [*RERUN, "--headless", "--bind", LOOPBACK, "--port", str(port)]
    command += ["--window-size", f"{width}x{height + _MENU_BAR}", "--hide-welcome-screen"]
    environment = os.environ | {"HOME": str(home), "XDG_RUNTIME_DIR": str(home), "RUST_LOG": "error"}
    for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME"):
        environment.pop(name, None)
    log = Path(home, "viewer.log")
    with log.open("wb") as output:
        process = subprocess.Popen(
            command, env=environment, start_new_session=True, stdout=output, stderr=subprocess.STDOUT
        )
    try:
        yield _connect(process, port)
    except ConnectionError as error:
        raise ViewerUnavailable(_why_not(process, log)) from error
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
            process.wait()


def _connect(process: "subprocess.Popen[bytes]", port: int) -> "ViewerClient":
    from rerun.experimental import ViewerClient  # noqa: PLC0415 – not needed to write recordings

    deadline = time.monotonic() + _START_LIMIT_S
    while process.poll() is None and time.monotonic() < deadline:
        try:
            viewer = ViewerClient.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
            viewer.get_state()
        except (ConnectionError, RuntimeError):
            time.sleep(0.2)
        else:
            return viewer
    raise ConnectionError("no answer")


def _why_not(process: "subprocess.Popen[bytes]", log: Path) -> str:
    """Why a viewer does not answer, from its output; one without a graphics driver needs a moment to end."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(_END_LIMIT_S)
    if process.returncode == _NO_GRAPHICS:
        return "no Vulkan driver found; a software one is enough (Debian: mesa-vulkan-drivers)"
    return f"the headless viewer does not answer (exit code {process.returncode}): {log.read_text()[-500:]}"


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])
