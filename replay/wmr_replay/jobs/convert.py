"""A CSV file with a pose, and perhaps torques, wheel speeds and commands, as a log."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import polars as pl

from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.csv_map import COMMANDED, REQUIRED, TWIST, CsvMap
from wmr_schemas.errors import InvalidFile, LogUnusable
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import (
    CommandTrack,
    Log,
    ModeTrack,
    PoseTrack,
    SteeringTrack,
    TorqueTrack,
    WheelSpeedTrack,
)

EFFORTS, SPEEDS = ("effort_left", "effort_right"), ("speed_left", "speed_right")
BREAK_NS = 10 * NS_PER_S
"""Two stretches are so far apart at least, by their stamps."""
INPUTS = (*EFFORTS, *SPEEDS)


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
    columns = {
        key: frame[name].to_numpy().astype(np.float64)
        for key, name in csv_map.columns.items()
        if key != "window"
    }
    usable = np.asarray(np.isfinite(np.stack([columns[key] for key in REQUIRED])).all(axis=0))
    t_ns = np.rint(np.where(usable, columns["time"], 0.0) * NS_PER_S).astype(np.int64)
    stretch = stretches_of(frame, csv_map)
    t_ns = apart(t_ns, stretch, usable)
    kept = usable & increasing(t_ns, usable)
    if np.count_nonzero(kept) < 2:
        raise LogUnusable(path, "fewer than two rows have a time and a pose", "Check the columns of --map.")
    columns = in_si(columns, csv_map)
    columns, t_kept = {key: column[kept] for key, column in columns.items()}, t_ns[kept]
    begins = np.flatnonzero(np.diff(stretch[kept])) + 1
    log = Log(
        pose_of(t_kept, columns, csv_map),
        torque_of(t_kept, columns),
        mode_of(t_kept, columns),
        csv_map.robot,
        None if not (sides := sides_of(columns, SPEEDS)) else WheelSpeedTrack(t_kept, *sides),
        None if not (sides := sides_of(columns, COMMANDED)) else CommandTrack(t_kept, *sides),
        tuple(t_kept[begins].tolist()),
        SteeringTrack(t_kept, columns["steering"]) if "steering" in columns else None,
    )
    return Converted(log, len(log.pose), len(t_ns) - len(log.pose))


def stretches_of(frame: pl.DataFrame, csv_map: CsvMap) -> I64:
    """The ordinal (n,) of each row's stretch: it grows where the value of the column ``window`` changes."""
    if "window" not in csv_map.columns:
        return np.zeros(frame.height, np.int64)
    window = frame[csv_map.columns["window"]]
    changed = window.ne_missing(window.shift(1)).to_numpy().copy()
    changed[:1] = False
    return np.cumsum(changed)


def apart(t_ns: I64, stretch: I64, usable: Bool) -> I64:
    """The stamps, those of each stretch so much later that it begins ``BREAK_NS`` behind the one before it.

    Time may begin again in each stretch, or go on. A stretch that is moved begins at a whole second.
    """
    if not stretch.any():
        return t_ns
    moved, shift_ns, end_ns = t_ns.copy(), 0, None
    edges = [0, *(np.flatnonzero(np.diff(stretch)) + 1).tolist(), len(t_ns)]
    for start, stop in pairwise(edges):
        here = t_ns[start:stop][usable[start:stop]]
        if not len(here):
            continue
        first_ns = int(here.min())
        if end_ns is not None and first_ns + shift_ns < end_ns + BREAK_NS:
            shift_ns = -(-(end_ns + BREAK_NS) // NS_PER_S) * NS_PER_S - first_ns
        moved[start:stop] += shift_ns
        end_ns = int(here.max()) + shift_ns
    return moved


def in_si(columns: Mapping[str, F64], csv_map: CsvMap) -> dict[str, F64]:
    """The columns with measured and commanded wheel speeds in rad/s, commands of a twist among them."""
    found, robot = dict(columns), csv_map.robot
    for names, units in ((SPEEDS, csv_map.speeds), (COMMANDED, csv_map.commands)):
        for name, gain in zip(names, units.gains(robot.wheel_radius_m), strict=True):
            if name in found and gain != 1:
                found[name] = gain * found[name]
    if TWIST[0] in found:
        ahead = found[TWIST[0]] / (robot.wheel_radius_m or 1.0)
        across = found[TWIST[1]] * (robot.half_track_m or 1.0) / (robot.wheel_radius_m or 1.0)
        found |= {COMMANDED[0]: ahead - across, COMMANDED[1]: ahead + across}
    return found


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
        if key != "window" and not frame[name].dtype.is_numeric():
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
    """Torques with wheel speeds, NaN where there is no column; None without a column of torques."""
    if not any(name in columns for name in EFFORTS):
        return None
    unknown = np.full(len(t_ns), np.nan)
    return TorqueTrack(t_ns, *(columns.get(name, unknown) for name in INPUTS))


def sides_of(columns: Mapping[str, F64], names: tuple[str, str]) -> tuple[F64, F64] | None:
    """The columns of both sides, NaN where there is none; None without any."""
    found = [columns[name] for name in names if name in columns]
    if not found:
        return None
    unknown = np.full(len(found[0]), np.nan)
    return columns.get(names[0], unknown), columns.get(names[1], unknown)


def mode_of(t_ns: I64, columns: Mapping[str, F64]) -> ModeTrack | None:
    """The true mode, where there is a column, at its switches."""
    if "mode" not in columns:
        return None
    mode = columns["mode"].astype(np.int8)
    switches = np.flatnonzero(np.diff(mode, prepend=np.int8(ContactMode.UNDECIDED)))
    return ModeTrack(t_ns[switches], mode[switches])
