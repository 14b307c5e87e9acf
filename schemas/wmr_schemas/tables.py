"""The result tables: every column with its type, unit and meaning.

The documentation pages are made from these lists, and a test holds every written table against them.
"""

from dataclasses import dataclass
from enum import StrEnum

import polars as pl

from wmr_schemas.modes import MODES


class Status(StrEnum):
    """Why a row of ``samples`` says what it says; the first that applies, in this order of precedence."""

    OK = "ok"
    WARMING_UP = "warming_up"
    GAP = "gap"
    NO_TORQUE = "no_torque"
    NOT_EXCITED = "not_excited"
    NOT_TURNING = "not_turning"
    POSE_NOT_INDEPENDENT = "pose_not_independent"
    POSE_JUMP = "pose_jump"
    OUTLIER = "outlier"


STATUSES = tuple(Status)
STATUS_DTYPE = pl.Enum([status.value for status in STATUSES])


@dataclass(frozen=True)
class Column:
    """One column of a result table."""

    name: str
    dtype: type[pl.DataType] | pl.DataType
    unit: str
    meaning: str


def _with_sd(name: str, unit: str, meaning: str) -> tuple[Column, Column]:
    return Column(name, pl.Float64, unit, meaning), Column(f"{name}_sd", pl.Float64, unit, f"standard deviation of {name}")


SAMPLES: tuple[Column, ...] = (
    Column("t_ns", pl.Int64, "ns", "stamp of the pose sample (header stamp, since the epoch of the log's clock)"),
    Column("t_s", pl.Float64, "s", "seconds since the first pose sample"),
    Column("x_m", pl.Float64, "m", "measured position of N, world x"),
    Column("y_m", pl.Float64, "m", "measured position of N, world y"),
    Column("yaw_rad", pl.Float64, "rad", "measured yaw, unwrapped, counter-clockwise from the world's x axis"),
    *_with_sd("v_long_mps", "m/s", "longitudinal velocity at t − delay_s, forward positive"),
    *_with_sd("v_lat_mps", "m/s", "lateral velocity at t − delay_s, left positive"),
    *_with_sd("yaw_rate_radps", "rad/s", "yaw rate at t − delay_s"),
    *_with_sd("a_long_mps2", "m/s²", "dv_long/dt at t − delay_s"),
    *_with_sd("yaw_acc_radps2", "rad/s²", "yaw acceleration at t − delay_s"),
    Column("delay_s", pl.Float64, "s", "the derivative columns of the row describe the instant t − delay_s"),
    Column(
        "sigma_sum_mps", pl.Float64, "m/s", "mean slip velocity of the two wheels (−σ₂): wheels faster than the ground positive; from wheel speeds"
    ),
    Column(
        "sigma_diff_mps", pl.Float64, "m/s", "difference slip velocity, right minus left (−σ₁); from wheel speeds and half track"
    ),
    *_with_sd("c_k_mps", "m/s", "the kinematic constraint C_k = −v_lat; 0 unless the robot skids"),
    *_with_sd(
        "c_d_mps2", "m/s²", "the dynamic constraint C_d = dv_long/dt − alpha·Σeffort, torques through the same window; 0 in ideal rolling"
    ),
    Column("c_k_threshold_mps", pl.Float64, "m/s", "|C_k| above this is called skidding"),
    Column("c_d_threshold_mps2", pl.Float64, "m/s²", "|C_d| above this is called slipping"),
    Column("mode", pl.Int8, "–", "estimate, made at t, of the mode at t: −1 undecided, 0 ideal, 1 skidding, 2 slipping, 3 both"),
    Column("p_ideal", pl.Float64, "–", "posterior probability of ideal rolling"),
    Column("p_skidding", pl.Float64, "–", "posterior probability of skidding"),
    Column("p_slipping", pl.Float64, "–", "posterior probability of slipping"),
    Column("p_skidding_slipping", pl.Float64, "–", "posterior probability of both at once; null when not enabled"),
    Column("mode_set", pl.UInt8, "–", "bit k set: mode k is not excluded"),
    *_with_sd("alpha", "(m/s²)/(N·m)", "estimate of α from the data up to t"),
    Column("status", STATUS_DTYPE, "–", "why the row says what it says"),
    Column("mode_true", pl.Int8, "–", "true mode; null without truth"),
)

SEGMENTS: tuple[Column, ...] = (
    Column("start_ns", pl.Int64, "ns", "stamp of the segment's first row"),
    Column("end_ns", pl.Int64, "ns", "stamp of the next segment's first row; of its own last row for the last"),
    Column("duration_s", pl.Float64, "s", "end − start"),
    Column("mode", pl.Int8, "–", "the estimated mode that all rows of the segment share"),
    Column("mean_p", pl.Float64, "–", "mean posterior of that mode; null when undecided"),
    Column("alpha", pl.Float64, "(m/s²)/(N·m)", "α at the segment's last row"),
    Column("alpha_sd", pl.Float64, "(m/s²)/(N·m)", "its standard deviation"),
    Column("n_samples", pl.Int64, "–", "rows in the segment"),
)

CONFUSION: tuple[Column, ...] = (
    Column("mode_true", pl.Int8, "–", "true mode"),
    Column("mode", pl.Int8, "–", "estimated mode"),
    Column("seconds", pl.Float64, "s", "time in which the two met, after warm-up"),
)

ANOMALIES: tuple[Column, ...] = (
    Column("n_pose_duplicate", pl.Int64, "–", "pose rows left out: a stamp that the channel had already"),
    Column("n_pose_backward", pl.Int64, "–", "pose rows left out: stamped before a row already used"),
    Column("n_pose_not_finite", pl.Int64, "–", "pose rows left out: NaN, infinity or a zero quaternion"),
    Column("n_torque_duplicate", pl.Int64, "–", "torque rows left out: a stamp that the channel had already"),
    Column("n_torque_backward", pl.Int64, "–", "torque rows left out: stamped before a row already used"),
    Column("n_torque_empty", pl.Int64, "–", "torque messages without an effort"),
    Column("n_undecodable", pl.Int64, "–", "messages of the channels in use that could not be decoded"),
    Column("n_chunks_damaged", pl.Int64, "–", "chunks left out: bad checksum, unknown compression, unreadable"),
    Column("truncated", pl.Boolean, "–", "the file ends inside a record or without its closing magic"),
    Column("n_gaps", pl.Int64, "–", "holes in the pose that restarted the window"),
    Column("n_pose_jumps", pl.Int64, "–", "jumps of the pose that restarted the window"),
    Column("n_outliers", pl.Int64, "–", "pose rows set aside as outliers"),
)

SUMMARY: tuple[Column, ...] = (
    Column("log", pl.String, "–", "the log's path as given"),
    Column("log_sha256", pl.String, "–", "hash of the file"),
    Column("version", pl.String, "–", "version of wmr-replay"),
    Column("settings", pl.String, "–", "JSON, enough to repeat the run"),
    Column("duration_s", pl.Float64, "s", "last minus first pose stamp"),
    Column("n_pose", pl.Int64, "–", "pose rows used"),
    Column("n_torque", pl.Int64, "–", "torque rows used"),
    Column("rate_hz", pl.Float64, "Hz", "pose rate, from the median step of the initial stretch"),
    *ANOMALIES,
    Column("share_ideal", pl.Float64, "–", "share of the rows estimated ideal"),
    Column("share_skidding", pl.Float64, "–", "share estimated skidding"),
    Column("share_slipping", pl.Float64, "–", "share estimated slipping"),
    Column("share_skidding_slipping", pl.Float64, "–", "share estimated both at once"),
    Column("share_undecided", pl.Float64, "–", "share undecided"),
    *_with_sd("alpha", "(m/s²)/(N·m)", "last estimate of α"),
    Column("accuracy", pl.Float64, "–", "share of rows after warm-up whose mode is the true one; −1 counts as wrong"),
    Column("decided_share", pl.Float64, "–", "share of rows after warm-up with a mode"),
    Column("accuracy_decided", pl.Float64, "–", "accuracy over those"),
    *(Column(f"recall_{mode.label}", pl.Float64, "–", f"share of truly {mode.label} rows found; null without any") for mode in MODES),
    Column("median_detection_delay_s", pl.Float64, "s", "from a true switch to the first estimate that then holds .2 s"),
    Column("p95_detection_delay_s", pl.Float64, "s", "its 95th percentile"),
    Column("missed_switches", pl.Int64, "–", "true switches not detected before the next"),
    Column("false_alarms_per_hour", pl.Float64, "1/h", "estimated switches with no true one within the preceding 2 s"),
    Column("brier", pl.Float64, "–", "Brier score of the posterior"),
    Column("ece", pl.Float64, "–", "expected calibration error, 10 bins"),
    Column("alpha_error", pl.Float64, "–", "relative error of the last α against the truth (side file)"),
)


def polars_schema(columns: tuple[Column, ...]) -> pl.Schema:
    """The polars schema of a table, in the order of its columns."""
    return pl.Schema({column.name: column.dtype for column in columns})
