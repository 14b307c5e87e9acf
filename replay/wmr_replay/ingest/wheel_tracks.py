"""Measured and commanded wheel speeds of a whole log as checked tracks."""

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from wmr_replay.ingest.channels.detect import Use
from wmr_replay.ingest.channels.position_steps import midway_of, steps_of
from wmr_schemas.absurd import without_absurd
from wmr_schemas.arrays import F64, I64
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.signals import CommandTrack, WheelSpeedTrack

Track = TypeVar("Track", WheelSpeedTrack, CommandTrack)


def may_hold_wheels(uses: Mapping[str, Use]) -> bool:
    """Whether a channel in use may hold wheel speeds."""
    return "torque" in uses or "wheel_speed" in uses


def wheel_track(rows: RawBatch, uses: Mapping[str, Use]) -> WheelSpeedTrack | None:
    """The wheel speeds of whichever channel holds them; None without any of both wheels.

    Speeds that are differences of positions are stamped in the middle of their intervals.
    """
    role = "wheel_speed" if len(rows.wheels) else "torque"
    chosen = rows.wheels if len(rows.wheels) else _speeds(rows.torque)
    are_differences = role in uses and steps_of(uses[role].binding) is not None
    t_ns, values, any_known = _by_stamp(chosen, midway=are_differences)
    return WheelSpeedTrack(t_ns, *values) if any_known else None


def command_track(rows: RawBatch) -> CommandTrack | None:
    """The commands; None without any for both wheels."""
    t_ns, values, any_known = _by_stamp(rows.command)
    return CommandTrack(t_ns, *values) if any_known else None


def _speeds(torque: Rows) -> Rows:
    """The wheel speeds among rows of torques."""
    return Rows(torque.t_ns, torque.order, torque.values[2:])


def _by_stamp(rows: Rows, *, midway: bool = False) -> tuple[I64, F64, bool]:
    """Rows with any value by stamp, of equal stamps the first in the file; whether one has both values.

    ``midway``: stamped in the middle of the interval that ends at each stamp.
    """
    sorted_rows = np.lexsort((rows.order, rows.t_ns))
    t_ns = rows.t_ns[sorted_rows]
    first = np.diff(t_ns, prepend=np.iinfo(np.int64).min) != 0
    values, t_ns = without_absurd(rows.values[:, sorted_rows[first]]), t_ns[first]
    if midway:
        t_ns = midway_of(t_ns)
    known = np.isfinite(values)
    some = known.any(axis=0)
    return t_ns[some], np.ascontiguousarray(values[:, some]), bool(known.all(axis=0).any())
