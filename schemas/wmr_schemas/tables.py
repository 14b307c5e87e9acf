"""The result tables: every column with its type, unit and meaning.

The documentation pages are made from these lists, and a test holds every written table against them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import polars as pl

from wmr_schemas.modes import MODES
from wmr_schemas.status import Status

STATUS_DTYPE = pl.Enum([status.label for status in Status])


@dataclass(frozen=True)
class Column:
    """One column of a result table."""

    name: str
    dtype: type[pl.DataType] | pl.DataType
    unit: str
    meaning: str


def _real(name: str, unit: str, meaning: str) -> Column:
    return Column(name, pl.Float64, unit, meaning)


def _count(name: str, meaning: str) -> Column:
    return Column(name, pl.Int64, "–", meaning)


def _with_sd(name: str, unit: str, meaning: str) -> tuple[Column, Column]:
    return _real(name, unit, meaning), _real(f"{name}_sd", unit, f"standard deviation of {name}")


LEARNT_OF_WHEELS: tuple[Column, ...] = (
    *_with_sd("wheel_scale", "–", "true over nominal wheel speed, as learnt so far; from wheel speeds"),
    *_with_sd("effective_half_track_m", "m", "half track that the turning shows; from wheel speeds"),
    *_with_sd("icr_offset_m", "m", "x of the centre of rotation: v_lat = −x·yaw_rate; from wheel speeds"),
)
WHEEL_ESTIMATES: tuple[Column, ...] = (
    *_with_sd("slip_left_mps", "m/s", "left wheel's speed minus the ground's; from wheel speeds alone"),
    *_with_sd("slip_right_mps", "m/s", "right wheel's speed minus the ground's; from wheel speeds alone"),
    *_with_sd("slip_ratio_left", "–", "slip over the larger of wheel and ground speed; null near standstill"),
    *_with_sd("slip_ratio_right", "–", "the same on the right"),
    *LEARNT_OF_WHEELS,
)
"""What wheel speeds tell where no torque is known; null elsewhere."""

SAMPLES: tuple[Column, ...] = (
    Column(
        "t_ns", pl.Int64, "ns", "stamp of the pose sample (header stamp, since the epoch of the log's clock)"
    ),
    _real("t_s", "s", "seconds since the first pose sample"),
    _real("x_m", "m", "measured position of N, world x"),
    _real("y_m", "m", "measured position of N, world y"),
    _real("yaw_rad", "rad", "measured yaw, unwrapped, counter-clockwise from the world's x axis"),
    *_with_sd("v_long_mps", "m/s", "longitudinal velocity at t − delay_s, forward positive"),
    *_with_sd("v_lat_mps", "m/s", "lateral velocity at t − delay_s, left positive"),
    *_with_sd("yaw_rate_radps", "rad/s", "yaw rate at t − delay_s"),
    *_with_sd("a_long_mps2", "m/s²", "dv_long/dt at t − delay_s"),
    *_with_sd("yaw_acc_radps2", "rad/s²", "yaw acceleration at t − delay_s"),
    _real("delay_s", "s", "the derivative columns of the row describe the instant t − delay_s"),
    _real(
        "sigma_sum_mps",
        "m/s",
        "mean slip velocity of the two wheels (−σ₂): faster than the ground positive; from wheel speeds",
    ),
    _real(
        "sigma_diff_mps",
        "m/s",
        "difference slip velocity, right minus left (−σ₁); from wheel speeds and half track",
    ),
    *WHEEL_ESTIMATES,
    *_with_sd("c_k_mps", "m/s", "the kinematic constraint C_k = −v_lat; 0 unless the robot skids"),
    *_with_sd(
        "c_d_mps2",
        "m/s²",
        "the dynamic constraint C_d = dv_long/dt − alpha·Σeffort, both in one window; 0 in ideal rolling",
    ),
    _real("c_k_threshold_mps", "m/s", "|C_k| above this is called skidding"),
    _real("c_d_threshold_mps2", "m/s²", "|C_d| above this is called slipping"),
    Column(
        "mode",
        pl.Int8,
        "–",
        "estimate, made at t, of the mode at t: −1 undecided, 0 ideal, 1 skidding, 2 slipping, 3 both",
    ),
    _real("p_ideal", "–", "posterior probability of ideal rolling"),
    _real("p_skidding", "–", "posterior probability of skidding"),
    _real("p_slipping", "–", "posterior probability of slipping"),
    _real("p_skidding_slipping", "–", "posterior probability of both at once; null when not enabled"),
    Column("mode_set", pl.UInt8, "–", "bit k set: mode k is not excluded"),
    *_with_sd("alpha", "(m/s²)/(N·m)", "estimate of α from the data up to t"),
    Column("status", STATUS_DTYPE, "–", "why the row says what it says"),
    Column("mode_true", pl.Int8, "–", "true mode; null without truth"),
)

SEGMENTS: tuple[Column, ...] = (
    Column("start_ns", pl.Int64, "ns", "stamp of the segment's first row"),
    Column(
        "end_ns", pl.Int64, "ns", "stamp of the next segment's first row; of its own last row for the last"
    ),
    _real("start_s", "s", "start_ns in seconds since the log's first sample"),
    _real("end_s", "s", "end_ns in seconds since the log's first sample"),
    _real("duration_s", "s", "end − start"),
    Column("mode", pl.Int8, "–", "the estimated mode that all rows of the segment share"),
    _real("mean_p", "–", "mean posterior of that mode; null when undecided"),
    _real("alpha", "(m/s²)/(N·m)", "α at the segment's last row"),
    _real("alpha_sd", "(m/s²)/(N·m)", "its standard deviation"),
    _count("n_samples", "rows in the segment"),
)

HINDSIGHT: tuple[Column, ...] = (
    Column("t_ns", pl.Int64, "ns", "stamp of the pose sample, as in the samples table"),
    _real("t_s", "s", "seconds since the first pose sample"),
    _real("x_m", "m", "smoothed position of N, world x; jumps of the pose are taken out"),
    _real("y_m", "m", "smoothed position of N, world y"),
    _real("yaw_rad", "rad", "smoothed yaw, unwrapped"),
    *_with_sd("v_long_mps", "m/s", "longitudinal velocity at t, forward positive"),
    *_with_sd("v_lat_mps", "m/s", "lateral velocity at t, left positive"),
    *_with_sd("yaw_rate_radps", "rad/s", "yaw rate at t"),
    *_with_sd("a_long_mps2", "m/s²", "dv_long/dt at t"),
    *_with_sd("yaw_acc_radps2", "rad/s²", "yaw acceleration at t"),
    Column(
        "mode",
        pl.Int8,
        "–",
        "mode at t as the log up to t + lag shows it: −1 undecided, 0 ideal, 1 skidding, 2 slipping, 3 both",
    ),
    _real("p_ideal", "–", "smoothed posterior probability of ideal rolling"),
    _real("p_skidding", "–", "smoothed posterior probability of skidding"),
    _real("p_slipping", "–", "smoothed posterior probability of slipping"),
    _real("p_skidding_slipping", "–", "smoothed posterior probability of both; null when not enabled"),
    Column("mode_set", pl.UInt8, "–", "bit k set: mode k is not excluded"),
    *_with_sd("alpha", "(m/s²)/(N·m)", "α from the whole log, as it holds at t + lag"),
    Column("status", STATUS_DTYPE, "–", "why the row says what it says"),
    Column("mode_true", pl.Int8, "–", "true mode; null without truth"),
)
"""``<stem>.hindsight.parquet``: what the recording as a whole says about every moment. Not causal."""

CONFUSION: tuple[Column, ...] = (
    Column("mode_true", pl.Int8, "–", "true mode"),
    Column("mode", pl.Int8, "–", "estimated mode"),
    _real("seconds", "s", "time in which the two met, after warm-up"),
)

ANOMALIES: tuple[Column, ...] = (
    _count("n_pose_duplicate", "pose rows left out: a stamp that the channel had already"),
    _count("n_pose_backward", "pose rows left out: stamped before a row already used"),
    _count("n_pose_not_finite", "pose rows left out: NaN, infinity or a zero quaternion"),
    _count("n_torque_duplicate", "torque rows left out: a stamp that the channel had already"),
    _count("n_torque_backward", "torque rows left out: stamped before a row already used"),
    _count("n_torque_empty", "torque messages without an effort"),
    _count("n_undecodable", "messages of the channels in use that could not be decoded"),
    _count("n_chunks_damaged", "chunks left out: bad checksum, unknown compression, unreadable"),
    Column("truncated", pl.Boolean, "–", "the file ends inside a record or without its closing magic"),
    _count("n_gaps", "holes in the pose that restarted the window"),
    _count("n_pose_jumps", "jumps of the pose that restarted the window"),
    _count("n_outliers", "pose rows set aside as outliers"),
)

SUMMARY: tuple[Column, ...] = (
    Column("log", pl.String, "–", "the log's path as given"),
    Column("log_sha256", pl.String, "–", "hash of the file; null when it was read from a URL"),
    Column("version", pl.String, "–", "version of wmr-replay"),
    Column("settings", pl.String, "–", "JSON, enough to repeat the run"),
    _real("duration_s", "s", "last minus first pose stamp"),
    _count("n_pose", "pose rows used"),
    _count("n_torque", "torque rows used"),
    _real("rate_hz", "Hz", "pose rate, from the median step of the initial stretch"),
    *ANOMALIES,
    _real("share_ideal", "–", "share of the rows estimated ideal"),
    _real("share_skidding", "–", "share estimated skidding"),
    _real("share_slipping", "–", "share estimated slipping"),
    _real("share_skidding_slipping", "–", "share estimated both at once"),
    _real("share_undecided", "–", "share undecided"),
    *_with_sd("alpha", "(m/s²)/(N·m)", "last estimate of α"),
    *LEARNT_OF_WHEELS,
    _real("accuracy", "–", "share of rows after warm-up whose mode is the true one; −1 counts as wrong"),
    _real("decided_share", "–", "share of rows after warm-up with a mode"),
    _real("accuracy_decided", "–", "accuracy over those"),
    *(
        _real(f"recall_{mode.label}", "–", f"share of truly {mode.label} rows found; null without any")
        for mode in MODES
    ),
    _real("median_detection_delay_s", "s", "from a true switch to the first estimate that then holds .2 s"),
    _real("p95_detection_delay_s", "s", "its 95th percentile"),
    _count("missed_switches", "true switches not detected before the next"),
    _real("false_alarms_per_hour", "1/h", "estimated switches with no true one within the preceding 2 s"),
    _real("brier", "–", "Brier score of the posterior"),
    _real("ece", "–", "expected calibration error, 10 bins"),
    _real("alpha_error", "–", "relative error of the last α against the truth (side file)"),
    _real("hindsight_accuracy", "–", "accuracy of the hindsight table, over its rows behind the warm-up"),
    _real("hindsight_decided_share", "–", "share of those rows with a mode in hindsight"),
    _real("hindsight_accuracy_decided", "–", "accuracy over those"),
    _real("hindsight_brier", "–", "Brier score of the smoothed posterior"),
    _real("hindsight_ece", "–", "its expected calibration error, 10 bins"),
    *(
        _real(f"hindsight_share_{label}", "–", f"share of the rows {label} in hindsight")
        for label in (*(mode.label for mode in MODES), "undecided")
    ),
    Column("verdict", pl.String, "–", "the result in a sentence or two"),
    Column("notes", pl.String, "–", "JSON list of what was noticed: losses, clocks, what was left out"),
    Column("findings", pl.String, "–", "JSON list of findings on the data's quality, by code"),
)


GAP_TRACES: tuple[Column, ...] = (
    Column("t_ns", pl.Int64, "ns", "stamp of the row: the centre of a short bin of poses"),
    _real("t_s", "s", "seconds since the first pose sample"),
    Column("mode", pl.Int8, "–", "contact mode with which the row was analysed"),
    Column("held_out", pl.Boolean, "–", "whether the row was held out: not fitted"),
    _real("x_m", "m", "measured position of N, world x, mean of the bin"),
    _real("y_m", "m", "measured position of N, world y"),
    _real("yaw_rad", "rad", "measured yaw, unwrapped"),
    *(
        column
        for model, words in (("base", "the base model"), ("extended", "the extended model"))
        for column in (
            _real(f"{model}_x_m", "m", f"x as {words} simulates it, in windows of 4 s from a fitted start"),
            _real(f"{model}_y_m", "m", f"y as {words} simulates it"),
            _real(f"{model}_yaw_rad", "rad", f"yaw as {words} simulates it"),
            _real(f"{model}_error_m", "m", f"distance from the measured position, {words}"),
            _real(f"{model}_error_yaw_rad", "rad", f"measured minus simulated yaw, {words}"),
            _real(f"{model}_residual_longitudinal", "m/s²", f"what {words} leaves of dv_long/dt, filtered"),
            _real(f"{model}_residual_lateral", "m/s", f"lateral velocity that {words} leaves, filtered"),
            _real(f"{model}_residual_yaw", "m/s²", f"what {words} leaves of l·yaw_acc, filtered"),
        )
    ),
    _real("v_mps", "m/s", "longitudinal velocity, smoothed over .7 s"),
    _real("v_lat_mps", "m/s", "lateral velocity, smoothed"),
    _real("yaw_rate_radps", "rad/s", "yaw rate, smoothed"),
    _real("effort_sum_nm", "N·m", "sum of the torques, mean over the bin"),
    _real("effort_diff_nm", "N·m", "right minus left torque"),
    _real("effort_sum_rate_nmps", "N·m/s", "rate of change of the torques' sum"),
)
"""``<stem>.gap_traces.parquet``: what the report of a gap analysis is drawn from."""

TRUTH: tuple[Column, ...] = (
    Column("t_ns", pl.Int64, "ns", "stamp of the logged pose sample"),
    _real("x_m", "m", "position of N without noise, world x"),
    _real("y_m", "m", "position of N without noise, world y"),
    _real("yaw_rad", "rad", "yaw without noise, unwrapped"),
    _real("v_long_mps", "m/s", "longitudinal velocity"),
    _real("v_lat_mps", "m/s", "lateral velocity, left positive"),
    _real("yaw_rate_radps", "rad/s", "yaw rate"),
    _real("a_long_mps2", "m/s²", "dv_long/dt"),
    _real("yaw_acc_radps2", "rad/s²", "yaw acceleration"),
    _real("sigma_sum_mps", "m/s", "mean slip velocity of the two wheels (−σ₂)"),
    _real("sigma_diff_mps", "m/s", "difference slip velocity, right minus left (−σ₁)"),
    _real("effort_left_nm", "N·m", "torque of the left wheel"),
    _real("effort_right_nm", "N·m", "torque of the right wheel"),
    Column("mode", pl.Int8, "–", "contact mode"),
)
"""``<stem>.truth.parquet``, the simulator's side file."""


def polars_schema(columns: tuple[Column, ...]) -> pl.Schema:
    """The polars schema of a table, in the order of its columns."""
    return pl.Schema({column.name: column.dtype for column in columns})


def driven_by(row: Mapping[str, Any]) -> str:
    """What the rows of input hold, by the summary's row: torques, or wheel speeds without any."""
    empty = row["n_torque"] and row.get("n_torque_empty") == row["n_torque"]
    return "wheel speeds" if empty or row.get("wheel_scale") is not None else "torques"


def counted_anomalies(row: Mapping[str, Any]) -> list[tuple[int, str]]:
    """Number and meaning of every anomaly that a summary's row counts, but for ``truncated``.

    Where wheel speeds serve, an effort that is not recorded is none.
    """
    expected = {"truncated"} if driven_by(row) == "torques" else {"truncated", "n_torque_empty"}
    return [(row[c.name], c.meaning) for c in ANOMALIES if row[c.name] and c.name not in expected]
