"""``fit``, ``gap`` and ``export`` on wheel speeds: files, exit codes, refusals."""

import json
from dataclasses import replace

import msgspec
import pytest
import yaml
from tests.replay.made_up_wheels import ROBOT, drive

import wmr_replay as wr
from wmr_replay.gap.wheel_speed.between_logs import SCRUB_SD
from wmr_replay.ingest.tracks import check_class
from wmr_replay.jobs.export import multipliers, ros2_diff_drive
from wmr_replay.jobs.gap_asked import Asked
from wmr_schemas.errors import InvalidSetting, LogUnusable
from wmr_schemas.findings import finding
from wmr_schemas.model_file import Effect, Model, Odometry, read_model
from wmr_synth import write_mcap

TRUTH = {"effective_track": {"ratio": 0.2}, "wheel_scale": {"ratio": -0.04}}
NOISE = (0.01, 0.005)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("wheels") / "drive.mcap"
    write_mcap(drive(TRUTH, noise=NOISE, seed=21, seconds=40.0), path)
    return path


@pytest.fixture(scope="module")
def fitted(log, tmp_path_factory):
    return wr.fit(log, tmp_path_factory.mktemp("fit"))


def test_fit_writes_what_it_learnt_and_the_odometrys_error(fitted):
    model = read_model(fitted.file)

    assert model.provenance.base_model == "wheel_speed"
    assert model.robot == ROBOT
    for effect in model.effects:
        if effect.name in TRUTH:
            assert effect.parameters["ratio"] == pytest.approx(TRUTH[effect.name]["ratio"], abs=0.02)
        assert all(sd > 0 for sd in effect.sd.values())
    assert model.odometry.position_rms_after_m < 0.3 * model.odometry.position_rms_before_m


def test_gap_with_the_fitted_model_finds_nothing_missing(log, fitted, tmp_path, command):
    done = command("gap", log, "--model", fitted.file, "--out", tmp_path, "--no-rrd")

    found = json.loads((tmp_path / "drive.gap.json").read_text())
    assert found["verdict"] == "nothing_missing"
    assert found["base_model"] == "wheel_speed"
    assert found["settings"]["base"] == "wheel-speed"
    assert "wheel speeds" in done.stdout
    assert "odometry" in done.stdout
    assert (tmp_path / "drive.gap_traces.parquet").exists()


def test_both_bases_are_one_answer(log, fitted, tmp_path, command, monkeypatch):
    def on_torques(asked):
        run = asked.on_wheel_speeds()
        return replace(run, document=msgspec.structs.replace(run.document, base_model="torque"))

    monkeypatch.setattr(Asked, "on_torques", on_torques)
    asked = ("--base", "both", "--model", fitted.file, "--out", tmp_path, "--no-rrd")
    done = command("gap", log, *asked, "--fail-on", "nothing_missing", code=1)

    first = json.loads((tmp_path / "drive.gap.json").read_text())
    second = json.loads((tmp_path / "wheel-speed" / "drive.gap.json").read_text())
    assert first["bases"] == second["bases"]
    assert first["bases"]["sentence"] in " ".join(done.stdout.split())
    assert second["base_model"] == "wheel_speed"


def test_export_says_the_controllers_parameters(fitted, tmp_path, command):
    file = tmp_path / "diff_drive.yaml"
    printed = command("export", fitted.file, "--to", "ros2-diff-drive").stdout
    command("export", fitted.file, "--to", "ros2-diff-drive", "--out", file)

    text = file.read_text()
    assert printed.strip() == text.strip()
    parameters = yaml.safe_load(text)["diff_drive_controller"]["ros__parameters"]
    assert parameters["wheel_separation"] == 0.5
    assert parameters["wheel_radius"] == 0.1
    assert parameters["wheel_separation_multiplier"] == pytest.approx(1.2, abs=0.02)
    assert parameters["left_wheel_radius_multiplier"] == pytest.approx(0.96, abs=0.01)
    assert parameters["right_wheel_radius_multiplier"] == pytest.approx(0.96, abs=0.01)
    assert "windows that were held out" in text


def test_multipliers_follow_from_scale_difference_and_track():
    effects = (
        Effect("wheel_scale", {"ratio": -0.1}, {"ratio": 0.003}),
        Effect("wheel_scale_difference", {"ratio": 0.02}, {"ratio": 0.004}),
        Effect("effective_track", {"ratio": 0.5}, {"ratio": 0.01}),
        Effect("lateral_slip", {"seconds": 0.1}),
    )
    odometry = Odometry(4.0, 20, 0.5, 0.1, 0.4, 0.08, 0.2, 0.03)
    model = Model(robot=ROBOT, effects=effects, odometry=odometry)
    track, left, right = multipliers(model)

    assert (track.value, track.sd) == (1.5, 0.01)
    assert left.value == pytest.approx(0.9 * 0.98)
    assert right.value == pytest.approx(0.9 * 1.02)
    assert right.sd == pytest.approx(((0.003 * 1.02) ** 2 + (0.004 * 0.9) ** 2) ** 0.5)
    text = ros2_diff_drive(model)
    assert "1.50000  # 1.48040 to 1.51960" in text
    assert "500 -> 100 mm rms" in text
    assert "lateral_slip" in text


def test_a_model_without_wheels_is_not_exported():
    with pytest.raises(InvalidSetting, match="wheel_scale"):
        multipliers(Model(robot=ROBOT))
    with pytest.raises(InvalidSetting, match="ros2-diff-drive"):
        wr.export(Model(robot=ROBOT), to="something")


@pytest.mark.parametrize("code", ["steered", "drives_sideways"])
def test_a_robot_of_another_class_is_refused(code, tmp_path):
    with pytest.raises(LogUnusable, match=code):
        check_class(tmp_path / "car.mcap", [finding(code, "warning", "its yaw rate follows the steering")])


def test_a_log_with_neither_torques_nor_wheel_speeds_is_refused(log, tmp_path, command):
    bare = drive({}, seconds=20.0)
    path = tmp_path / "poses.mcap"
    write_mcap(type(bare)(bare.pose, robot=ROBOT), path)

    for name in ("fit", "gap"):
        assert "torque" in command(name, path, "--out", tmp_path, code=3).stderr
    assert "wheel speed" in command("gap", path, "--base", "wheel-speed", code=3).stderr
    assert "several logs" in command("gap", log, log, "--base", "torque", code=2).stderr
    assert "commands" in command("gap", log, "--base", "torque", "--input", "commands", code=2).stderr


def test_several_logs_are_fitted_together(log, tmp_path):
    second = tmp_path / "second.mcap"
    write_mcap(drive(TRUTH, noise=NOISE, seed=22, seconds=30.0), second)

    both = wr.fit([log, second])
    alone = wr.fit(log)
    sd = {one: {e.name: e.sd for e in f.model.effects} for one, f in (("both", both), ("alone", alone))}
    assert sd["both"]["wheel_scale"]["ratio"] < sd["alone"]["wheel_scale"]["ratio"]
    track = next(e.parameters["ratio"] for e in both.model.effects if e.name == "effective_track")
    assert sd["both"]["effective_track"]["ratio"] == pytest.approx(SCRUB_SD * track, rel=0.05)
