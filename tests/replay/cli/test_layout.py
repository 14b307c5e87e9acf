"""Tables and lines at 80 and 60 columns: nothing is cut off, nothing left out; figures and bars as text."""

import json
from types import SimpleNamespace

import pytest
from rich.table import Table
from rich.text import Text

from wmr_replay.api.compare import text_table
from wmr_replay.cli.printing.gap import bar
from wmr_replay.cli.printing.layout import labelled, output_width, print_table, record_lines
from wmr_replay.cli.printing.plain import console_of
from wmr_schemas.text import figure

HEADINGS = ("log", "minutes", "ideal", "skidding+slipping", "why")
ROWS = [
    (
        "/data/fleet/2026-07-03/warehouse/drive-0001.mcap",
        "12.5",
        "99.1%",
        "–",
        "it was cut off in the middle",
    ),
    ("/data/fleet/b.mcap", "1.0", "", "12.0%", ""),
]


def printed(width, n_titles=1):
    table = Table(box=None, pad_edge=False)
    for name in HEADINGS:
        table.add_column(name, no_wrap=True)
    for row in ROWS:
        table.add_row(*row[:-1], Text(row[-1]))
    console = console_of(width=width)
    with console.capture() as capture:
        print_table(console, table, n_titles)
    return capture.get()


@pytest.mark.parametrize("width", [40, 60, 80, 118, 119, 200])
def test_every_cell_is_printed_whole_at_every_width(width):
    shown = printed(width)
    words = " ".join(shown.split())
    assert "…" not in shown
    for row in ROWS:
        assert all(" ".join(cell.split()) in words for cell in row)
    assert all(len(line) <= width or line.startswith("/data") for line in shown.splitlines())


def test_a_table_that_fits_is_a_table_and_others_name_each_cell():
    assert len(printed(200).splitlines()) == 1 + len(ROWS)
    narrow = printed(60).splitlines()
    assert narrow[:2] == ["log", ROWS[0][0]]
    assert narrow[2] == "    minutes: 12.5  ideal: 99.1%  skidding+slipping: –"
    assert narrow[-1] == "    minutes: 1.0  skidding+slipping: 12.0%"
    assert printed(60, n_titles=2).splitlines()[:2] == ["log  minutes", f"{ROWS[0][0]}  12.5"]


def test_records_wrap_long_cells_between_words():
    lines = record_lines("a", ["why", "n"], ["one two three four five six", "7"], 20)
    assert lines == ["a", "    why: one two", "    three four five", "    six  n: 7"]


def test_lines_behind_labels():
    assert labelled("note", "one two three", 10, 1000) == ["note      one two three"]
    assert labelled("note", "one two three four five", 10, 31) == [
        "note      one two three four",
        "          five",
    ]


@pytest.mark.parametrize("columns", [60, 80])
def test_the_channels_of_a_log_at_a_narrow_terminal(columns, command, tmp_path, monkeypatch):
    log = tmp_path / "drive.mcap"
    command("synth", "patrol", "--duration", 2, "--rate", 50, "--out", log)
    facts = json.loads(command("info", log, "--json").stdout)
    monkeypatch.setattr("wmr_replay.cli.printing.info.output_width", lambda: columns)
    lines = command("info", log).stdout.splitlines()
    words = " ".join(" ".join(lines).split())
    for channel in facts["channels"]:
        assert f"{channel['id']} {channel['topic']}" in words
        assert f"messages: {channel['messages']}" in words
    assert [line for line in lines if len(line) > columns and str(log) not in line] == []


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (12000, "12000"), (12345678.0, "12345678"), (12345.6, "12346"), (0.00012345, "0.0001234")],
)
def test_a_count_is_written_in_full(value, text):
    assert figure(value) == text


def test_figures_with_sign_and_tiny_ones():
    assert (figure(1234.5, sign="+"), figure(2e-9, 3), figure(float("nan"))) == ("+1234", "2e-09", "nan")
    assert figure(-66008, 3, "+") == "-66008"
    assert (figure(999.6, 3), figure(1707.3, 3), figure(99.95, 3)) == ("1000", "1707", "100")


def test_a_text_table_is_as_narrow_as_its_cells():
    lines = text_table(("summary", "a", "b"), [("n_pose", "12000", "66008"), ("alpha", "0.1", "–")])
    assert lines == ["summary      a      b", "n_pose   12000  66008", "alpha      0.1      –"]


def test_a_bar_is_read_without_colour():
    held = SimpleNamespace(before=100.0, after=40.0, floor=20.0)
    assert bar(held).plain == "████╋███░░░░░░░░░░░░"


def test_a_pipe_has_lines_of_any_length_and_a_terminal_its_own(monkeypatch):
    monkeypatch.setenv("COLUMNS", "66")
    monkeypatch.setattr("sys.stdout", SimpleNamespace(isatty=lambda: False))
    assert output_width() == 1000
    monkeypatch.setattr("sys.stdout", SimpleNamespace(isatty=lambda: True))
    assert output_width() == 66
