"""The Rerun recording: content, independence of the batches, and appearance. The samples are made up."""

import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
import pytest
from rerun.chunk import RrdReader

from wmr_replay.timeline.writer import Timeline
from wmr_schemas.findings import Severity, finding
from wmr_schemas.modes import MODES
from wmr_schemas.tables import SAMPLES, polars_schema

Floats = npt.NDArray[np.float64]

DELAY_S = 0.4
START_NS = 1_700_000_000_000_000_000
ALPHA = 0.0255
SWITCHES_S = (0.0, 12.0, 22.0, 34.0, 44.0, 52.0)
TRUE_MODES = (0, 1, 2, 1, 0, 3)


def true_state(rate_hz: float, duration_s: float = 60.0) -> pl.DataFrame:
    """The side file's columns: a wide slalom with lateral velocity while skidding."""
    t = np.arange(round(rate_hz * duration_s)) / rate_hz
    mode = np.array(TRUE_MODES, np.int8)[np.searchsorted(SWITCHES_S, t, side="right") - 1]
    v_long = 3 + 2 * np.sin(t / 9)
    yaw_rate = 0.35 * np.cos(t / 5)
    yaw = np.cumsum(yaw_rate) / rate_hz
    v_lat = np.where(mode % 2 == 1, -0.8 * np.sin(t / 2), 0.0)
    x = np.cumsum(v_long * np.cos(yaw) - v_lat * np.sin(yaw)) / rate_hz
    y = np.cumsum(v_long * np.sin(yaw) + v_lat * np.cos(yaw)) / rate_hz
    return pl.DataFrame(
        {
            "t_ns": START_NS + np.round(t * 1e9).astype(np.int64),
            "t_s": t,
            "x_m": x,
            "y_m": y,
            "yaw_rad": yaw,
            "v_long_mps": v_long,
            "v_lat_mps": v_lat,
            "yaw_rate_radps": yaw_rate,
            "mode": mode,
        }
    )


def samples(
    rate_hz: float, duration_s: float = 60.0, with_torque: bool = True, seed: int = 0
) -> pl.DataFrame:
    """What an identifier that is ``DELAY_S`` late would make of it; nothing is known in its first window."""
    truth, random = true_state(rate_hz, duration_s), np.random.default_rng(seed)
    n, late = len(truth), round(DELAY_S * rate_hz)
    described = np.maximum(np.arange(n) - late, 0)
    warming = np.arange(n) < 2 * late

    def known(values: Floats) -> Floats:
        return np.where(warming, np.nan, values)

    def estimate(column: str, sd: float) -> Floats:
        return known(truth[column].to_numpy()[described] + sd * random.standard_normal(n))

    v_lat = estimate("v_lat_mps", 0.04)
    true_mode = truth["mode"].to_numpy()
    late_mode = true_mode[described]
    slip = np.isin(late_mode, (2, 3)) * 0.9
    alpha_sd = 0.02 / np.sqrt(1 + np.arange(n) / rate_hz)
    torque = float("nan") if not with_torque else 1.0
    columns = {
        "t_ns": truth["t_ns"],
        "t_s": truth["t_s"],
        "x_m": truth["x_m"] + 0.05 * random.standard_normal(n),
        "y_m": truth["y_m"] + 0.05 * random.standard_normal(n),
        "yaw_rad": truth["yaw_rad"] + 0.01 * random.standard_normal(n),
        "v_long_mps": estimate("v_long_mps", 0.05),
        "v_lat_mps": v_lat,
        "yaw_rate_radps": estimate("yaw_rate_radps", 0.02),
        "delay_s": np.full(n, DELAY_S),
        "c_k_mps": -v_lat,
        "c_k_threshold_mps": known(np.full(n, 0.16)),
        "c_d_mps2": known(slip + 0.08 * random.standard_normal(n)) * torque,
        "c_d_threshold_mps2": known(np.full(n, 0.3)) * torque,
        "mode": np.where(warming, -1, late_mode).astype(np.int8),
        "alpha": known(ALPHA * (1 + 0.3 * np.exp(-np.arange(n) / (5 * rate_hz)))) * torque,
        "alpha_sd": known(0.2 * alpha_sd) * torque,
        **{f"p_{mode.label}": known(np.where(late_mode == k, 0.9, 0.05)) for k, mode in enumerate(MODES[:3])},
        "status": np.where(warming, "warming_up", "ok" if with_torque else "no_torque"),
        "mode_true": true_mode,
    }
    schema = polars_schema(SAMPLES)
    table = pl.DataFrame(columns).with_columns(pl.col(pl.Float64).fill_nan(None))
    missing = [pl.lit(None, dtype).alias(name) for name, dtype in schema.items() if name not in columns]
    return table.with_columns(missing).select(pl.col(name).cast(dtype) for name, dtype in schema.items())


def torques(table: pl.DataFrame) -> pl.DataFrame:
    """Left and right wheel torque, 50 times a second."""
    t_s = pl.col("t_s")
    wheels = {"left_nm": 4 + 2 * (t_s / 3).sin(), "right_nm": 4 + 2 * (t_s / 5).sin()}
    return table.gather_every(4).select("t_ns", **wheels)


def timeline_at(path: Path, rate_hz: float, **options: Any) -> Timeline:
    """An empty recording."""
    return Timeline(
        path, log_name="drive.mcap", alpha_nominal=ALPHA, rate_hz=rate_hz, recording_id="drive", **options
    )


def write(
    path: Path,
    table: pl.DataFrame,
    rate_hz: float,
    batch: int = 10_000,
    truth: pl.DataFrame | None = None,
    torque: pl.DataFrame | None = None,
    findings: Sequence[Mapping[str, Any]] = (),
) -> Path:
    """A recording of ``table``, pushed in batches of ``batch`` rows."""
    known = None if torque is None else lambda: torque
    timeline = timeline_at(path, rate_hz, truth=truth, torque=known)
    for start in range(0, len(table), batch):
        timeline.push(table[start : start + batch])
    timeline.finish("**ideal** most of the time", findings)
    return path


def rerun(*arguments: str) -> int:
    """Exit code of Rerun's own tool."""
    command = [str(Path(sys.executable).with_name("rerun")), "rrd", *arguments]
    return subprocess.run(command, capture_output=True, check=False).returncode


def contents(path: Path) -> dict[str, pl.DataFrame]:
    """The temporal rows of every entity, without Rerun's row ids, each with ``log_t`` in ns."""
    tables: dict[str, list[pl.DataFrame]] = {}
    for chunk in RrdReader(path).stream():
        if not chunk.is_static:
            batch = chunk.to_record_batch().drop_columns(["rerun.controls.RowId"])
            tables.setdefault(chunk.entity_path, []).append(pl.from_arrow(batch))  # type: ignore[arg-type]
    return {entity: pl.concat(parts) for entity, parts in tables.items()}


def scalars(table: pl.DataFrame) -> Floats:
    """The numbers of one series, (n, lines)."""
    return np.array(table["Scalars:scalars"].to_list())


def since_start_ns(table: pl.DataFrame) -> npt.NDArray[np.int64]:
    return table["log_t"].cast(pl.Int64).to_numpy()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("timeline") / "drive.rrd"
    table = samples(200.0)
    return write(path, table, 200.0, truth=true_state(200.0), torque=torques(table))


def test_rerun_verifies_the_file_and_nothing_else_is_left(recorded: Path) -> None:
    assert rerun("verify", str(recorded)) == 0
    assert list(recorded.parent.iterdir()) == [recorded]


def test_documented_entities_are_there_with_the_expected_rows(recorded: Path) -> None:
    rows = {entity: len(table) for entity, table in contents(recorded).items()}
    drawn, known = 6000, 6000 - 80  # 60 s at 100 Hz; two delays of 0.4 s warm up
    slow = 1200 - 16  # the same at 20 Hz
    assert rows == {
        **dict.fromkeys(("/pose/x_m/measured", "/pose/y_m/measured", "/pose/yaw_rad/measured"), drawn),
        **{"/path/robot": 1200, "/path/robot/velocity": 600, "/pose/yaw_rad/true": drawn},
        **{f"/velocity/{name}/true": drawn for name in ("v_long_mps", "v_lat_mps", "yaw_rate_radps")},
        **{f"/velocity/{name}/estimate": known for name in ("v_long_mps", "v_lat_mps", "yaw_rate_radps")},
        **{f"/constraint/{name}/estimate": known for name in ("c_k_mps", "c_d_mps2")},
        **{f"/constraint/{name}/threshold": slow for name in ("c_k_mps", "c_d_mps2")},
        **{"/posterior": known, "/torque": 3000},
        **{"/alpha/estimate": slow, "/alpha/band": slow, "/alpha/nominal": 2},
        **{"/mode/estimated": 7, "/mode/true": 6, "/status": 2, "/path/estimated": 7, "/path/true": 1},
    }


def test_every_temporal_row_lies_on_both_timelines(recorded: Path) -> None:
    for table in contents(recorded).values():
        stamps = table["stamp"].cast(pl.Int64).to_numpy()
        np.testing.assert_array_equal(stamps - START_NS, since_start_ns(table))


def test_mode_changes_lie_at_their_exact_rows(tmp_path: Path) -> None:
    table = samples(1000.0, 20.0).with_columns(
        mode=pl.when(pl.col("t_ns") < START_NS + 7_003_000_000).then(0).otherwise(2).cast(pl.Int8)
    )
    lane = contents(write(tmp_path / "a.rrd", table, 1000.0, batch=777))["/mode/estimated"]
    assert lane["StateChange:state"].to_list() == [["ideal"], ["slipping"]]
    assert since_start_ns(lane).tolist() == [0, 7_003_000_000]


@pytest.mark.parametrize("batch", [777, 100_000])
def test_the_lane_of_hindsight_begins_with_the_log_and_changes_at_its_exact_rows(
    tmp_path: Path, batch: int
) -> None:
    """Samples of a short log are still held when hindsight begins: the zero of the timeline is theirs."""
    table = samples(1000.0, 20.0)
    later = table.with_columns(
        mode=pl.when(pl.col("t_ns") < START_NS + 7_003_000_000).then(0).otherwise(2).cast(pl.Int8)
    )
    timeline = Timeline(tmp_path / "a.rrd", log_name="drive.mcap", alpha_nominal=ALPHA, rate_hz=1000.0)
    for part in table.iter_slices(batch):
        timeline.push(part)
    for part in later.iter_slices(batch):
        timeline.push_hindsight(part)
    timeline.finish("")
    held = contents(tmp_path / "a.rrd")
    assert held["/mode/hindsight"]["StateChange:state"].to_list() == [["ideal"], ["slipping"]]
    assert since_start_ns(held["/mode/hindsight"]).tolist() == [0, 7_003_000_000]
    assert len(held["/path/robot"]) == 400
    assert since_start_ns(held["/mode/estimated"])[0] == 0


def test_velocities_lie_at_the_instant_that_they_describe_and_alpha_at_the_time_known(recorded: Path) -> None:
    held, table = contents(recorded), samples(200.0)[::2].filter(pl.col("alpha").is_not_null())
    for entity, every, delay_ns, column in (
        ("/velocity/v_lat_mps/estimate", 1, 400_000_000, "v_lat_mps"),
        ("/constraint/c_k_mps/estimate", 1, 400_000_000, "c_k_mps"),
        ("/alpha/estimate", 5, 0, "alpha"),
    ):
        rows = table[::every]
        np.testing.assert_array_equal(since_start_ns(held[entity]), rows["t_ns"] - START_NS - delay_ns)
        np.testing.assert_array_equal(scalars(held[entity])[:, 0], rows[column].to_numpy())


def test_band_and_thresholds_are_pairs_of_lines(recorded: Path) -> None:
    held, table = contents(recorded), samples(200.0)[::10].filter(pl.col("alpha").is_not_null())
    alpha, sd = table["alpha"].to_numpy(), table["alpha_sd"].to_numpy()
    np.testing.assert_allclose(
        scalars(held["/alpha/band"]), np.stack([alpha + 1.96 * sd, alpha - 1.96 * sd], 1)
    )
    np.testing.assert_array_equal(
        np.unique(scalars(held["/constraint/c_d_mps2/threshold"]), axis=0), [[0.3, -0.3]]
    )


@pytest.mark.parametrize("batch", [997, 70_000])
def test_batches_change_nothing(tmp_path: Path, batch: int) -> None:
    table, truth = samples(1000.0, 70.0), true_state(1000.0, 70.0)
    whole = write(tmp_path / "whole.rrd", table, 1000.0, len(table), truth)
    parts = write(tmp_path / "parts.rrd", table, 1000.0, batch, truth)
    assert rerun("compare", str(whole), str(parts)) == 0
    np.testing.assert_array_equal(
        since_start_ns(contents(parts)["/pose/x_m/measured"]), np.arange(7000) * 10_000_000
    )


def test_single_rows_may_be_pushed(tmp_path: Path) -> None:
    table = samples(50.0, 10.0)
    whole, single = write(tmp_path / "a.rrd", table, 50.0), write(tmp_path / "b.rrd", table, 50.0, batch=1)
    assert rerun("compare", str(whole), str(single)) == 0
    other = write(tmp_path / "c.rrd", samples(50.0, 10.0, seed=1), 50.0)
    assert rerun("compare", str(whole), str(other)) == 1


def test_a_hole_breaks_a_line_once(tmp_path: Path) -> None:
    hole = pl.col("t_s").is_between(5.0, 6.0, closed="left")
    table = samples(100.0, 10.0).with_columns(v_long_mps=pl.when(~hole).then("v_long_mps"))
    drawn = scalars(contents(write(tmp_path / "a.rrd", table, 100.0))["/velocity/v_long_mps/estimate"])[:, 0]
    assert np.flatnonzero(np.isnan(drawn)).tolist() == [500 - 80]
    assert len(drawn) == 1000 - 80 - 100 + 1


def test_without_torque_and_truth_nothing_is_drawn_of_them(tmp_path: Path) -> None:
    table = samples(100.0, 10.0, with_torque=False).with_columns(mode_true=pl.lit(None, pl.Int8))
    path = write(tmp_path / "a.rrd", table, 100.0)
    assert rerun("verify", str(path)) == 0
    absent = {"/alpha/estimate", "/alpha/band", "/constraint/c_d_mps2/estimate", "/mode/true", "/path/true"}
    assert not absent & contents(path).keys()
    assert "/constraint/c_k_mps/estimate" in contents(path)


def test_wheel_speeds_give_slip_at_its_instant_and_what_was_learnt_when_it_was_known(tmp_path: Path) -> None:
    table = samples(100.0, 5.0, with_torque=False)
    ramp = np.linspace(1.0, 1.02, len(table))
    learnt = {"wheel_scale": ramp, "icr_offset_m": ramp - 1.0, "slip_left_mps": 10 * ramp}
    for name, value in learnt.items():
        values = pl.Series(value), pl.Series(np.full(len(table), 0.001))
        table = table.with_columns(values[0].alias(name), values[1].alias(f"{name}_sd"))
    write(tmp_path / "wheels.rrd", table, 100.0)
    found = contents(tmp_path / "wheels.rrd")
    slip, band = found["/slip/left/estimate"], scalars(found["/slip/left/band"])
    assert -since_start_ns(slip)[0] == pytest.approx(DELAY_S * 1e9, abs=1e6)
    assert np.ptp(band, axis=1) == pytest.approx(2 * 1.96 * 0.001, rel=1e-3)
    assert scalars(found["/learnt/wheel_scale/estimate"])[-1, 0] == pytest.approx(1.02, abs=1e-3)
    assert since_start_ns(found["/learnt/wheel_scale/estimate"])[0] >= 0
    assert scalars(found["/learnt/wheel_scale/stated"])[:, 0].tolist() == [1.0, 1.0]
    assert scalars(found["/learnt/icr_offset_m/stated"])[:, 0].tolist() == [0.0, 0.0]
    assert not {"/slip/right/estimate", "/torque", "/alpha/estimate"} & found.keys()


def test_an_empty_run_still_makes_a_valid_file(tmp_path: Path) -> None:
    path = write(tmp_path / "a.rrd", samples(100.0, 1.0)[:0], 100.0, truth=true_state(100.0, 1.0))
    assert rerun("verify", str(path)) == 0


def test_discard_leaves_nothing(tmp_path: Path) -> None:
    timeline = Timeline(tmp_path / "a.rrd", log_name="a", alpha_nominal=None, rate_hz=100.0)
    timeline.push(samples(100.0, 2.0))
    timeline.discard()
    timeline.discard()
    assert list(tmp_path.iterdir()) == []


def test_discard_after_finish_keeps_the_file(tmp_path: Path) -> None:
    timeline = Timeline(tmp_path / "a.rrd", log_name="a", alpha_nominal=None, rate_hz=100.0)
    timeline.finish()
    timeline.discard()
    assert [path.name for path in tmp_path.iterdir()] == ["a.rrd"]


def test_findings_on_the_data_are_log_entries_where_they_begin(tmp_path: Path) -> None:
    timeline = Timeline(tmp_path / "a.rrd", log_name="a", alpha_nominal=None, rate_hz=100.0)
    timeline.push(samples(100.0, 20.0))
    frozen = finding("frozen_pose", Severity.BARS, "12 rows", 12, [(3.25, 4.0)])
    whole = finding("coloured_noise", Severity.WARNING, "a correlation time of .3 s")
    timeline.finish("nothing", [frozen.as_dict(), whole.as_dict()])
    entries = contents(tmp_path / "a.rrd")["/findings"].sort("log_t")
    assert entries["log_t"].cast(pl.Int64).to_list() == [0, 3_250_000_000]
    texts = [entry[0] for entry in entries["TextLog:text"].to_list()]
    assert texts == ["coloured_noise (see Verdict)", "frozen_pose (see Verdict)"]
    assert [entry[0] for entry in entries["TextLog:level"].to_list()] == ["WARN", "ERROR"]


def test_the_robot_is_where_it_was_measured_and_moves_as_estimated(recorded: Path) -> None:
    """Poses at 20 Hz at the time t, velocities in the robot's frame at 10 Hz at t − delay."""
    held, table = contents(recorded), samples(200.0)
    places = np.array([row[0] for row in held["/path/robot"]["Transform3D:translation"].to_list()])
    np.testing.assert_allclose(places[:, :2], table[::10].select("x_m", "y_m").to_numpy(), rtol=1e-6)
    turned = np.array([row[0] for row in held["/path/robot"]["Transform3D:quaternion"].to_list()])
    yaw = 2 * np.arctan2(turned[:, 2], turned[:, 3])
    np.testing.assert_allclose(np.cos(yaw), np.cos(table[::10]["yaw_rad"].to_numpy()), atol=1e-5)
    moving = held["/path/robot/velocity"].sort("log_t")
    arrows = np.array([row[0] for row in moving["Arrows2D:vectors"].to_list()])
    known = table[::20].select(pl.col("v_long_mps", "v_lat_mps").fill_null(0.0)).to_numpy()
    at_ns = table[::20]["t_ns"].to_numpy() - START_NS - 400_000_000
    np.testing.assert_array_equal(since_start_ns(moving), at_ns)
    np.testing.assert_allclose(arrows, known, rtol=1e-6)


def test_torques_that_become_known_later_are_appended_once(tmp_path: Path) -> None:
    table = samples(1000.0, 140.0)
    rows, known = torques(table), [0]
    timeline = timeline_at(tmp_path / "a.rrd", 1000.0, torque=lambda: rows[: known[0]])
    for start in range(0, len(table), 1000):
        known[0] = start // 4
        timeline.push(table[start : start + 1000])
    known[0] = len(rows)
    timeline.finish()
    drawn = contents(tmp_path / "a.rrd")["/torque"].sort("log_t")
    np.testing.assert_array_equal(since_start_ns(drawn), rows["t_ns"].to_numpy() - START_NS)
    np.testing.assert_array_equal(scalars(drawn), rows.select("left_nm", "right_nm").to_numpy())
