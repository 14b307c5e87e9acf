"""Options from files: which stands above which, what is refused, and a result's own settings as a file."""

import json

import polars as pl
import pytest
from click.testing import CliRunner

from wmr_replay.cli import info
from wmr_replay.cli.config.files import project_file
from wmr_schemas.mapping_file import read_mapping


@pytest.fixture(scope="module")
def log(tmp_path_factory, command):
    path = tmp_path_factory.mktemp("logs") / "drive.mcap"
    command("synth", "patrol", "--duration", 6, "--rate", 50, "--out", path)
    return path


@pytest.fixture
def settings(command, log, tmp_path, monkeypatch):
    """``settings(*options)``: what a run in an empty folder with these options states as its settings."""
    monkeypatch.chdir(tmp_path)

    def of(*options):
        done = command("run", log, "--no-rrd", "--no-hindsight", "--json", *options)
        found = json.loads(done.stdout)["settings"]
        assert found == json.loads((tmp_path / "drive.wmr/drive.summary.json").read_text())["settings"]
        return found

    return of


def test_the_command_line_stands_above_config_above_the_project_above_the_default(settings, tmp_path):
    (tmp_path / "wmr-replay.toml").write_text(
        'identifier = "paper"\nthreshold-sd = 4\nmin_confidence = 0.6\nmax_hold_s = 0.5\ntolerance = "5:4"\n'
    )
    (tmp_path / "mine.toml").write_text("threshold-sd = 5\n[run]\nmin-confidence = 0.7\n[gap]\nseed = 3\n")
    found = settings("--config", tmp_path / "mine.toml", "--min-confidence", 0.8)
    names = ("identifier", "threshold_sd", "min_confidence", "max_hold_s", "theta")
    assert [found[name] for name in names] == ["paper", 5, 0.8, 0.5, 0]


def test_the_project_is_found_upward_and_the_nearest_counts(tmp_path):
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text("[tool.wmr-replay]\nlag = 2\n")
    (tmp_path / "a" / "pyproject.toml").write_text("[project]\nname = 'x'\n[broken\n")
    assert project_file(inner).path == tmp_path / "pyproject.toml"
    assert project_file(inner).content == {"lag": 2}
    (tmp_path / "a" / "wmr-replay.toml").write_text("lag = 3\n")
    assert project_file(inner).content == {"lag": 3}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("windwo = 3", "windwo: there is no such option; did you mean window"),
        ("[run]\ntolerance = '3:4'", "run.tolerance: there is no such option"),
        ("[rnu]\nwindow = 1", "rnu: there is no such option"),
        ("[run]\nwindow = 'a'", "run.window: 'a' is not a valid float"),
        ("window = true", "window: must be a value"),
        ("no-rrd = 1", "no-rrd: must be true or false"),
        ("identifier = 'bnak'", "identifier: 'bnak' is not one of"),
        ("max_hold_s = 'a'", "max_hold_s: expected a finite number"),
        ("window = [1]", "window: must be one value"),
        ("map = 'there_is_none.toml'", "map: File '"),
        ("window = ", "is not TOML"),
    ],
)
def test_a_mistake_in_a_file_is_an_error_that_names_file_and_key(command_line, log, tmp_path, text, said):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    done = command_line("run", log, "--out", tmp_path / "out", "--config", path)
    assert done.code == 2
    assert f"error: {path}: {said}" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_path_in_a_file_is_one_beside_it(settings, tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "far" / "robot.toml").write_text("[robot]\nalpha = 0.5\n")
    (tmp_path / "far" / "mine.toml").write_text("map = 'robot.toml'\n")
    assert settings("--config", tmp_path / "far" / "mine.toml")["robot"]["alpha"] == 0.5


def test_a_result_repeats_its_call(settings, tmp_path, log):
    (tmp_path / "robot.toml").write_text("[robot]\nalpha = 0.5\n")
    options = ["--map", tmp_path / "robot.toml", "--pose", "/pose", "--window", 0.3, "--simultaneous"]
    first = settings(*options, "--start", 1, "--identifier", "paper")
    kept = tmp_path / "kept.summary.json"
    (tmp_path / "drive.wmr/drive.summary.json").rename(kept)
    (tmp_path / "robot.toml").unlink()
    (tmp_path / "wmr-replay.toml").write_text("min-sideslip = 0.1\nend = 3\nmax_hold_s = 0.5\n")
    assert settings("--config", kept) == first
    (tmp_path / "stored.toml").write_text(first["given"]["mapping"])
    assert read_mapping(tmp_path / "stored.toml").pose_topic == "/pose"
    other = settings("--config", kept, "--identifier", "bank")
    assert (other["identifier"], other["window_s"]) == ("bank", 0.3)


def test_what_is_no_result_is_refused(command_line, log, tmp_path):
    path = tmp_path / "drive.truth.json"
    path.write_text("{}")
    done = command_line("run", log, "--out", tmp_path / "out", "--config", path)
    assert done.code == 2
    assert "settings: is missing" in done.stderr


def test_a_default_kernel_that_is_asked_for_is_not_tuned_away(settings, tmp_path):
    assert settings()["tune"] is True
    assert settings("--degree", 2)["tune"] is False
    assert settings("--degree", 2, "--tune")["tune"] is True
    (tmp_path / "wmr-replay.toml").write_text("tune = true\n")
    assert settings("--degree", 2)["tune"] is False
    assert settings()["tune"] is True


def test_quiet_says_nothing_but_errors_and_json(command, command_line, log, tmp_path):
    assert command("run", log, "--no-rrd", "--out", tmp_path, "--quiet") == (0, "", "")
    assert json.loads(command("info", log, "--json", "-q").stdout)["log"] == str(log)
    done = command_line("info", tmp_path / "none.mcap", "-q")
    assert (done.code, done.stdout) == (3, "")
    assert done.stderr.startswith("error: ")


def test_after_a_quiet_call_what_comes_next_in_the_process_is_heard(command_line, log, tmp_path):
    assert command_line("info", tmp_path / "none.mcap", "-q").code == 3
    said = CliRunner().invoke(info.command, [str(log)], catch_exceptions=False).output
    assert said.startswith(str(log))


def test_verbose_names_the_files_that_options_come_from(command, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wmr-replay.toml").write_text("lag = 3\n")
    (tmp_path / "mine.toml").write_text("lag = 2\n")
    said = command("info", log, "--verbose", "--config", "mine.toml").stderr
    assert said.splitlines()[:2] == [f"options from {tmp_path / 'wmr-replay.toml'}", "options from mine.toml"]


def test_a_check_holds_a_log_to_its_reference_and_not_to_the_project(command, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wmr-replay.toml").write_text('identifier = "paper"\n')
    command("check", "refs", log, "--update")
    (stored,) = pl.read_parquet("refs/drive.summary.parquet")["settings"].to_list()
    assert json.loads(stored)["identifier"] == "paper"
    (tmp_path / "wmr-replay.toml").write_text('identifier = "algebraic"\n')
    assert command("check", "refs", log).code == 0
