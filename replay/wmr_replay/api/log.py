"""A log opened: what it holds, and its signals as polars frames, whole or in batches."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from wmr_replay.api.info import LogInfo, info_of
from wmr_replay.api.names import with_mode_names
from wmr_replay.api.places import LocalPlace, Place, home_of, local_path, place_of
from wmr_replay.api.request import Instant, MappingLike, between_of, mapping_of
from wmr_replay.ingest import LogReader
from wmr_replay.ingest import open_log as open_reader
from wmr_replay.ingest.channels.first_rows import has_efforts
from wmr_replay.ingest.channels.mapping_proposal import proposed_mapping
from wmr_schemas.batches import MODE_COLUMNS, POSE_COLUMNS, TORQUE_COLUMNS, RawBatch, Rows
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file
from wmr_schemas.mapping_file import LogMapping, mapping_toml
from wmr_schemas.robot import RobotParameters

Progress = Callable[[int, int], None]
"""Called with bytes read and bytes in all."""


class Signals(NamedTuple):
    """Rows of a log by signal, as the messages hold them: stamps (``t_ns``), then the values.

    ``pose``: ``x_m, y_m, yaw_rad``; ``torque``: ``left_nm, right_nm, left_radps, right_radps``, null where
    unknown; ``truth``: ``mode`` by name. Rows are in file order.
    """

    pose: pl.DataFrame
    torque: pl.DataFrame
    truth: pl.DataFrame


class LogFile:
    """A log whose channels are known. Made by ``open_log``; iterating over it gives its batches."""

    def __init__(self, open_reader: Callable[[], LogReader], mapping: LogMapping) -> None:
        self._open, self._mapping = open_reader, mapping
        self._reader = open_reader()
        self._info: LogInfo | None = None

    @property
    def robot(self) -> RobotParameters:
        """Nominal parameters: the mapping's, else those in the log."""
        return self._reader.robot

    def info(self, progress: Progress | None = None) -> LogInfo:
        """Read the whole file and say what it holds, what would be used and what is damaged."""
        if self._info is None:
            found = False
            for batch in read(self._reader, progress, everything=True):
                found = found or has_efforts(batch.torque.values)
            self._info = info_of(self._reader, has_efforts=found)
        return self._info

    def batches(self, progress: Progress | None = None) -> Iterator[Signals]:
        """The signals in use in file order, a batch for a few neighbouring chunks."""
        for batch in read(self._open(), progress):
            yield signals_of(batch)

    def __iter__(self) -> Iterator[Signals]:
        return self.batches()

    def signals(self, progress: Progress | None = None) -> Signals:
        """The signals in use, whole."""
        parts = [signals_of(empty_batch()), *self.batches(progress)]
        return Signals(*(pl.concat(frames) for frames in zip(*parts, strict=True)))

    def mapping(self) -> LogMapping:
        """The mapping that finds the same channels again."""
        self.info()
        return proposed_mapping(self._reader.plan, self._mapping, self._reader.robot)

    def write_mapping(self, path: LocalPlace, *, overwrite: bool = False) -> Path:
        """Write ``mapping`` to a mapping file (``robot.toml``), whole or not at all.

        Raises InvalidSetting where the file exists, unless ``overwrite``.
        """
        target = free_file(path, overwrite=overwrite)
        text = mapping_toml(self.mapping())
        with whole_file(target) as part:
            part.write_text(text, encoding="utf-8")
        return target

    def __repr__(self) -> str:
        used = ", ".join(f"{role} {use.channel.topic}" for role, use in self._reader.plan.uses.items())
        return f"<Log {self._reader.path}: {used or 'no channel in use'}>"


def free_file(path: LocalPlace, *, overwrite: bool) -> Path:
    """A file of this machine that may be written. Raises InvalidSetting where it exists, unless
    ``overwrite``.
    """
    target = local_path(path)
    home_of(target)
    if target.exists() and not overwrite:
        raise InvalidSetting(f"{target} exists and is left as it is; name another file, or overwrite it")
    return target


def open_log(
    log: Place,
    *,
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    need_pose: bool = False,
) -> LogFile:
    """Open an MCAP log, a ROS bag, a rosbag2 directory or a URL, and find its signals.

    Args:
        log: An MCAP file, a ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or a URL.
        mapping: Mapping or mapping file: which topics hold pose, torques and truth.
        start: Leave out what was logged before.
        end: Leave out what was logged after.
        need_pose: Raise ChannelNotFound for a log without a pose.

    Raises:
        LogUnusable: It is no such log, or a topic that the mapping names does not serve.
    """
    place, chosen, between = place_of(log), mapping_of(mapping) or LogMapping(), between_of(start, end)
    return LogFile(lambda: open_reader(place, chosen, need_pose=need_pose, between=between), chosen)


def read(reader: LogReader, progress: Progress | None, *, everything: bool = False) -> Iterator[RawBatch]:
    """The reader's batches, telling ``progress`` how far it is."""
    for batch in reader.batches(everything=everything):
        yield batch
        if progress is not None:
            progress(reader.position_bytes, reader.size_bytes)


def empty_batch() -> RawBatch:
    """A batch without rows."""
    return RawBatch(*(Rows.empty(len(names)) for names in (POSE_COLUMNS, TORQUE_COLUMNS, MODE_COLUMNS)))


def signals_of(batch: RawBatch) -> Signals:
    """A batch as frames."""
    pose, torque, mode = (
        pl.DataFrame({"t_ns": rows.t_ns} | dict(zip(names, rows.values, strict=True)), nan_to_null=True)
        for rows, names in (
            (batch.pose, POSE_COLUMNS),
            (batch.torque, TORQUE_COLUMNS),
            (batch.mode, MODE_COLUMNS),
        )
    )
    known = mode.filter(pl.col("mode").is_in(np.arange(4.0))).with_columns(pl.col("mode").cast(pl.Int8))
    return Signals(pose, torque, with_mode_names(known, ("mode",)))
