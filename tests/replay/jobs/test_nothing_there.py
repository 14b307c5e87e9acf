"""Ranges and windows that leave nothing of a log: refused with the log's span, and no file is touched."""

import pytest

PAST_THE_END = ("--start", "100")
BEFORE_THE_START = ("--end", "-5")
SPAN = "the log spans 12"


def contents(folder) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def results(tmp_path_factory, log, command):
    """Good results of a run and of a fit in one directory."""
    folder = tmp_path_factory.mktemp("good")
    command("run", log, "--out", folder)
    command("fit", log, "--out", folder)
    return folder, contents(folder)


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (PAST_THE_END, 3, "nothing was logged from 100 to the last message"),
        (BEFORE_THE_START, 3, "nothing was logged from the first message to -5"),
        (("--start", "8", "--end", "4"), 2, "the end (4) lies before the start (8)"),
        (("--start", "2031-01-01"), 3, "nothing was logged from 2031-01-01"),
        (("--start", "99999999999999999999"), 3, "nothing was logged"),
    ],
)
@pytest.mark.parametrize("name", ["run", "gap", "fit"])
def test_a_range_that_holds_nothing_is_refused_with_the_logs_span(
    name, options, code, said, log, results, command
):
    folder, before = results
    done = command(name, log, "--out", folder, *options, code=code)
    assert said in done.stderr
    assert SPAN in done.stderr
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--window", "50"), "the poses end before a window of 50 s is full"),
        (("--start", "11.8"), "the poses end before the differentiator's window is full"),
        (("--start", "5.0001", "--end", "5.0002"), "no usable pose lies from 5.0001 to 5.0002"),
    ],
)
def test_a_window_longer_than_the_log_leaves_good_tables_alone(options, said, log, results, command):
    folder, before = results
    done = command("run", log, "--out", folder, *options, code=3)
    assert said in done.stderr
    assert SPAN in done.stderr
    assert contents(folder) == before


@pytest.mark.parametrize("instant", ["nan", "inf", "-inf", "yesterday"])
def test_what_is_no_time_is_a_usage_error(instant, log, command):
    assert "is no time" in command("info", log, "--start", instant, code=2).stderr


@pytest.mark.parametrize("name", ["info", "diff"])
def test_other_commands_refuse_the_range_too(name, log, command):
    arguments = ("diff", "--log", log) if name == "diff" else ("info", log)
    assert SPAN in command(*arguments, *PAST_THE_END, code=3).stderr


def test_a_differentiators_window_longer_than_the_log_is_refused(log, command):
    done = command("diff", "--log", log, "--window", "50", code=3)
    assert "the poses end before a window of 50 s is full" in done.stderr
    assert SPAN in done.stderr


def test_a_batch_keeps_the_tables_of_a_log_that_a_later_range_leaves_out(tmp_path, log, command):
    command("batch", log, "--out", tmp_path, "--jobs", "1")
    before = {name: data for name, data in contents(tmp_path).items() if "part.parquet" in name}
    done = command("batch", log, "--out", tmp_path, "--jobs", "1", *PAST_THE_END, code=1)
    assert SPAN in done.stdout
    assert {name: data for name, data in contents(tmp_path).items() if "part.parquet" in name} == before
