"""--view, --serve and --screenshot: what they need, and that a server is for this machine alone."""

import socket
import subprocess
import sys
import time
import urllib.request

import pytest

from wmr_replay.api.viewer import screenshot, serve
from wmr_replay.cli.options.viewing import Viewing
from wmr_replay.timeline import viewer
from wmr_replay.timeline.viewer import ViewerUnavailable
from wmr_schemas.errors import InvalidSetting

ASKED = {"view": False, "serve": False, "bind": "127.0.0.1", "screenshot": None}


@pytest.mark.parametrize("option", ["--view", "--serve", "--screenshot=a.png"])
@pytest.mark.parametrize(
    "arguments", [("run", "{log}"), ("gap", "{log}"), ("compare", "{log}", "--set-b", "tune=false")]
)
def test_without_a_timeline_there_is_nothing_to_show(command, log, tmp_path, arguments, option):
    given = [text.format(log=log) for text in arguments]
    done = command(*given, "--out", tmp_path / "out", "--no-rrd", option, code=2)
    assert f"{option.partition('=')[0]} needs the timeline that --no-rrd leaves out" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux says so beforehand")
def test_without_a_screen_the_results_are_written_and_a_warning_says_why(command, log, tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    done = command("run", log, "--out", tmp_path, "--view")
    assert done.stderr.count("warning: no screen here") >= 1
    assert (tmp_path / "drive.rrd").stat().st_size > 10_000


def test_a_server_shows_a_page_to_this_machine_alone(tmp_path):
    (tmp_path / "a.rrd").touch()
    server = serve(tmp_path / "a.rrd")
    try:
        address, _, shown = server.page.partition("/?url=")
        with urllib.request.urlopen(address, timeout=10) as page:
            assert b"rerun" in page.read().lower()
        assert shown.startswith("rerun%2Bhttp%3A%2F%2F127.0.0.1%3A")
        for port in (int(address.rpartition(":")[2]), int(server.address.split(":")[2].partition("/")[0])):
            assert listening_at(port) == {"127.0.0.1"}
    finally:
        server.stop()
    with pytest.raises(OSError, match=r"refused|reset"):
        urllib.request.urlopen(address, timeout=10)


@pytest.mark.skipif(sys.platform == "win32", reason="processes end otherwise there")
def test_a_server_ends_with_the_program_that_was_killed():
    code = "import time, wmr_replay as wr; print(wr.serve().page, flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as program:
        port = int(program.stdout.readline().partition("/?url=")[0].rpartition(":")[2])
        assert listening_at(port)
        program.kill()
    deadline = time.monotonic() + 10
    while listening_at(port) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not listening_at(port)


def listening_at(port):
    """The addresses at which somebody listens to a port, out of those that are tried."""
    found = set()
    for place in ("127.0.0.1", "127.0.0.2", own_address()):
        with socket.socket() as probe:
            probe.settimeout(1.0)
            if probe.connect_ex((place, port)) == 0:
                found.add(place)
    return found


def own_address():
    """This machine's address in its network, else another one of loopback."""
    try:
        return socket.gethostbyname(socket.gethostname())
    except OSError:
        return "127.0.0.3"


def test_a_server_that_cannot_start_is_a_warning(capsys):
    viewing = Viewing.of({**ASKED, "serve": True, "bind": "192.0.2.1"}, no_rrd=False)
    assert viewing.live() is None
    viewing.show()
    assert "cannot listen at 192.0.2.1" in capsys.readouterr().err


def test_rows_go_to_the_server_and_a_viewer_opens_on_the_finished_file(monkeypatch, tmp_path):
    """With both a server and a viewer asked for, rows are streamed to one of them."""
    opened = []

    class Server:
        page, address = "http://127.0.0.1:1", "rerun+http://127.0.0.1:2/proxy"

        def wait(self):
            opened.append("waited")

        def stop(self):
            pass

    monkeypatch.setattr("wmr_replay.api.viewer.start_server", lambda *_: Server())
    monkeypatch.setattr("wmr_replay.api.viewer.open_viewer", lambda *paths: opened.append(paths))
    (tmp_path / "a.rrd").touch()
    viewing = Viewing.of({**ASKED, "serve": True, "view": True}, no_rrd=False)
    assert viewing.live() == Server.address
    viewing.show(tmp_path / "a.rrd")
    assert opened == [(tmp_path / "a.rrd",), "waited"]


def test_a_viewer_that_took_the_rows_is_not_opened_again(monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr("wmr_replay.api.viewer.open_viewer", lambda *paths: opened.append(paths) or "address")
    viewing = Viewing.of({**ASKED, "view": True}, no_rrd=False)
    assert viewing.live() == "address"
    viewing.show(tmp_path / "a.rrd")
    assert opened == [()]
    assert Viewing.of(ASKED, no_rrd=True).live is None


def test_a_recording_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidSetting, match=r"no recording at .*a\.rrd"):
        screenshot(tmp_path / "a.rrd", tmp_path / "a.png")


def test_a_server_that_ends_at_once_says_why(monkeypatch):
    code = "import sys; sys.exit('no such thing')"
    monkeypatch.setattr(viewer, "RERUN_WITH_US", (sys.executable, "-c", code))
    with pytest.raises(ViewerUnavailable, match="no such thing"):
        serve()


def test_quiet_still_says_where_the_server_is_and_why_there_is_none(command, log, tmp_path, monkeypatch):
    """The address is what was asked for. Nothing else is said."""

    class Server:
        page, address = "http://127.0.0.1:1/?url=x", "rerun+http://127.0.0.1:2/proxy"

        def wait(self):
            pass

        stop = wait

    def serve(*_, bind):
        if bind == "192.0.2.1":
            raise ViewerUnavailable("cannot listen at 192.0.2.1")
        return Server()

    monkeypatch.setattr("wmr_replay.api.viewer.serve", serve)
    call = ("compare", log, "--set-b", "window_s=.5", "--out", tmp_path, "--serve", "--quiet")
    assert command(*call) == (0, "", f"viewer at {Server.page}\n")
    assert command(*call, "--bind", "192.0.2.1") == (0, "", "warning: cannot listen at 192.0.2.1\n")
