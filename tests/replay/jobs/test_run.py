"""``wmr-replay run``: files, tables, messages, exit codes."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from mcap.writer import Writer
from polars.testing import assert_frame_equal

from wmr_replay.cli.compiling import LINE
from wmr_replay.jobs.run import run_log
from wmr_schemas import PAPER_ROBOT, RobotParameters
from wmr_schemas.errors import DamagedLog
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.tables import CONFUSION, HINDSIGHT, SAMPLES, SEGMENTS, SUMMARY, polars_schema
from wmr_synth import Sensors, record, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
BINARY = Path(sys.executable).with_name("wmr-replay")


def command(*args, cwd, code=0):
    done = subprocess.run([BINARY, *map(str, args)], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "drive.mcap"
    record(synthesise("random", seed=5, duration_s=20, sensors=SENSORS), path)
    return path


@pytest.fixture(scope="module")
def result(log, tmp_path_factory):
    return run_log(log, tmp_path_factory.mktemp("out"))


def test_every_file_is_there_and_follows_its_documented_schema(result):
    tables = {
        "samples": SAMPLES,
        "segments": SEGMENTS,
        "summary": SUMMARY,
        "confusion": CONFUSION,
        "hindsight": HINDSIGHT,
        "hindsight_segments": SEGMENTS,
    }
    for name, columns in tables.items():
        assert pl.read_parquet(result.files[name]).schema == polars_schema(columns), name
    directory = result.files["samples"].parent
    endings = (
        "rrd",
        "samples.parquet",
        "segments.parquet",
        "summary.parquet",
        "summary.json",
        "confusion.parquet",
        "hindsight.parquet",
        "hindsight_segments.parquet",
    )
    assert sorted(p.name for p in directory.iterdir()) == sorted(f"drive.{ending}" for ending in endings)


def test_the_tables_agree_with_one_another(result):
    samples, segments = (pl.read_parquet(result.files[name]) for name in ("samples", "segments"))
    row = json.loads(result.files["summary_json"].read_text())
    assert row["n_pose"] == len(samples) == segments["n_samples"].sum()
    warm = samples.filter(pl.col("status") != "warming_up")
    assert row["accuracy"] == pytest.approx((warm["mode"] == warm["mode_true"]).mean())
    assert row["share_skidding"] == pytest.approx((warm["mode"] == 1).mean())
    assert row["alpha"] == samples["alpha"].drop_nulls()[-1]
    assert row["alpha_error"] == pytest.approx(row["alpha"] / (0.35**2 / 4.8) - 1)
    assert segments["end_ns"][:-1].equals(segments["start_ns"][1:].rename("end_ns"))
    assert row["settings"]["robot"]["mass_kg"] == 1000.0
    assert row["settings"]["tuning"]["window_s"] > 0


def test_truth_is_used_for_scoring_only(log, result, tmp_path):
    """Without side files and without the truth's topic every estimate is the same."""
    bare = tmp_path / "drive.mcap"
    record(synthesise("random", seed=5, duration_s=20, sensors=SENSORS), bare, truth=False)
    blind = run_log(bare, tmp_path / "out")
    with_truth, without = (pl.read_parquet(r.files["samples"]).drop("mode_true") for r in (result, blind))
    assert_frame_equal(with_truth, without, check_exact=True)
    assert blind.summary["accuracy"] is None
    assert blind.summary["alpha_error"] is None
    assert "confusion" not in blind.files
    assert not (tmp_path / "out" / "drive.confusion.parquet").exists()


def test_the_same_log_gives_the_same_tables_twice(log, result, tmp_path):
    again = run_log(log, tmp_path, timeline=False)
    for name in ("samples", "segments", "summary"):
        assert_frame_equal(
            pl.read_parquet(result.files[name]), pl.read_parquet(again.files[name]), check_exact=True
        )


def test_without_hindsight_that_of_an_earlier_run_goes(log, tmp_path):
    earlier = run_log(log, tmp_path, timeline=False)
    kinds = ("hindsight", "hindsight_segments")
    assert all(earlier.files[kind].is_file() for kind in kinds)
    command("run", log, "--out", tmp_path, "--no-rrd", "--no-hindsight", cwd=tmp_path)
    assert not any(earlier.files[kind].exists() for kind in kinds)
    assert not list(tmp_path.glob("*hindsight*"))
    summary = json.loads(earlier.files["summary_json"].read_text())
    assert summary["settings"]["hindsight"] is False
    assert summary["hindsight_accuracy"] is None
    samples = pl.read_parquet(earlier.files["samples"])
    assert len(samples) == summary["n_pose"]


def test_the_verdict_tells_the_modes_of_hindsight(result):
    """The shares are counted here from the files, over the rows after warm-up."""
    row = json.loads(result.files["summary_json"].read_text())
    shares = {}
    for kind, prefix in (("samples", ""), ("hindsight", "hindsight_")):
        rows = pl.read_parquet(result.files[kind]).filter(pl.col("status") != "warming_up")
        for number, name in ((-1, "undecided"), (0, "ideal"), (1, "skidding"), (2, "slipping")):
            shares[kind, name] = (rows["mode"] == number).mean()
            assert row[f"{prefix}share_{name}"] == pytest.approx(shares[kind, name]), name
    told = {name: re.search(rf"{name} (\d+)%", row["verdict"]) for name in ("ideal", "skidding", "slipping")}
    assert {name: int(found[1]) for name, found in told.items()} == {
        name: round(100 * shares["hindsight", name]) for name in told
    }
    assert any(round(100 * shares["samples", name]) != int(found[1]) for name, found in told.items())


def test_bare_run_writes_beside_where_it_is_called_and_says_what_it_found(log, tmp_path):
    done = command("run", log, "--no-rrd", cwd=tmp_path)
    assert (tmp_path / "drive.wmr" / "drive.samples.parquet").is_file()
    assert "accuracy" in done.stdout
    assert "Of the time: ideal" in done.stdout
    assert done.stderr.replace(f"{LINE}\n", "") == ""


def test_the_summary_names_the_command_that_opens_the_viewer(log, tmp_path):
    done = command("run", log, "--out", "here", cwd=tmp_path)
    assert "here/drive.rrd" in done.stdout
    assert (tmp_path / "here" / "drive.rrd").stat().st_size > 10_000


def test_json_is_the_summary(log, tmp_path):
    done = command("run", log, "--json", "--no-rrd", cwd=tmp_path)
    assert set(json.loads(done.stdout)) == set(polars_schema(SUMMARY))


def test_options_of_the_differentiator_reach_the_result(log, tmp_path):
    done = command(
        "run", log, "--json", "--no-rrd", "--window", "0.8", "--degree", "3", "--theta", "0.4", cwd=tmp_path
    )
    row = json.loads(done.stdout)
    assert row["settings"]["tuning"]["window_s"] == pytest.approx(0.8)
    assert row["settings"]["tuning"]["delay_s"] == pytest.approx(0.8 * 0.3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--window", "0.02"), "lengthen the window to 0.06 s"),
        (("--window", "-1"), "must be longer than 0 s"),
        (("--degree", "1"), "degree must be 2 to 8"),
        (("--threshold-sd", "0"), "above 0 standard deviations"),
        (("--torque", "/wheel_torques{left=a}"), "is not TOPIC or TOPIC{left=JOINT+JOINT,right=JOINT}"),
        (("--view", "--no-rrd"), "--view needs the timeline"),
    ],
)
def test_wrong_settings_are_usage_errors_that_say_what_to_do(log, tmp_path, options, message):
    assert message in command("run", log, *options, cwd=tmp_path, code=2).stderr
    assert not list(tmp_path.iterdir())


def test_a_log_without_a_pose_says_what_was_looked_for_and_which_option_maps_it(tmp_path):
    path = tmp_path / "no_pose.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="test")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
        writer.register_channel("/battery", "cdr", schema)
        writer.finish()
    message = command("run", path, cwd=tmp_path, code=3).stderr
    for fact in ("no pose", "/battery (std_msgs/msg/Float64)", "--pose TOPIC", "--map FILE"):
        assert fact in message
    assert sorted(p.name for p in tmp_path.iterdir()) == ["no_pose.mcap"]


@pytest.mark.parametrize(
    ("content", "fact"), [(None, "missing"), (b"", "empty"), (b"not an mcap file at all", "MCAP")]
)
def test_what_is_no_log_gets_exit_code_3(tmp_path, content, fact):
    path = tmp_path / f"{fact}.mcap"
    if content is not None:
        path.write_bytes(content)
    assert str(path) in command("run", path, cwd=tmp_path, code=3).stderr
    assert not (tmp_path / f"{fact}.wmr").exists()


def test_a_wrong_topic_is_named_together_with_those_there_are(log, tmp_path):
    message = command("run", log, "--pose", "/nowhere", cwd=tmp_path, code=3).stderr
    assert "/nowhere" in message
    assert "/pose" in message


@pytest.fixture
def truncated(log, tmp_path):
    path = tmp_path / "cut.mcap"
    data = log.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    return path


def test_the_intact_part_of_a_truncated_log_is_analysed_and_the_loss_stated(truncated, tmp_path):
    result = run_log(truncated, tmp_path / "out", timeline=False)
    assert 100 < result.summary["n_pose"] < 1001
    assert result.summary["truncated"] is True
    assert "the file ends inside it" in " ".join(json.loads(result.summary["notes"]))


def test_strict_makes_a_loss_an_error_and_leaves_no_results(truncated, tmp_path):
    with pytest.raises(DamagedLog):
        run_log(truncated, tmp_path / "out", strict=True)
    assert not (tmp_path / "out").exists()
    assert "error" in command("run", truncated, "--strict", "--out", "out", cwd=tmp_path, code=3).stderr


def test_an_interrupted_run_leaves_nothing_behind(log, tmp_path):
    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_log(log, tmp_path, progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_robot_without_known_alpha_gets_one_estimated_and_none_assumed(log, tmp_path):
    copy = tmp_path / "drive.mcap"
    shutil.copy(log, copy)
    result = run_log(
        copy,
        tmp_path / "out",
        mapping=LogMapping(robot=RobotParameters(half_track_m=1.0), robot_from_log=False),
        timeline=False,
    )
    assert result.summary["alpha"] == pytest.approx(0.35**2 / 4.8, rel=0.15)
    samples = pl.read_parquet(result.files["samples"])
    early = samples.filter(pl.col("alpha").is_null())
    assert early["c_d_mps2"].null_count() == len(early)


def test_a_parameter_of_the_mapping_file_overrides_the_logs_own_and_no_other(log, tmp_path):
    (tmp_path / "robot.toml").write_text('[pose]\ntopic = "/pose"\n[robot]\nalpha = 0.05\n')
    done = command("run", log, "--map", "robot.toml", "--json", "--no-rrd", cwd=tmp_path)
    assert json.loads(done.stdout)["settings"]["robot"] == PAPER_ROBOT.known() | {"alpha": 0.05}


@pytest.mark.parametrize("source", ["made", "real"])
def test_turtlebot_odometry_is_recognised_and_no_claim_about_skidding_is_made(
    source, shared_data, real_shapes, tmp_path
):
    if source == "real":
        path = shared_data("logs", "fuse_turtlebot3.mcap")
    else:
        path = real_shapes.turtlebot(tmp_path / "turtlebot.mcap")
    done = command("run", path, "--out", "out", cwd=tmp_path)
    assert "integrated from wheel speeds" in done.stdout
    assert "without wheel torques ideal rolling and slipping cannot be told apart" in done.stdout
    samples = pl.read_parquet(tmp_path / "out" / f"{path.stem}.samples.parquet")
    assert len(samples) == 2741
    warm = samples.filter(pl.col("status") != "warming_up")
    assert len(warm) > 2000
    assert (warm["status"] == "pose_not_independent").mean() > 0.95
    assert (samples["mode"] == -1).all()
    assert samples["c_d_mps2"].null_count() == len(samples)
    assert warm["v_lat_mps"].abs().median() < 3e-4


@pytest.mark.parametrize("source", ["made", "real"])
def test_a_log_of_commands_only_gets_exit_code_3(source, shared_data, real_shapes, tmp_path):
    if source == "real":
        path = shared_data("logs", "replay_testing_cmd_vel_only.mcap")
    else:
        path = real_shapes.commands_only(tmp_path / "commands.mcap")
    message = command("run", path, cwd=tmp_path, code=3).stderr
    for fact in ("no pose", "/vehicle/cmd_vel (geometry_msgs/msg/TwistStamped)", "--pose TOPIC"):
        assert fact in message


@pytest.mark.parametrize("encoding", ["protobuf", "json"])
def test_every_encoding_of_a_drive_gives_the_same_answer(result, tmp_path, encoding):
    path = tmp_path / "drive.mcap"
    record(synthesise("random", seed=5, duration_s=20, sensors=SENSORS), path, encoding=encoding)
    other = pl.read_parquet(run_log(path, tmp_path / "out", timeline=False).files["samples"])
    assert_frame_equal(pl.read_parquet(result.files["samples"]), other, abs_tol=1e-12, rel_tol=1e-9)


def test_pose_jitter_and_dropouts_are_analysed_on_the_actual_stamps(tmp_path):
    rough = Sensors(
        rate_hz=50.0,
        torque_rate_hz=50.0,
        noise_xy_sd_m=0.01,
        noise_yaw_sd_rad=0.005,
        jitter_s=0.004,
        dropout=0.05,
    )
    path = tmp_path / "rough.mcap"
    record(synthesise("random", seed=5, duration_s=20, sensors=rough), path)
    result = run_log(path, tmp_path / "out", timeline=False)
    samples = pl.read_parquet(result.files["samples"]).filter(pl.col("status") != "warming_up")
    assert samples["v_long_mps"].null_count() < 0.01 * len(samples)
    truth = pl.read_parquet(path.with_name("rough.truth.parquet"))
    at = (samples["t_ns"] - (samples["delay_s"].fill_null(0) * 1e9).cast(pl.Int64)).to_numpy()
    error = samples["v_long_mps"].to_numpy() - np.interp(at, truth["t_ns"], truth["v_long_mps"])
    assert np.nanmedian(np.abs(error)) < 0.05
