"""A CSV file with a pose, and perhaps torques and wheel speeds, as a log."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.csv_map import REQUIRED, CsvMap
from wmr_schemas.errors import InvalidFile, LogUnusable
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack

INPUTS = ("effort_left", "effort_right", "speed_left", "speed_right")


@dataclass(frozen=True)
class Converted:
    """The log; how many rows went into it, and how many were left out because of their time or of missing
    numbers.
    """

    log: Log
    n_rows: int
    n_left_out: int


def read_csv(path: Path, csv_map: CsvMap) -> Converted:
    """Rows whose time does not increase, or whose pose has a hole, are left out; all the others make the log.

    Raises LogUnusable when the file cannot be read or has no row to use, InvalidFile for a column that it
    lacks.
    """
    frame = read_frame(path, csv_map)
    columns = {key: frame[name].to_numpy().astype(np.float64) for key, name in csv_map.columns.items()}
    usable = np.asarray(np.isfinite(np.stack([columns[key] for key in REQUIRED])).all(axis=0))
    t_ns = np.rint(np.where(usable, columns["time"], 0.0) * NS_PER_S).astype(np.int64)
    kept = usable & increasing(t_ns, usable)
    if np.count_nonzero(kept) < 2:
        raise LogUnusable(path, "fewer than two rows have a time and a pose", "Check the columns of --map.")
    columns = {key: column[kept] for key, column in columns.items()}
    log = Log(
        pose_of(t_ns[kept], columns, csv_map),
        torque_of(t_ns[kept], columns),
        mode_of(t_ns[kept], columns),
        csv_map.robot,
    )
    return Converted(log, len(log.pose), len(t_ns) - len(log.pose))


def read_frame(path: Path, csv_map: CsvMap) -> pl.DataFrame:
    """The columns in use as numbers."""
    try:
        frame = pl.read_csv(
            path, glob=False, infer_schema_length=None, null_values=["", "nan", "NaN", "null"]
        )
    except OSError as error:
        raise LogUnusable(path, f"cannot be read ({error.strerror})", "Check the path.") from None
    except pl.exceptions.PolarsError as error:
        raise LogUnusable(path, f"is no CSV file: {error}", "The first line must name the columns.") from None
    for key, name in csv_map.columns.items():
        if name not in frame.columns:
            raise InvalidFile(path, name, f"no such column for {key}; there are {', '.join(frame.columns)}")
        if not frame[name].dtype.is_numeric():
            raise InvalidFile(path, name, f"column for {key} does not hold numbers")
    return frame


def increasing(t_ns: I64, usable: Bool) -> Bool:
    """Rows later than every usable one before them."""
    stamps = np.where(usable, t_ns, np.iinfo(np.int64).min)
    latest = np.maximum.accumulate(stamps)
    return np.asarray(stamps > np.concatenate([[np.iinfo(np.int64).min], latest[:-1]]))


def pose_of(t_ns: I64, columns: Mapping[str, F64], csv_map: CsvMap) -> PoseTrack:
    """The pose of N: p − R(yaw)·(reference_x_m, reference_y_m), with yaw the measured one plus its offset."""
    yaw = columns["yaw"] + csv_map.yaw_offset_rad
    cos, sin = np.cos(yaw), np.sin(yaw)
    forward, left = csv_map.reference_x_m, csv_map.reference_y_m
    x_m = columns["x"] - forward * cos + left * sin
    y_m = columns["y"] - forward * sin - left * cos
    return PoseTrack(t_ns, x_m, y_m, yaw)


def torque_of(t_ns: I64, columns: Mapping[str, F64]) -> TorqueTrack | None:
    """Torques and wheel speeds, NaN where there is no column; None without any."""
    if not any(name in columns for name in INPUTS):
        return None
    unknown = np.full(len(t_ns), np.nan)
    return TorqueTrack(t_ns, *(columns.get(name, unknown) for name in INPUTS))


def mode_of(t_ns: I64, columns: Mapping[str, F64]) -> ModeTrack | None:
    """The true mode, where there is a column, at its switches."""
    if "mode" not in columns:
        return None
    mode = columns["mode"].astype(np.int8)
    switches = np.flatnonzero(np.diff(mode, prepend=np.int8(ContactMode.UNDECIDED)))
    return ModeTrack(t_ns[switches], mode[switches])
