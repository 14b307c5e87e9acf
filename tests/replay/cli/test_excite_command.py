"""``wmr-replay excite``: files, what is printed, errors, and that nothing half-written is left."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

import wmr_replay as wr
import wmr_replay.api.excite as excite_api
from wmr_replay.cli.excite import command
from wmr_replay.gap import GapOptions
from wmr_replay.jobs.gap_document import document_of
from wmr_schemas.drive_file import read_drive
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.gap_file import gap_to_json
from wmr_schemas.model_file import Model, model_to_toml
from wmr_synth.driving.patrol import SMALL_ROBOT

ENDINGS = {"excite.toml", "excite.mcap", "excite.csv", "excite.json"}
SHORT = ("--separate", "viscous_drag,wheel_viscous", "--duration", "30")


def open_result(made_up_gap):
    """A made-up gap.json whose verdict is ambiguous."""
    result = made_up_gap.gap_result(verdict="ambiguous")
    return document_of(result, GapOptions(), "drive.mcap", "0" * 64)


def run(*options):
    return CliRunner().invoke(command, [str(o) for o in options], catch_exceptions=False)


@pytest.fixture
def robot(tmp_path):
    file = tmp_path / "robot.model.toml"
    file.write_text(model_to_toml(Model(robot=SMALL_ROBOT)))
    return file


def test_scenario_commands_and_document_say_the_same(robot, tmp_path):
    out = tmp_path / "results"
    done = run(robot, *SHORT, "--out", out)
    assert done.exit_code == 0
    assert {file.name for file in out.iterdir()} == {f"robot.{ending}" for ending in ENDINGS}
    assert "if it is" in done.stdout
    assert "wmr-replay synth" in done.stdout
    drive, columns = read_drive(out / "robot.excite.toml"), pl.read_csv(out / "robot.excite.csv")
    assert columns["t_s"][-1] == pytest.approx(drive.duration_s)
    assert np.allclose(np.interp(columns["t_s"], drive.t_s, drive.first), columns["v_long_mps"], atol=1e-6)
    slope = np.diff(columns["v_long_mps"]) / 0.01
    total = (columns["left_nm"] + columns["right_nm"]).to_numpy()[:-1]
    assert np.allclose(SMALL_ROBOT.alpha * total, slope, atol=2e-3)
    with (out / "robot.excite.mcap").open("rb") as file:
        topics = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert topics.count("/cmd_vel") == topics.count("/wheel_torques") == len(columns)
    said = json.loads((out / "robot.excite.json").read_text())
    assert said["separate"] == ["viscous_drag", "wheel_viscous"]
    assert said["duration_s"] == pytest.approx(drive.duration_s)
    lengths = [m["duration_s"] for m in said["manoeuvres"]]
    assert sum(lengths) == pytest.approx(drive.duration_s - 0.5)


def test_json_is_what_the_file_holds(robot, tmp_path):
    printed = json.loads(run(robot, *SHORT, "--out", tmp_path / "a", "--json").stdout)
    files = printed.pop("files")
    assert json.loads(Path(files["json"]).read_text()) == printed


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_nothing_half_written_is_left(robot, tmp_path, monkeypatch, failure):
    def fails(*_):
        raise failure

    monkeypatch.setattr(excite_api, "write_played", fails)
    with pytest.raises(type(failure)):
        wr.excite(robot, tmp_path / "new", separate=("viscous_drag", "wheel_viscous"), duration_s=30)
    assert not (tmp_path / "new").exists()


def test_a_result_that_left_two_effects_open_says_what_to_design(tmp_path, made_up_gap):
    document = open_result(made_up_gap)
    found = wr.excite(from_gap=document, duration_s=40)
    named, other = document.effects[0], document.effects[0].alternatives[0]
    assert found.separate == (named.name, other.name)
    file = tmp_path / "drive.gap.json"
    file.write_text(gap_to_json(document))
    assert run("--from", file, "--duration", "40").exit_code == 0
    assert (tmp_path / "drive.excite.toml").exists()
    assert wr.excite(from_gap=file, separate=("payload", "slope"), duration_s=40).separate == (
        "payload",
        "slope",
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--area", "0x3"), "is not RADIUS or LENGTHxWIDTH"),
        (("--area", "wide"), "is not RADIUS or LENGTHxWIDTH"),
        (("--duration", "0"), "duration"),
    ],
)
def test_a_mistake_in_the_call_is_a_usage_error(robot, options, said):
    done = run(robot, *SHORT, *options)
    assert done.exit_code == 2
    assert said in done.output
    assert run().exit_code == 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"separate": ("drive_gain", "wheel_radius")}, "same in any motion"),
        ({"separate": ("payload", "slope"), "inputs": "commands"}, "torques drive, not for commands"),
        ({"separate": ("payload", "slope"), "area_m": -1.0}, "area"),
    ],
)
def test_a_question_without_an_answer_is_refused(robot, options, said, tmp_path):
    with pytest.raises(InvalidSetting, match=said):
        wr.excite(robot, tmp_path / "new", **options)
    assert not (tmp_path / "new").exists()


def test_without_a_robot_or_an_open_question_it_says_what_is_missing(made_up_gap):
    with pytest.raises(InvalidSetting, match="which robot"):
        wr.excite(separate=("payload", "slope"))
    with pytest.raises(InvalidSetting, match="alpha and half_track_m"):
        wr.excite(wr.RobotParameters(alpha=0.3), separate=("payload", "slope"))
