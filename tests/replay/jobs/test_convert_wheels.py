"""CSV files with wheel speeds, commands and windows: what is written reads back as it was."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

import wmr_replay as wr
from wmr_replay.ingest import Between
from wmr_replay.ingest.tracks import read_whole
from wmr_schemas.breaks import from_metadata, stretches, to_metadata
from wmr_schemas.csv_map import read_csv_map
from wmr_schemas.errors import InvalidFile
from wmr_schemas.mapping_file import LogMapping

HUSKY = Path(__file__).parents[3] / "docs" / "examples" / "husky.toml"
HEAD = '[columns]\ntime = "t"\nx = "x"\ny = "y"\nyaw = "a"\n'
N = 41


def table(seed: int = 1) -> pl.DataFrame:
    """41 rows of any numbers, .05 s apart, time beginning again in each of the windows a, b, a."""
    rng = np.random.default_rng(seed)
    columns = dict(zip(("x", "y", "a", "wl", "wr", "cl", "cr"), rng.normal(size=(7, N)), strict=True))
    lengths = [15, 15, 11]
    times = np.concatenate([np.arange(n) * 0.05 for n in lengths])
    return pl.DataFrame({"t": times, "w": np.repeat(["a", "b", "a"], lengths)} | columns)


def converted(tmp_path, frame, more="", robot=""):
    frame.write_csv(tmp_path / "drive.csv")
    (tmp_path / "columns.toml").write_text(HEAD + more + robot)
    return wr.convert(tmp_path / "drive.csv", tmp_path / "columns.toml", tmp_path / "drive.mcap")


WHEELS = 'speed_left = "wl"\nspeed_right = "wr"\ncommand_left = "cl"\ncommand_right = "cr"\n'


@pytest.mark.parametrize("need", ["wheel_speed", "commands"])
def test_windows_are_stretches_of_one_log_and_read_back_exactly(need, tmp_path):
    frame = table()
    converted(tmp_path, frame, WHEELS + 'window = "w"\n')
    log = read_whole(tmp_path / "drive.mcap", LogMapping(), Between(), need=need).log
    assert log.torque is None
    for track, names in ((log.wheels, ("wl", "wr")), (log.commands, ("cl", "cr"))):
        np.testing.assert_array_equal(track.left_radps, frame[names[0]])
        np.testing.assert_array_equal(track.right_radps, frame[names[1]])
    np.testing.assert_array_equal(log.pose.x_m, frame["x"])
    np.testing.assert_allclose(
        np.unwrap(log.pose.yaw_rad - frame["a"].to_numpy(), period=2 * np.pi), 0, atol=1e-14
    )
    assert [ns / 1e9 for ns in log.breaks_ns] == [11.0, 22.0]
    parts = stretches(log)
    assert [len(part.pose) for part in parts] == [15, 15, 11]
    assert [len(part.wheels) for part in parts] == [15, 15, 11]
    assert all(part.breaks_ns == () for part in parts)
    in_window = np.concatenate([part.commands.t_ns - part.pose.t_ns[0] for part in parts])
    np.testing.assert_allclose(in_window / 1e9, frame["t"], atol=1e-12)
    assert [len(part.pose) for part in stretches(log, hole_s=5.0)] == [15, 15, 11]


def test_windows_of_one_clock_keep_their_times_where_they_are_apart(tmp_path):
    frame = table().with_columns(pl.Series("t", np.arange(N) * 0.05 + np.repeat([0, 20, 20], [15, 15, 11])))
    log = converted(tmp_path, frame, WHEELS + 'window = "w"\n').log
    starts = np.array([0.75 + 20, 0.75 + 20 + 0.7 + 10])
    np.testing.assert_allclose(np.array(log.breaks_ns) / 1e9, [starts[0], np.ceil(starts[1])])
    assert (np.diff(log.pose.t_ns) > 0).all()


def test_rpm_signs_and_a_commanded_twist_are_turned_into_wheel_speeds(tmp_path):
    units = '[wheel_speeds]\nunit = "rpm"\nscale = 0.5\nright_sign = -1\ngear_ratio = 4\n'
    twist = 'speed_left = "wl"\nspeed_right = "wr"\ncommand_linear = "cl"\ncommand_angular = "cr"\n'
    robot = "[robot]\nwheel_radius_m = 0.2\nhalf_track_m = 0.3\n"
    frame = table().with_columns(t=np.arange(N) * 0.05)
    log = converted(tmp_path, frame, twist + units, robot).log
    np.testing.assert_allclose(log.wheels.left_radps, frame["wl"] * 2 * np.pi / 60 / 8)
    np.testing.assert_allclose(log.wheels.right_radps, -frame["wr"] * 2 * np.pi / 60 / 8)
    ahead, turning = frame["cl"].to_numpy(), frame["cr"].to_numpy()
    np.testing.assert_allclose(log.commands.left_radps, (ahead - 0.3 * turning) / 0.2)
    np.testing.assert_allclose(log.commands.right_radps, (ahead + 0.3 * turning) / 0.2)
    read = read_whole(tmp_path / "drive.mcap", LogMapping(), Between(), need="commands").log
    assert (read.robot.wheel_radius_m, read.breaks_ns) == (0.2, ())


def test_holes_and_windows_without_a_usable_row_are_left_out(tmp_path):
    frame = table().with_columns(
        x=pl.when(pl.col("w") == "b").then(None).otherwise(pl.col("x")),
        cl=pl.when(pl.col("t") < 0.2).then(None).otherwise(pl.col("cl")),
    )
    done = converted(tmp_path, frame, WHEELS + 'window = "w"\n')
    assert (done.n_rows, done.n_left_out, len(done.log.breaks_ns)) == (26, 15, 1)
    assert np.isnan(done.log.commands.left_radps).sum() == 8


def test_efforts_beside_speeds_are_torques_and_speeds_are_there_twice(tmp_path):
    frame = table().with_columns(t=np.arange(N) * 0.05)
    log = converted(tmp_path, frame, WHEELS + 'effort_left = "cl"\neffort_right = "cr"\n').log
    np.testing.assert_array_equal(log.torque.left_radps, log.wheels.left_radps)
    np.testing.assert_array_equal(log.torque.left_nm, frame["cl"])


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('command_left = "cl"\n', "[columns] command_right: is needed, too"),
        ('command_linear = "cl"\ncommand_angular = "cr"\n', "[robot]: needs wheel_radius_m and half_track_m"),
        (WHEELS + 'command_linear = "cl"\ncommand_angular = "cr"\n', "stands in place of command_left"),
        ('[commands]\nunit = "knots"\n', "[commands] unit: expected rad/s, rpm, deg/s, rev/s or m/s"),
        ('[commands]\nunit = "m/s"\n', "[robot] wheel_radius_m: is needed where a unit is m/s"),
        ("[wheel_speeds]\nscale = 0\n", "[wheel_speeds] scale: expected a number above 0, found 0"),
        ("[wheel_speeds]\nticks = 0\n", "[wheel_speeds] ticks: unknown key; known are scale, unit"),
        ("[commands]\nleft_sign = 3\n", "[commands] left_sign: expected 1 or -1, found 3"),
    ],
)
def test_a_map_that_does_not_go_together_is_refused_by_name(more, message, tmp_path):
    (tmp_path / "columns.toml").write_text(HEAD + more)
    with pytest.raises(InvalidFile) as caught:
        read_csv_map(tmp_path / "columns.toml")
    assert message in str(caught.value)


def test_breaks_of_a_damaged_record_are_none():
    breaks = (5, -3, 2**63 - 1)
    assert from_metadata(to_metadata(breaks)) == (-3, 5, 2**63 - 1)
    for text in ("", "5 x", "5.0", "nan", "1e3", "9" * 5000, "--5", "١٢ x"):
        assert from_metadata({"breaks_ns": text}) == ()
    assert from_metadata({}) == ()


def test_a_huskys_two_second_steps_are_one_data_set(shared_data, tmp_path):
    csv = shared_data("robots", "drive_husky", "husky_windows.csv")
    wr.convert(csv, HUSKY, tmp_path / "husky.mcap")
    frame = pl.read_csv(csv)
    log = read_whole(tmp_path / "husky.mcap", LogMapping(), Between(), need="commands").log
    columns = {
        "x": log.pose.x_m,
        "y": log.pose.y_m,
        "wheel_vel_left": log.wheels.left_radps,
        "wheel_vel_right": log.wheels.right_radps,
        "cmd_left": log.commands.left_radps,
        "cmd_right": log.commands.right_radps,
    }
    for name, values in columns.items():
        np.testing.assert_array_equal(values, frame[name])
    turned = np.remainder(log.pose.yaw_rad - frame["yaw"].to_numpy() + 1, 2 * np.pi) - 1
    np.testing.assert_allclose(turned, 0, atol=1e-14)
    assert len(log.breaks_ns) == frame["window"].n_unique() - 1
    parts = stretches(log)
    times = np.concatenate([(part.pose.t_ns - part.pose.t_ns[0]) / 1e9 for part in parts])
    np.testing.assert_allclose(times, frame["t_in_window_s"], atol=1e-9)
