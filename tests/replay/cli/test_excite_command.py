"""``wmr-replay excite``: files, what is printed, errors, and that nothing half-written is left."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

import wmr_replay as wr
import wmr_replay.api.excite as excite_api
from wmr_replay.cli.excite import command
from wmr_replay.excite import Bounds
from wmr_replay.excite.bounds import Area
from wmr_replay.gap import GapOptions
from wmr_replay.jobs.gap_document import document_of
from wmr_schemas.drive_file import read_drive
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.gap_file import gap_to_json
from wmr_schemas.model_file import Effect, Model, model_to_toml
from wmr_synth.driving.patrol import SMALL_ROBOT

SMALL = Model(robot=SMALL_ROBOT)
ENDINGS = {"excite.toml", "excite.mcap", "excite.csv", "excite.json"}
SHORT = ("--separate", "viscous_drag,wheel_viscous", "--duration", "30")


def open_result(made_up_gap):
    """A made-up gap.json whose verdict is ambiguous."""
    result = made_up_gap.gap_result(verdict="ambiguous")
    return document_of(result, GapOptions(), "drive.mcap", "0" * 64)


def run(*options):
    return CliRunner().invoke(command, [str(o) for o in options], catch_exceptions=False)


@pytest.fixture(scope="module")
def found():
    """An answer, made once."""
    return wr.excite(SMALL, separate=("payload", "drive_gain"), duration_s=30, area_m=2.0)


@pytest.fixture
def made_once(found, monkeypatch):
    """The design is that of ``found``, whatever is asked; the questions are kept."""
    asked = []

    def design(question, bounds, duration_s):
        asked.append((question, bounds, duration_s))
        return found._design

    monkeypatch.setattr(excite_api, "design", design)
    return asked


@pytest.fixture
def robot(tmp_path):
    file = tmp_path / "robot.model.toml"
    file.write_text(model_to_toml(SMALL))
    return file


def test_scenario_commands_and_document_say_the_same(robot, tmp_path, made_once):
    out = tmp_path / "results"
    done = run(robot, *SHORT, "--out", out, "--area", "6x4", "--max-torque", "3", "--no-reverse")
    assert done.exit_code == 0
    question, bounds, seconds = made_once[0]
    assert question.names == ("viscous_drag", "wheel_viscous")
    assert bounds == Bounds(1.5, 1.5, 3.0, Area(box_m=(6.0, 4.0)), False)
    assert seconds == 30.0
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


def test_json_is_what_the_file_holds(robot, tmp_path, made_once):
    printed = json.loads(run(robot, *SHORT, "--out", tmp_path / "a", "--json").stdout)
    files = printed.pop("files")
    assert json.loads(Path(files["json"]).read_text()) == printed


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_nothing_half_written_is_left(found, tmp_path, monkeypatch, failure):
    def fails(*_):
        raise failure

    old = found.save(tmp_path / "old")
    before = {file: file.read_bytes() for file in old.values()}
    monkeypatch.setattr(excite_api, "write_played", fails)
    for place in ("new", "old"):
        with pytest.raises(type(failure)):
            found.save(tmp_path / place)
    assert not (tmp_path / "new").exists()
    assert {file: file.read_bytes() for file in (tmp_path / "old").iterdir()} == before


def test_a_result_that_left_two_effects_open_says_what_to_design(tmp_path, made_up_gap, made_once):
    document = open_result(made_up_gap)
    wr.excite(from_gap=document)
    question = made_once[-1][0]
    assert question.names == ("viscous_drag", "rolling_resistance")
    assert question.sizes == {"viscous_drag": {"c1_per_s": 0.203}}
    assert question.extension.effects == {}
    assert question.extension.known == ()
    assert question.pose_sd == (0.001, 0.001, 0.002)
    file = tmp_path / "drive.gap.json"
    file.write_text(gap_to_json(document))
    assert run("--from", file).exit_code == 0
    assert (tmp_path / "drive.excite.toml").exists()
    wr.excite(from_gap=file, separate=("payload", "slope"))
    assert made_once[-1][0].names == ("payload", "slope")


def test_a_poorly_excited_log_asks_for_what_was_held_back_and_any_of_the_library(made_up_gap, made_once):
    result = made_up_gap.gap_result(verdict="not_enough_excitation", effects=())
    wr.excite(from_gap=document_of(result, GapOptions(), "drive.mcap", "0" * 64))
    question = made_once[-1][0]
    assert question.names == ("viscous_drag", "rolling_resistance")
    assert question.library


def test_what_the_base_model_has_already_stays_in_it(made_up_gap, made_once):
    result = made_up_gap.gap_result(verdict="ambiguous")
    had = (
        Effect("viscous_drag", {"c1_per_s": 0.1 + 0.203}),
        Effect("slope", {"grade_x_mps2": 0.1, "grade_y_mps2": 0.0}),
    )
    result = replace(
        result, model=replace(result.model, effects=had), unnameable=("payload", "drive_gain", "yaw_inertia")
    )
    wr.excite(from_gap=document_of(result, GapOptions(), "drive.mcap", "0" * 64))
    question = made_once[-1][0]
    (drag, left), (slope, _) = question.extension.known
    assert (drag, slope) == ("viscous_drag", "slope")
    assert left["c1_per_s"] == pytest.approx(0.1)
    assert question.nuisance == ("payload", "yaw_inertia")


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


def test_a_verdict_that_leaves_nothing_open_says_so(made_up_gap):
    named = document_of(made_up_gap.gap_result(), GapOptions(), "drive.mcap", "0" * 64)
    with pytest.raises(InvalidSetting, match=r"nothing is left open.*--separate"):
        wr.excite(from_gap=named)
    rolling = document_of(
        made_up_gap.gap_result(base_model="wheel_speed"), GapOptions(), "drive.mcap", "0" * 64
    )
    with pytest.raises(InvalidSetting, match="on wheel speeds"):
        wr.excite(from_gap=rolling)


def test_without_a_robot_it_says_what_is_missing():
    with pytest.raises(InvalidSetting, match="which robot"):
        wr.excite(separate=("payload", "slope"))
    with pytest.raises(InvalidSetting, match="alpha and half_track_m"):
        wr.excite(wr.RobotParameters(alpha=0.3), separate=("payload", "slope"))
