"""Errors in one spelling, and every symbol in every encoding."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wmr_replay.cli.streams import HANDLER, prepare_streams

SOURCES = [*Path(__file__).parents[3].glob("replay/**/*.py"), *Path(__file__).parents[3].glob("s*/**/*.py")]


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "cp437", "latin-1"])
def test_every_character_of_the_sources_has_a_form_in_every_encoding(encoding):
    prepare_streams()
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        written = text.encode(encoding, HANDLER)
        assert written.count(b"\\u") == text.count("\\u"), path


@pytest.mark.parametrize(
    ("text", "ascii_text"),
    [("● α ± 3 m/s²", "* alpha +/- 3 m/s^2"), ("größer…", "grosser..."), ("中", "\\u4e2d"), ("━━╋", "==|")],
)
def test_symbols_in_ascii(text, ascii_text):
    prepare_streams()
    assert text.encode("ascii", HANDLER).decode() == ascii_text.replace("grosser", "gro\\xdfer")


def wmr(*arguments, encoding="utf-8", **options):
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    call = [sys.executable, "-m", "wmr_replay", *map(str, arguments)]
    return subprocess.run(call, env=environment, capture_output=True, check=False, **options)


def test_a_terminal_without_utf_8_gets_text_and_json(tmp_path):
    shown = wmr("synth", "--list-effects", encoding="ascii")
    assert (shown.returncode, shown.stderr) == (0, b"")
    assert shown.stdout.isascii()
    help_page = wmr("gap", "--help", encoding="ascii").stdout
    assert help_page.isascii()
    assert b"VERDICT,..." in help_page
    parsed = wmr("synth", "--list-effects", "--json", encoding="ascii")
    assert json.loads(parsed.stdout) == json.loads(wmr("synth", "--list-effects", "--json").stdout)


def test_a_reader_that_leaves_is_no_error(tmp_path):
    call = f"set -o pipefail; {sys.executable} -m wmr_replay synth --list-effects --json | true"
    done = subprocess.run(["bash", "-c", call], capture_output=True, check=False)
    assert done.stderr == b""
    assert done.returncode in {0, 141}  # 0 where the text fits into the pipe before its reader has gone


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rnu"], "error: no command 'rnu'; did you mean run?"),
        (["run"], "error: missing argument 'LOG'"),
        (["run", "x.mcap", "--degree", "two"], "error: invalid value for '--degree'"),
        (["run", "x.mcap", "--wndow", "2"], "error: no such option"),
        (["gap", "x.mcap", "--tolerance", "3"], "error: invalid value for --tolerance"),
    ],
)
def test_errors_are_spelled_alike(command_line, arguments, said):
    done = command_line(*arguments)
    assert (done.code, done.stdout) == (2, "")
    assert done.stderr.startswith(said)


def test_a_bare_call_shows_the_help(command_line):
    done = command_line()
    assert done.code == 2
    assert done.stderr.startswith("Usage: wmr-replay")


def test_a_folder_that_cannot_be_written_is_a_sentence(command_line, tmp_path):
    (tmp_path / "file").write_text("")
    log = tmp_path / "drive.mcap"
    command_line("synth", "patrol", "--duration", 3, "--rate", 50, "--out", log)
    for arguments in (
        ("run", log, "--out", tmp_path / "file" / "out"),
        ("batch", log, "--out", tmp_path / "file" / "out", "--jobs", 1),
        ("check", tmp_path / "file" / "refs", log, "--update"),
        ("compare", log, "--set-b", "identifier=paper", "--out", tmp_path / "file" / "out"),
        ("synth", "patrol", "--out", tmp_path / "file" / "x.mcap"),
        ("info", log, "--write-map", tmp_path / "file" / "x.toml"),
    ):
        done = command_line(*arguments)
        assert done.code == 2, (arguments, done)
        assert done.stderr.startswith("error: "), arguments
        assert str(tmp_path / "file") in done.stderr
        assert "internal" not in done.stderr
