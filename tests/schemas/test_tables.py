"""The result tables against the documented names, written out by hand, and as polars frames."""

from pathlib import Path

import polars as pl
import pytest

from wmr_schemas import tables
from wmr_schemas.status import STATUS_MEANING, Status
from wmr_schemas.tables import Column, polars_schema
from wmr_synth.truth import TRUTH_SCHEMA

DOCUMENTED_SAMPLES = """
t_ns t_s x_m y_m yaw_rad
v_long_mps v_long_mps_sd v_lat_mps v_lat_mps_sd yaw_rate_radps yaw_rate_radps_sd
a_long_mps2 a_long_mps2_sd yaw_acc_radps2 yaw_acc_radps2_sd
delay_s sigma_sum_mps sigma_diff_mps c_k_mps c_k_mps_sd c_d_mps2 c_d_mps2_sd
mode p_ideal p_skidding p_slipping p_skidding_slipping mode_set alpha alpha_sd status mode_true
""".split()
NOT_FLOAT = {"t_ns": pl.Int64, "mode": pl.Int8, "mode_set": pl.UInt8, "mode_true": pl.Int8}
DOCUMENTED_SEGMENTS = "start_ns end_ns start_s end_s duration_s mode mean_p alpha alpha_sd n_samples".split()
DOCUMENTED_SUMMARY = """
log log_sha256 version settings duration_s n_pose n_torque rate_hz
share_ideal share_skidding share_slipping share_skidding_slipping share_undecided alpha alpha_sd
accuracy decided_share accuracy_decided recall_ideal recall_skidding recall_slipping recall_skidding_slipping
median_detection_delay_s p95_detection_delay_s missed_switches false_alarms_per_hour brier ece alpha_error
""".split()
DOCUMENTED_HINDSIGHT = """
t_ns t_s x_m y_m yaw_rad v_long_mps v_long_mps_sd v_lat_mps v_lat_mps_sd yaw_rate_radps yaw_rate_radps_sd
a_long_mps2 a_long_mps2_sd yaw_acc_radps2 yaw_acc_radps2_sd
mode p_ideal p_skidding p_slipping p_skidding_slipping mode_set alpha alpha_sd status mode_true
""".split()
HINDSIGHT_SCORES = """
hindsight_accuracy hindsight_decided_share hindsight_accuracy_decided hindsight_brier hindsight_ece
hindsight_share_ideal hindsight_share_skidding hindsight_share_slipping hindsight_share_skidding_slipping
hindsight_share_undecided
""".split()
ALL_TABLES = {
    name: getattr(tables, name)
    for name in ("SAMPLES", "HINDSIGHT", "SEGMENTS", "SUMMARY", "CONFUSION", "TRUTH")
}


def names(columns: tuple[Column, ...]) -> list[str]:
    return [column.name for column in columns]


def in_order(wanted: list[str], found: list[str]) -> bool:
    """Whether ``wanted`` stands in ``found`` in this order, further columns between them allowed."""
    rest = iter(found)
    return all(name in rest for name in wanted)


def test_samples_hold_the_documented_columns_in_order() -> None:
    assert in_order(DOCUMENTED_SAMPLES, names(tables.SAMPLES))


def test_sample_columns_are_float64_unless_documented_otherwise() -> None:
    others = {column.name: column.dtype for column in tables.SAMPLES if column.dtype != pl.Float64}
    assert others == {**NOT_FLOAT, "status": pl.Enum([status.label for status in Status])}


def test_segments_hold_the_documented_columns() -> None:
    assert names(tables.SEGMENTS) == DOCUMENTED_SEGMENTS


def test_the_summary_holds_the_documented_columns_and_every_anomaly() -> None:
    found = names(tables.SUMMARY)
    assert in_order(DOCUMENTED_SUMMARY, found)
    learnt = names(tables.LEARNT_OF_WHEELS)
    further = {*names(tables.ANOMALIES), *HINDSIGHT_SCORES, *learnt, "verdict", "notes", "findings"}
    assert set(found) - set(DOCUMENTED_SUMMARY) == further
    assert in_order(HINDSIGHT_SCORES, found)


def test_hindsight_holds_the_documented_columns_in_order() -> None:
    assert names(tables.HINDSIGHT) == DOCUMENTED_HINDSIGHT


def test_the_confusion_table_has_three_columns() -> None:
    assert names(tables.CONFUSION) == ["mode_true", "mode", "seconds"]


def test_the_simulator_writes_the_documented_side_file() -> None:
    assert polars_schema(tables.TRUTH) == TRUTH_SCHEMA


def test_statuses_are_the_documented_ones_in_their_order() -> None:
    documented = (
        "ok warming_up gap no_torque not_excited not_turning pose_not_independent pose_jump outlier "
        "clocks_apart no_heading rate_too_low implausible other_drive"
    )
    assert [status.label for status in Status] == documented.split()
    assert list(tables.STATUS_DTYPE.categories) == documented.split()


def test_every_status_is_explained() -> None:
    assert list(STATUS_MEANING) == list(Status)


@pytest.mark.parametrize("columns", ALL_TABLES.values(), ids=ALL_TABLES.keys())
def test_a_frame_with_each_schema_can_be_built_and_written(
    columns: tuple[Column, ...], tmp_path: Path
) -> None:
    schema = polars_schema(columns)
    frame = pl.DataFrame({name: [None, None] for name in schema}, schema=schema)
    frame.write_parquet(tmp_path / "table.parquet")
    assert pl.read_parquet(tmp_path / "table.parquet").schema == schema
    assert list(schema) == names(columns)


@pytest.mark.parametrize("columns", ALL_TABLES.values(), ids=ALL_TABLES.keys())
def test_columns_are_named_once_and_each_says_what_it_means(columns: tuple[Column, ...]) -> None:
    assert len(set(names(columns))) == len(columns)
    assert all(column.meaning and column.unit for column in columns)


@pytest.mark.parametrize("columns", ALL_TABLES.values(), ids=ALL_TABLES.keys())
def test_the_unit_in_a_name_is_the_unit_in_the_table(columns: tuple[Column, ...]) -> None:
    units = {"ns": "ns", "s": "s", "m": "m", "rad": "rad", "mps": "m/s", "radps": "rad/s"}
    units |= {"mps2": "m/s²", "radps2": "rad/s²", "hz": "Hz"}
    for column in columns:
        suffix = column.name.removesuffix("_sd").rpartition("_")[2]
        assert column.unit == units.get(suffix, column.unit), column.name


def test_an_unknown_status_cannot_enter_the_table() -> None:
    with pytest.raises(pl.exceptions.PolarsError):
        pl.Series(["tired"], dtype=tables.STATUS_DTYPE)
