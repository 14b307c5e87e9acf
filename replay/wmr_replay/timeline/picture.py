"""Pictures of a recording without a screen, for the documentation, the command line and the tests."""

import io
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wmr_replay.timeline.viewer import LOOPBACK, RERUN_WITH_US, ViewerUnavailable, begin, end, free_port
from wmr_schemas.files import whole_file

if TYPE_CHECKING:
    from PIL.Image import Image
    from rerun.experimental import ViewerClient

WIDTH, HEIGHT = 1600, 1000
_LEAST_S, _MOST_S, _STEP_S = 2.5, 20.0, 0.4
"""Pop-ups fade after some time; axes are at rest when two pictures in a row are alike."""
_START_LIMIT_S, _END_LIMIT_S = 30.0, 5.0
_NO_GRAPHICS = (102, -signal.SIGABRT)
_MENU_BAR = 36
"""Height of the bar that is cut off: it shows the machine's state, not the log."""


def take_picture(rrd: Path, png: Path, width: int = WIDTH, height: int = HEIGHT, at_s: float = 0.0) -> None:
    """Write a picture of ``rrd`` as the viewer shows it, the cursor ``at_s`` seconds after the log's start.

    It is taken when the axes have come to rest. Raises ViewerUnavailable without a Vulkan driver; a software
    one will do.
    """
    with headless_viewer(width, height) as viewer:
        viewer.open(str(rrd.resolve()))
        viewer.set_time("log_t", duration=at_s, play_state="paused")
        picture = settled(viewer)
    with whole_file(png) as part:
        picture.save(part, format="PNG", optimize=True)


def settled(viewer: "ViewerClient") -> "Image":
    """A picture of the viewer's window without its menu, once it no longer changes."""
    began, before = time.monotonic(), _shot(viewer)
    while time.monotonic() - began < _MOST_S:
        time.sleep(_STEP_S)
        now = _shot(viewer)
        if time.monotonic() - began > _LEAST_S and np.array_equal(np.asarray(before), np.asarray(now)):
            break
        before = now
    return before


def _shot(viewer: "ViewerClient") -> "Image":
    from PIL import Image  # noqa: PLC0415 – comes with Rerun, and only pictures need it

    with Image.open(io.BytesIO(viewer.take_screenshot())) as shot:
        return shot.crop((0, _MENU_BAR, *shot.size)).convert("RGB")


@contextmanager
def headless_viewer(width: int = WIDTH, height: int = HEIGHT) -> Iterator["ViewerClient"]:
    """A viewer without a screen and with settings of its own, ended with all its processes.

    Raises ViewerUnavailable where it does not start.
    """
    with tempfile.TemporaryDirectory() as folder:
        home, port = Path(folder), free_port()
        log = home / "viewer.log"
        process = _start(home, log, port, width, height)
        try:
            yield _connected(process, port, log)
        finally:
            end(process)


def _start(home: Path, log: Path, port: int, width: int, height: int) -> "subprocess.Popen[bytes]":
    command = [*RERUN_WITH_US, "--headless", "--bind", LOOPBACK, "--port", str(port)]
    command += ["--window-size", f"{width}x{height + _MENU_BAR}", "--hide-welcome-screen"]
    settings = {"HOME": str(home), "XDG_RUNTIME_DIR": str(home), "RUST_LOG": "error"}
    settings |= {"XDG_CONFIG_HOME": str(home), "XDG_DATA_HOME": str(home)}
    with log.open("wb") as output:
        return begin(command, output, settings)


def _connected(process: "subprocess.Popen[bytes]", port: int, log: Path) -> "ViewerClient":
    """A client, once the viewer answers."""
    from rerun.experimental import ViewerClient  # noqa: PLC0415 – not needed to write recordings

    deadline = time.monotonic() + _START_LIMIT_S
    while process.poll() is None and time.monotonic() < deadline:
        try:
            viewer = ViewerClient.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
            viewer.take_screenshot()  # a viewer without graphics answers, and ends at its first picture
        except (ConnectionError, RuntimeError):
            time.sleep(0.2)
        else:
            return viewer
    raise ViewerUnavailable(_why_not(process, log))


def _why_not(process: "subprocess.Popen[bytes]", log: Path) -> str:
    """Why a viewer does not answer, from its output; one without a graphics driver needs a moment to end."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(_END_LIMIT_S)
    if process.returncode in _NO_GRAPHICS:
        return "no Vulkan driver that works; a software one is enough (Debian: mesa-vulkan-drivers)"
    return f"the headless viewer does not answer (exit code {process.returncode}): {log.read_text()[-500:]}"
