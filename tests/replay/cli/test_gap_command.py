"""``wmr-replay gap`` and ``wmr-replay fit``: files, exit codes, and that no side file is read."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest.mock import ANY

import msgspec
import numpy as np
import polars as pl
import pytest

import wmr_replay.jobs.gap as gap_command
import wmr_replay.timeline.gap.writer as gap_writer
from wmr_replay import cli
from wmr_replay.cli.compiling import LINE
from wmr_replay.cli.printing.gap import thousandths
from wmr_replay.gap.result.result import SlipGap
from wmr_replay.jobs.base_model import base_for
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.gap_file import read_gap
from wmr_schemas.model_file import Effect, Model, Provenance, model_to_toml, read_model
from wmr_schemas.signals import Log
from wmr_synth import record, synthesise, write_mcap
from wmr_synth.driving.patrol import SMALL_ROBOT

BINARY = Path(sys.executable).with_name("wmr-replay")
FILES = {"drive.gap.json", "drive.gap.rrd", "drive.gap_traces.parquet", "drive.model.toml"}


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A short log without a mode channel; its side files are gone before anything else happens."""
    path = tmp_path_factory.mktemp("log") / "drive.mcap"
    written = record(synthesise("patrol", seed=2, duration_s=6.0), path, mode_topic=False)
    for side_file in written[1:]:
        side_file.unlink()
    assert [file.name for file in path.parent.iterdir()] == ["drive.mcap"]
    return path


@pytest.fixture
def analysed(monkeypatch, made_up_gap):
    """The analysis replaced by one that keeps what it was given and answers at once."""
    seen = {"result": made_up_gap.gap_result()}

    def analyse(log, base, options, progress):
        seen.update(log=log, base=base, options=options)
        return replace(seen["result"], modes=options.modes, seed=options.seed)

    monkeypatch.setattr(gap_command, "analyse", analyse)
    monkeypatch.setattr(gap_command, "checked_findings", lambda *_: ())
    monkeypatch.setattr(gap_command, "calibrate", lambda *given: analyse(*given, None).model)
    return seen


@pytest.fixture
def run(monkeypatch, tmp_path, capsys):
    """``run(*arguments) -> (exit code, stdout, stderr)`` in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["wmr-replay", *map(str, arguments)])
        try:
            cli.main()
            code = 0
        except SystemExit as done:
            code = done.code or 0
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


def names(folder):
    return {path.name for path in folder.iterdir()} if folder.exists() else set()


def test_all_files_are_written_and_the_verdict_is_said(run, log, analysed, tmp_path):
    code, out, err = run("gap", log)
    assert (code, err.replace(f"{LINE}\n", "")) == (0, "")
    assert names(tmp_path / "drive.wmr") == FILES
    assert "viscous_drag" in out
    assert "● named The base model lacks viscous_drag" in out
    assert "24 mm     5.2 mm" in out
    assert max(map(len, out.splitlines())) <= 100 + len(str(log))
    found = read_gap(tmp_path / "drive.wmr" / "drive.gap.json")
    assert found.verdict == "named"
    assert found.log == str(log)


def test_the_extended_model_says_where_it_came_from(run, log, analysed, tmp_path):
    run("gap", log, "--out", "here", "--seed", "3")
    model = read_model(tmp_path / "here" / "drive.model.toml")
    assert model.effects == analysed["result"].model.effects
    assert model.provenance.command == f"wmr-replay gap {log} --out here --seed 3"
    assert model.provenance.log_sha256 == read_gap(tmp_path / "here" / "drive.gap.json").log_sha256
    assert analysed["options"].seed == 3


def test_json_is_the_file(run, log, analysed, tmp_path):
    _, out, _ = run("gap", log, "--json", "--no-rrd")
    assert out == (tmp_path / "drive.wmr" / "drive.gap.json").read_text()
    assert names(tmp_path / "drive.wmr") == FILES - {"drive.gap.rrd"}


def test_an_older_recording_does_not_stay_beside_a_newer_verdict(run, log, analysed, tmp_path):
    run("gap", log)
    run("gap", log, "--no-rrd")
    assert names(tmp_path / "drive.wmr") == FILES - {"drive.gap.rrd"}


@pytest.mark.parametrize(
    ("fail_on", "code"), [("named", 1), ("ambiguous, named", 1), ("unnamed", 0), ("", 0)]
)
def test_fail_on_decides_the_exit_code_and_still_writes_everything(
    run, log, analysed, tmp_path, fail_on, code
):
    assert run("gap", log, "--fail-on", fail_on)[0] == code
    assert names(tmp_path / "drive.wmr") == FILES


@pytest.mark.parametrize(
    "wrong",
    [
        ("--fail-on", "perhaps"),
        ("--tolerance", "3"),
        ("--tolerance", "3:40"),
        ("--modes", "topic:"),
        ("--modes", "given"),
        ("--modes", "true"),
        ("--max-effects", "4"),
        ("--truth", "/ground_truth/mode"),
    ],
)
def test_wrong_usage_exits_with_2_and_writes_nothing(run, log, analysed, tmp_path, wrong):
    code, out, err = run("gap", log, *wrong)
    assert (code, out) == (2, "")
    assert err
    assert names(tmp_path) == set()


def test_options_reach_the_analysis(run, log, analysed):
    run("gap", log, "--tolerance", "5:2", "--modes", "ideal", "--max-effects", "1")
    options = analysed["options"]
    assert (options.tolerance_m, options.tolerance_s) == (0.005, 2.0)
    assert (options.modes, options.max_effects) == ("ideal", 1)
    assert analysed["base"] is None


def test_no_mode_is_handed_on_unless_its_topic_is_named(run, analysed, tmp_path):
    path = tmp_path / "drive.mcap"
    record(synthesise("patrol", seed=2, duration_s=6.0), path)
    run("gap", path)
    assert analysed["log"].mode is None
    code, _, _ = run("gap", path, "--modes", "topic:/ground_truth/mode")
    assert code == 0
    assert len(analysed["log"].mode) >= 1
    assert analysed["options"].modes == "given"
    assert read_gap(tmp_path / "drive.wmr" / "drive.gap.json").modes == "topic:/ground_truth/mode"


def test_the_gap_in_slip_is_said_beside_the_table(run, analysed, log):
    made = analysed["result"]
    run("gap", log)
    assert "in slip" not in run("gap", log)[1]
    position = replace(made.position, in_slip=SlipGap(9, 0.3, 0.02))
    analysed["result"] = replace(
        made, position=position, yaw=replace(made.yaw, in_slip=SlipGap(9, 0.01, 0.01))
    )
    said = " ".join(run("gap", log)[1].split())
    assert "in slip position 300 → 20 mm, yaw 10 mrad over 4 s, 9 windows not counted above" in said


@pytest.mark.parametrize(
    ("size", "text"), [(None, "–"), (0.0123, "12.3"), (99.0, "99000"), (1e150, "runs away")]
)
def test_a_model_that_runs_away_is_said_to(size, text):
    assert thousandths(size) == text


def test_the_side_files_change_nothing(run, analysed, tmp_path, log):
    path = tmp_path / "drive.mcap"
    _, facts, states = record(synthesise("patrol", seed=2, duration_s=6.0), path, mode_topic=False)
    facts.write_text("not to be read")
    states.write_text("not to be read")
    assert run("gap", path)[0] == 0
    beside = analysed["log"]
    run("gap", log)
    for name, column in vars(analysed["log"].pose).items():
        np.testing.assert_array_equal(getattr(beside.pose, name), column)


def test_a_base_model_is_read_and_never_overwritten(run, log, analysed, tmp_path):
    run("fit", log, "--out", "base")
    base = tmp_path / "base" / "drive.model.toml"
    code, _, _ = run("gap", log, "--model", base)
    assert code == 0
    assert analysed["base"].effects == analysed["result"].model.effects
    before = base.read_text()
    code, _, err = run("gap", log, "--model", base, "--out", "base")
    assert code == 2
    assert "would overwrite its base" in err
    assert base.read_text() == before


def test_effects_at_a_time_do_not_follow_the_robot_to_another_log():
    times = {"start_s": 1.0, "end_s": 2.0, "loss": 0.5}
    effects = (Effect("slip_interval", times), Effect("viscous_drag", {"c1_per_s": 0.2}))
    model = Model(effects=effects, provenance=Provenance(log_sha256="a" * 64))
    assert base_for(model, "a" * 64) == (model, ())
    base, notes = base_for(model, "b" * 64)
    assert [effect.name for effect in base.effects] == ["viscous_drag"]
    assert notes == ("slip_interval of the model belongs to the time of another log and is left out",)


@pytest.mark.parametrize(
    ("term", "kept"),
    [
        ("gust(30,8)*cos(yaw)", False),
        ("after(12)*v", False),
        ("pulse(30,8)*v", False),
        ("saw(3,20)*sgn(yaw_rate)", False),
        ("circle(1,2,3,0.5)*v", True),
        ("v*over(a_lat,0.3)", True),
        ("edge(yaw,3,1)", False),
        ("edge(x,3,1)", True),
        ("sin(0.2t)*effort_diff", False),
        ("effort_diff*t", True),
        ("v*fall(t,30)", True),
        ("v*over(v,0.3)", True),
        ("sin(0.9x)", True),
    ],
)
def test_a_gust_belongs_to_its_log(term, kept):
    effects = (Effect(f"unnamed:yaw:{term}", {"coefficient": 0.2}),)
    base, notes = base_for(Model(effects=effects, provenance=Provenance(log_sha256="a" * 64)), "b" * 64)
    assert bool(base.effects) is kept
    assert bool(notes) is not kept


def test_a_lateral_term_without_a_name_is_refused_as_a_base(run, log, analysed, tmp_path):
    path = tmp_path / "base.toml"
    path.write_text(
        model_to_toml(Model(effects=(Effect("unnamed:lateral:v*abs(yaw_rate)", {"coefficient": 1.0}),)))
    )
    code, _, err = run("gap", log, "--model", path)
    assert code == 2
    assert "cannot hold unnamed:lateral:v*abs(yaw_rate)" in err


def test_fit_writes_the_model_and_shows_intervals(run, log, analysed, tmp_path, made_up_gap):
    sd = {"alpha": 0.002}
    analysed["result"] = made_up_gap.gap_result(model=made_up_gap.Model(made_up_gap.ROBOT, sd))
    code, out, _ = run("fit", log)
    assert code == 0
    assert names(tmp_path / "drive.wmr") == {"drive.model.toml"}
    model = read_model(tmp_path / "drive.wmr" / "drive.model.toml")
    assert model.robot_sd == sd
    assert model.provenance.command == f"wmr-replay fit {log}"
    assert "0.2741 … 0.2819" in out
    assert "as given" in out
    _, out, _ = run("fit", log, "--json")
    assert json.loads(out)["robot"]["alpha_sd"] == 0.002


@pytest.mark.parametrize(
    ("module", "failing"),
    [
        (gap_command, "gap_to_json"),
        (gap_command, "model_to_toml"),
        (gap_writer, "write_gap_timeline"),
    ],
)
@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt, 130), (OSError, 2), (ZeroDivisionError, 70)])
def test_whatever_stops_the_writing_leaves_nothing(
    run, log, analysed, tmp_path, monkeypatch, module, failing, error, code
):
    def stop(*_):
        raise error

    monkeypatch.setattr(module, failing, stop)
    assert run("gap", log)[0] == code
    assert not (tmp_path / "drive.wmr").exists()


def test_an_interruption_leaves_older_results_alone(run, log, analysed, tmp_path, monkeypatch):
    run("gap", log)
    before = (tmp_path / "drive.wmr" / "drive.gap.json").read_bytes()

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(gap_writer, "write_gap_timeline", stop)
    code, _, err = run("gap", log)
    assert code == 130
    assert "nothing half-written" in err
    assert names(tmp_path / "drive.wmr") == FILES
    assert (tmp_path / "drive.wmr" / "drive.gap.json").read_bytes() == before


def test_a_log_without_torques_exits_with_3_and_says_what_to_try(run, tmp_path, analysed):
    path = tmp_path / "drive.mcap"
    simulated = synthesise("patrol", seed=2, duration_s=6.0)
    write_mcap(Log(simulated.log.pose, None, None, simulated.log.robot), path)
    code, _, err = run("gap", path)
    assert code == 3
    assert "no wheel torques" in err
    assert "--torque TOPIC" in err
    assert "log" not in analysed


def test_what_the_analysis_says_of_a_signal_is_said_of_the_log(run, log, monkeypatch):
    def analyse(*_):
        raise InvalidSignal("pose", "too few bins")

    monkeypatch.setattr(gap_command, "analyse", analyse)
    code, _, err = run("gap", log)
    assert code == 3
    assert err.removeprefix(f"{LINE}\n").startswith(f"error: {log}: pose: too few bins")
    assert "needs a minute or so of driving" in err


def test_a_log_that_is_too_short_is_no_internal_error(run, tmp_path):
    path = tmp_path / "short.mcap"
    record(synthesise("patrol", seed=2, duration_s=3.0), path, truth=False)
    code, _, err = run("gap", path)
    assert code == 3
    assert "needs a minute or so of driving" in err
    assert names(tmp_path) == {"short.mcap"}


def test_a_hidden_effect_is_named_from_the_command_line(tmp_path):
    """End to end, with the analysis itself; the side files are gone before it starts."""

    def command(*arguments):
        done = subprocess.run([BINARY, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    hide = ("--hide", "viscous_drag:c1_per_s=.2", "--no-truth-topic", "--seed", "1")
    command("synth", "patrol", *hide, "--duration", "60", "--out", "drag.mcap")
    for side_file in tmp_path.glob("drag.truth.*"):
        side_file.unlink()
    command("gap", "drag.mcap", "--modes", "identified")
    found = read_gap(tmp_path / "drag.wmr" / "drag.gap.json")
    assert found.effects[0].name == "viscous_drag"
    low, high = found.effects[0].parameters["c1_per_s"].ci95
    assert low < 0.2 < high
    assert found.gap.held_out.after < 0.5 * found.gap.held_out.before
    for use in (("synth", "patrol", "--out", "again.mcap", "--duration", "10"), ("run", "drag.mcap")):
        command(*use, "--model", "drag.wmr/drag.model.toml")


def without_origin(model):
    return replace(model, provenance=replace(model.provenance, command=""))


def test_a_result_repeats_its_call(run, log, analysed, tmp_path):
    """Every option that decides the answer comes from the result, whatever the project's file says now."""
    (tmp_path / "robot.toml").write_text("clock = 'log'\n[robot]\nmass_kg = 31.0\n")
    (tmp_path / "base.toml").write_text("[robot]\nalpha = 0.31\n[provenance]\nversion = '0.1'\n")
    options = ["--tolerance", "3.7:2.5", "--max-effects", 2, "--seed", 5, "--clock-offset", -0.03]
    options += ["--map", tmp_path / "robot.toml", "--pose", "/pose", "--start", 1, "--end", "5.5"]
    given = [*options, "--modes", "ideal", "--model", tmp_path / "base.toml"]
    assert run("gap", log, *given, "--out", "one", "--no-rrd")[0] == 0
    first, asked = read_gap(tmp_path / "one/drive.gap.json"), (analysed["options"], analysed["base"])
    assert first.settings.clock_offset_s == -0.03
    assert set(first.settings.given) == {"mapping", "model", "start", "end"}
    for file in tmp_path.glob("*.toml"):
        file.unlink()
    (tmp_path / "wmr-replay.toml").write_text("torque = '/nowhere'\nmodes = 'identified'\nno-rrd = true\n")
    assert run("gap", log, "--config", "one/drive.gap.json", "--out", "two") == (0, ANY, "")
    assert (analysed["options"], analysed["base"]) == asked
    assert without_origin_in(read_gap(tmp_path / "two/drive.gap.json")) == without_origin_in(first)
    assert names(tmp_path / "two") == FILES - {"drive.gap.rrd"}
    run("gap", log, "--config", "one/drive.gap.json", "--seed", 6, "--out", "three")
    assert read_gap(tmp_path / "three/drive.gap.json").seed == 6


def without_origin_in(found):
    """gap.json but for the command line in its model."""
    origin = {name: text for name, text in found.model.provenance.items() if name != "command"}
    return msgspec.structs.replace(found, model=msgspec.structs.replace(found.model, provenance=origin))


def test_a_fit_repeats_its_call_from_its_model(run, log, analysed, tmp_path, monkeypatch):
    (tmp_path / "robot.toml").write_text("[robot]\nmass_kg = 31.0\n")
    given = ["--map", tmp_path / "robot.toml", "--modes", "ideal", "--clock-offset", 0.02, "--end", 5]
    run("fit", log, *given, "--out", "one")
    first, poses = read_model(tmp_path / "one/drive.model.toml"), len(analysed["log"].pose)
    (tmp_path / "robot.toml").unlink()
    assert run("fit", log, "--config", "one/drive.model.toml", "--out", "two") == (0, ANY, "")
    again = read_model(tmp_path / "two/drive.model.toml")
    assert without_origin(again) == without_origin(first)
    assert again.provenance.settings
    assert (analysed["options"].modes, len(analysed["log"].pose)) == ("ideal", poses)
    assert analysed["log"].robot.mass_kg == 31.0
    (tmp_path / "bare.toml").write_text("[robot]\nalpha = 1.0\n[provenance]\nversion = '0.1'\n")
    code, _, err = run("fit", log, "--config", "bare.toml")
    assert code == 2
    assert "bare.toml: [provenance] settings: is missing" in err


def test_a_missing_parameter_of_the_robot_is_asked_for_by_file(run, log, analysed, monkeypatch):
    def calibrate(*_):
        raise InvalidSignal("robot", "half_track_m is needed")

    monkeypatch.setattr(gap_command, "calibrate", calibrate)
    code, _, err = run("fit", log)
    assert code == 3
    assert "half_track_m is needed\nName it in a file" in err
    assert "--map robot.toml" in err


def test_a_simulators_log_is_the_base(run, log, analysed, tmp_path):
    simulated = tmp_path / "simulated.mcap"
    simulated.write_bytes(log.read_bytes())
    analysed["result"] = replace(analysed["result"], sentence="The model lacks viscous_drag.")
    own = analysed["result"].model.effects
    code, out, _ = run("gap", log, "--base-log", simulated, "--no-rrd", "--out", tmp_path / "out")
    assert code == 0
    assert "simulator's log simulated.mcap" in out
    assert "The simulator lacks viscous_drag." in out
    assert analysed["base"].effects == own  # what the simulator's own log shows
    gap, model = read_gap(tmp_path / "out/drive.gap.json"), read_model(tmp_path / "out/drive.model.toml")
    assert (gap.base, gap.base_log) == ("simulator's log simulated.mcap", str(simulated))
    assert gap.base_log_sha256 == model.provenance.base_log_sha256 == gap.log_sha256
    assert [one["name"] for one in json.loads(model.provenance.base_effects)] == [e.name for e in own]


def test_a_model_is_proven_on_another_log(run, log, analysed, tmp_path, monkeypatch):
    monkeypatch.setattr("wmr_replay.jobs.proof.checked_findings", lambda *_: ())
    model = replace(analysed["result"].model, robot=SMALL_ROBOT)
    analysed["result"] = replace(analysed["result"], model=model)
    other, out = tmp_path / "other.mcap", tmp_path / "out"
    record(synthesise("patrol", seed=3, duration_s=20.0, robot=SMALL_ROBOT), other, mode_topic=False)
    asked = ("gap", log, "--modes", "ideal", "--no-rrd", "--out", out)
    code, said, complaint = run(*asked, "--prove-on", other)
    assert (code, complaint) == (0, ANY), complaint
    assert "never fitted" in " ".join(said.split())
    proof = read_gap(out / "drive.gap.json").proof
    assert proof.log == str(other)
    assert proof.gap.windows >= 3
    assert proof.gap.held_out.before != proof.gap.held_out.after
    paths = pl.read_parquet(out / "drive.gap_proof.parquet")
    assert paths["held_out"].all()
    assert paths["extended_x_m"].is_not_null().mean() > 0.5
    assert run(*asked)[0] == 0
    assert not (out / "drive.gap_proof.parquet").exists()


def test_a_base_is_a_model_or_a_log(run, log, tmp_path):
    model = tmp_path / "base.model.toml"
    model.write_text(model_to_toml(Model()))
    code, _, err = run("gap", log, "--base-log", log, "--model", model)
    assert code == 2
    assert "not both" in err


@pytest.mark.parametrize(("files", "said"), [((), "a model file"), (("b", "a"), "a.model.toml or ")])
def test_a_folder_for_a_model_is_refused_with_the_models_in_it(run, log, tmp_path, files, said):
    folder = tmp_path / "models"
    folder.mkdir()
    for name in files:
        (folder / f"{name}.model.toml").touch()
    code, _, err = run("gap", log, "--model", "models")
    assert code == 2
    assert "models is a directory; give" in " ".join(err.split())
    assert said in " ".join(err.split())
