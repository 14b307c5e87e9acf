"""CSV files as logs, and the results on a real car under motion capture."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from scipy.signal import savgol_filter

from wmr_replay.jobs.convert import read_csv
from wmr_replay.jobs.run import run_log
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.csv_map import CsvMap, read_csv_map
from wmr_schemas.errors import InvalidFile, LogUnusable
from wmr_synth import write_mcap

ROOT = Path(__file__).parents[3]
DART = ROOT.parent / "shared" / "data" / "robots" / "dart"
needs_dart = pytest.mark.skipif(not DART.is_dir(), reason="the DART files do not lie beside the project")
COMMAND = "from wmr_replay.cli import main; main()"
COLUMNS = {"time": "t", "x": "px", "y": "py", "yaw": "psi"}


def write(path, text):
    path.write_text(text)
    return path


def test_the_pose_of_n_is_the_tracked_one_less_the_lever_arm_turned_by_the_corrected_yaw(tmp_path):
    file = write(tmp_path / "a.csv", "t,px,py,psi\n1.5,1.0,2.0,1.4\n1.6,1.0,2.0,-0.1\n")
    csv_map = CsvMap(COLUMNS, reference_x_m=0.5, reference_y_m=-0.25, yaw_offset_rad=0.1)
    pose = read_csv(file, csv_map).log.pose
    sin, cos = np.sin(1.5), np.cos(1.5)
    assert pose.t_ns.tolist() == [1_500_000_000, 1_600_000_000]
    assert pose.x_m == pytest.approx([1.0 - 0.5 * cos - 0.25 * sin, 0.5])
    assert pose.y_m == pytest.approx([2.0 - 0.5 * sin + 0.25 * cos, 2.25])
    assert pose.yaw_rad == pytest.approx([1.5, 0.0])


def test_rows_without_a_pose_or_out_of_time_are_left_out_and_counted(tmp_path):
    text = "t,px,py,psi\n0,0,0,0\n1,nan,0,0\n2,2,0,0\n2,9,0,0\n1.5,9,0,0\n,9,0,0\n3,3,0,0\n"
    done = read_csv(write(tmp_path / "a.csv", text), CsvMap(COLUMNS))
    assert done.log.pose.x_m.tolist() == [0, 2, 3]
    assert (done.n_rows, done.n_left_out) == (3, 4)
    assert done.log.torque is None


def test_torques_speeds_and_modes_are_taken_where_there_are_columns(tmp_path):
    text = "t,px,py,psi,ul,ur,m\n0,0,0,0,1,2,0\n1,1,0,0,3,,0\n2,2,0,0,5,6,2\n"
    extra = {"effort_left": "ul", "effort_right": "ur", "mode": "m"}
    log = read_csv(write(tmp_path / "a.csv", text), CsvMap(COLUMNS | extra)).log
    assert log.torque.left_nm.tolist() == [1, 3, 5]
    assert np.isnan(log.torque.right_nm[1])
    assert np.isnan(log.torque.left_radps).all()
    assert log.mode.mode.tolist() == [0, 2]
    assert log.mode.t_ns.tolist() == [0, 2_000_000_000]


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("t,px,py\n0,0,0\n", InvalidFile, "no such column for yaw; there are t, px, py"),
        ("t,px,py,psi\n0,0,0,a\n1,0,0,b\n", InvalidFile, "column for yaw does not hold numbers"),
        ("t,px,py,psi\n0,0,0,0\n", LogUnusable, "fewer than two rows"),
        ("", LogUnusable, "is no CSV file"),
    ],
    ids=["column", "text", "short", "empty"],
)
def test_files_that_cannot_be_used_say_why(tmp_path, text, error, message):
    with pytest.raises(error, match=message):
        read_csv(write(tmp_path / "a.csv", text), CsvMap(COLUMNS))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[columns]\ntime = "t"\nx = "x"\ny = "y"\n', "lacks yaw"),
        ('[columns]\ntime = 3\nx = "x"\ny = "y"\nyaw = "a"\n', "expected a string"),
        ('[columns]\ntime = "t"\nx = "x"\ny = "y"\nyaw = "a"\n[pose]\nlever = 1\n', "unknown key"),
    ],
)
def test_column_maps_are_checked_with_messages_that_name_the_key(tmp_path, text, message):
    with pytest.raises(InvalidFile, match=message):
        read_csv_map(write(tmp_path / "columns.toml", text))


def test_the_command_writes_a_log_that_run_takes(tmp_path):
    t_s = np.arange(400) * 0.01
    pl.DataFrame({"t": t_s, "px": t_s, "py": 0 * t_s, "psi": 0 * t_s}).write_csv(tmp_path / "drive.csv")
    write(tmp_path / "columns.toml", '[columns]\ntime="t"\nx="px"\ny="py"\nyaw="psi"\n[robot]\nalpha = 0.1\n')
    args = ["convert", "drive.csv", "--map", "columns.toml", "--out", "drive.mcap"]
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, *args], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "400 rows" in done.stdout
    result = run_log(tmp_path / "drive.mcap", tmp_path / "out", timeline=False)
    assert result.summary["n_pose"] == 400
    assert '"alpha": 0.1' in result.summary["settings"]
    assert sorted(p.name for p in tmp_path.glob("*drive*")) == ["drive.csv", "drive.mcap"]


def sideslip_deg(samples):
    """Speed and sideslip of N at each row, by a centred smoother over .25 s: not causal, and not ours."""
    t_s = samples["t_s"].to_numpy()
    grid = np.arange(0.0, t_s[-1], 0.01)
    x, y, yaw = (np.interp(grid, t_s, samples[name].to_numpy()) for name in ("x_m", "y_m", "yaw_rad"))
    v_x, v_y = (savgol_filter(z, 25, 3, deriv=1, delta=0.01) for z in (x, y))
    yaw = savgol_filter(yaw, 25, 3)
    v_long, v_lat = v_x * np.cos(yaw) + v_y * np.sin(yaw), v_y * np.cos(yaw) - v_x * np.sin(yaw)
    v_long, v_lat = np.interp(t_s, grid, v_long), np.interp(t_s, grid, v_lat)
    return np.hypot(v_long, v_lat), np.degrees(np.arctan2(np.abs(v_lat), np.abs(v_long)))


@pytest.fixture(scope="module")
def dart(tmp_path_factory):
    """Samples of a DART file: by part of its name and least sideslip."""
    directory = tmp_path_factory.mktemp("dart")

    def samples(part, min_sideslip):
        (file,) = DART.glob(f"*/*{part}*.csv")
        log = directory / f"{part}.mcap"
        csv_map = read_csv_map(ROOT / "docs" / "examples" / "dart.toml")
        write_mcap(read_csv(file, csv_map).log, log)
        settings = Settings(min_sideslip=min_sideslip)
        result = run_log(log, directory / "out", settings=settings, timeline=False)
        return pl.read_parquet(result.files["samples"]), result.summary

    return samples


@needs_dart
@pytest.mark.parametrize("part", ["18_13_59", "18_15_50"])
def test_a_drifting_car_skids_wherever_its_sideslip_is_large(dart, part):
    samples, _ = dart(part, None)
    speed, sideslip = sideslip_deg(samples)
    warm = (samples["status"] != "warming_up").to_numpy()
    skids = (samples["mode"] == 1).to_numpy()
    large, small = warm & (speed > 0.3) & (sideslip > 15), warm & (speed > 0.3) & (sideslip < 8)
    assert np.count_nonzero(large) > 900
    assert np.mean(skids[large]) > 0.98
    assert np.mean(skids[small]) < 0.15
    assert np.mean(skids[warm & (speed < 0.1)]) < 0.05


@needs_dart
def test_a_gripping_car_never_skids_by_default_as_its_tyres_elastic_sideslip_is_allowed_for(dart):
    samples, summary = dart("15_46_50", None)
    speed, sideslip = sideslip_deg(samples)
    assert np.percentile(sideslip[speed > 0.3], 95) < 6
    assert summary["share_skidding"] < 0.001
    assert (summary["n_pose_jumps"], summary["n_outliers"]) == (0, 0)
    strict, _ = dart("15_46_50", 0.0)
    moving = speed > 0.3
    skids = (strict["mode"] == 1).to_numpy()
    v_lat, sd = strict["v_lat_mps"].abs().to_numpy(), strict["v_lat_mps_sd"].to_numpy()
    assert np.mean(skids[moving]) > 0.4  # 3° of sideslip do break C_k = 0 …
    assert np.mean(skids[moving & (v_lat > 3 * sd)]) > 0.98  # … where they exceed what the pose's noise,
    assert not skids[moving & (v_lat < 3 * sd)].any()  # correlated in time, leaves open


@needs_dart
def test_without_torques_slipping_is_neither_claimed_nor_excluded(dart):
    samples, _ = dart("18_13_59", None)
    assert not samples["mode"].is_in([0, 2]).any()
    still = samples.filter(pl.col("status") == "no_torque")
    assert (still["mode_set"] & 0b101 == 0b101).all()
