"""Errors carry facts, and their text states them."""

from pathlib import Path

import pytest

from wmr_schemas import errors


def test_an_invalid_signal_names_the_row_where_one_is_at_fault() -> None:
    assert str(errors.InvalidSignal("pose", "empty")) == "pose: empty"
    assert str(errors.InvalidSignal("pose", "x_m is nan", 0)) == "pose: x_m is nan at row 0"


def test_an_invalid_file_names_path_and_key() -> None:
    error = errors.InvalidFile(Path("a.toml"), "[robot] alpha", "is odd")
    assert (error.path, error.key, error.problem) == ("a.toml", "[robot] alpha", "is odd")
    assert str(error) == "a.toml: [robot] alpha: is odd"
    assert str(errors.InvalidFile("a.toml", "", "is empty")) == "a.toml: is empty"


def test_an_unusable_log_says_what_to_try() -> None:
    error = errors.LogUnusable("a.mcap", "is empty", "record again")
    assert (error.path, error.problem, error.advice) == ("a.mcap", "is empty", "record again")
    assert str(error) == "a.mcap: is empty\nrecord again"
    assert str(errors.LogUnusable("a.mcap", "is empty")) == "a.mcap: is empty"


def test_a_missing_channel_says_what_was_looked_for_what_is_there_and_what_to_try() -> None:
    error = errors.ChannelNotFound("pose", "a.mcap", [("/cmd_vel", "Twist", "a command")], "use --map")
    assert (error.wanted, error.available) == ("pose", (("/cmd_vel", "Twist", "a command"),))
    assert str(error) == "a.mcap: no pose found; the file holds:\n  /cmd_vel (Twist): a command\nuse --map"


def test_a_missing_channel_of_an_empty_file_says_so() -> None:
    assert (
        str(errors.ChannelNotFound("pose", "a.mcap", []))
        == "a.mcap: no pose found; the file holds no channel at all"
    )


@pytest.mark.parametrize("name", ["InvalidSignal", "InvalidFile", "LogUnusable", "InvalidSetting"])
def test_everything_raised_on_purpose_has_one_root(name: str) -> None:
    assert issubclass(getattr(errors, name), errors.WmrError)


@pytest.mark.parametrize("name", ["ChannelNotFound", "DamagedLog"])
def test_what_makes_a_log_unusable_is_caught_as_one(name: str) -> None:
    assert issubclass(getattr(errors, name), errors.LogUnusable)
