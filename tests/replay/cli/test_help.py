"""The help pages: every option in its group, an example in every command, no line wider than the terminal."""

import importlib

import click
import pytest
from click.testing import CliRunner

from wmr_replay.cli import cli
from wmr_replay.cli.commands import COMMANDS
from wmr_replay.cli.options.groups import GROUPS

LISTED = {option for options in GROUPS.values() for option in options}


@pytest.fixture
def page(monkeypatch, capsys):
    """``page(command, columns)``: the lines of its help."""

    def shown(name, columns=80):
        monkeypatch.setenv("COLUMNS", str(columns))
        cli.main([name, "--help"], prog_name="wmr-replay", standalone_mode=False)
        return capsys.readouterr().out.splitlines()

    return shown


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_a_group(name):
    command = importlib.import_module(f"wmr_replay.cli.{name}").command
    own = {option for options in command.groups.values() for option in options}
    for param in command.params:
        if isinstance(param, click.Option):
            assert set(param.opts) & (LISTED | own), param.opts


@pytest.mark.parametrize("columns", [60, 80, 100])
@pytest.mark.parametrize("name", COMMANDS)
def test_no_line_but_an_example_is_wider_than_the_terminal(name, columns, page):
    lines = page(name, columns)
    wide = [line for line in lines if len(line) > columns and not line.startswith("    wmr-replay ")]
    assert wide == []
    assert any(line.startswith(f"    wmr-replay {name}") for line in lines)


def test_a_wide_terminal_is_used_up_to_a_hundred_columns(page):
    assert 90 < max(map(len, page("run", 300))) <= 110
    assert len(page("run", 300)) < len(page("run", 80))


def test_groups_follow_their_order_and_texts_start_in_one_column(page):
    lines = page("run", 100)
    headings = [line.rstrip(":") for line in lines if line in {f"{name}:" for name in GROUPS}]
    assert headings == list(GROUPS)
    (out,) = (line for line in lines if line.startswith("  --out"))
    (pose,) = (line for line in lines if line.startswith("  --truth"))
    assert out.index("Results") == pose.index("Topic of")


def test_an_own_group_takes_an_option_from_the_common_one(page):
    lines = page("synth")
    assert lines.index("Sensors:") < next(i for i, x in enumerate(lines) if "--clock-offset" in x)
    assert sum("--clock-offset" in line for line in lines) == 1


def test_a_former_name_still_works_and_is_not_listed():
    listed = CliRunner().invoke(cli, ["--help"]).stdout
    assert "  design " in listed
    assert "  diff " not in listed
    assert CliRunner().invoke(cli, ["diff", "--window", "0.5", "--json"]).exit_code == 0
