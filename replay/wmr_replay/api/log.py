"""A log opened: what it holds, and its signals as polars frames, whole or in batches."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from wmr_replay.api.info import LogInfo, Seen, info_of
from wmr_replay.api.names import with_mode_names
from wmr_replay.api.places import LocalPlace, Place, home_of, local_path, place_of
from wmr_replay.api.request import Instant, MappingLike, between_of, mapping_of
from wmr_replay.ingest import LogReader
from wmr_replay.ingest import open_log as open_reader
from wmr_replay.ingest.channels.clocks_apart import EXTRA
from wmr_replay.ingest.channels.mapping_proposal import proposed_mapping
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.pipeline.quick_look import MOST_ROWS, QuickLook
from wmr_schemas.batches import (
    COMMAND_COLUMNS,
    MODE_COLUMNS,
    POSE_COLUMNS,
    TORQUE_COLUMNS,
    WHEEL_COLUMNS,
    RawBatch,
    Rows,
)
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file
from wmr_schemas.mapping_file import LogMapping, mapping_toml
from wmr_schemas.robot import RobotParameters
from wmr_schemas.text import shown

Progress = Callable[[int, int], None]
"""Called with bytes read and bytes in all."""


class Signals(NamedTuple):
    """Rows of a log by signal, as the messages hold them: stamps (``t_ns``), then the values.

    ``pose``: ``x_m, y_m, yaw_rad``; ``torque``: ``left_nm, right_nm, left_radps, right_radps``, null where
    unknown; ``truth``: ``mode`` by name; ``wheels`` and ``commands``: ``left_radps, right_radps``, measured
    and commanded. The wheel speeds among the torques stand in ``wheels`` too. Rows are in file order.
    """

    pose: pl.DataFrame
    torque: pl.DataFrame
    truth: pl.DataFrame
    wheels: pl.DataFrame
    commands: pl.DataFrame


class LogFile:
    """A log whose channels are known. Made by ``open_log``; iterating over it gives its batches."""

    def __init__(self, open_reader: Callable[[bool], LogReader], mapping: LogMapping) -> None:
        self._open, self._mapping = open_reader, mapping
        self._reader = open_reader(True)
        self._infos: dict[bool, LogInfo] = {}
        """By whether everything was to be read and looked at."""

    @property
    def robot(self) -> RobotParameters:
        """Nominal parameters: the mapping's, else those in the log."""
        return self._reader.robot

    def info(self, progress: Progress | None = None, *, full: bool = False) -> LogInfo:
        """What the log holds, what would be used, and what is damaged.

        A log with an index, and a ``.db3``, is read in a few stretches if it is large: that takes less than a
        second. Any other log, and each one with ``full``, is read as a whole. ``findings`` are of the poses
        looked at: all of them with ``full``, else the first 20 000 of each stretch.
        """
        chosen = None if full else self._reader.stretches()
        if full not in self._infos:
            self._infos[full] = (
                self._whole_info(progress, full=full) if chosen is None else self._sampled_info(chosen)
            )
        return self._infos[full]

    def _whole_info(self, progress: Progress | None, *, full: bool) -> LogInfo:
        """The info of all that the file holds."""
        reader, seen = self._open(False) if self._reader.is_by_index else self._reader, Seen()
        look = QuickLook(reader.robot, None if full else MOST_ROWS)
        for batch in read(reader, progress, everything=True):
            seen.look(batch)
            look.push(batch.without_efforts() if reader.is_steered else batch)
        look.end_stretch()
        return info_of(reader, look, seen)

    def _sampled_info(self, chosen: list[list[Span]]) -> LogInfo:
        """The info of a few stretches, and of the index."""
        reader, seen = self._reader, Seen()
        look = QuickLook(reader.robot)
        for stretch in reader.sampled_batches(chosen):
            seen.look(stretch)
            look.push(stretch.without_efforts() if reader.is_steered else stretch)
            look.end_stretch()
        return info_of(reader, look, seen, chosen)

    def stretches(self) -> Iterator[Signals]:
        """The signals of a few stretches of a large log, which ``info`` is made of; of a small one, whole.

        The rows of one stretch follow one another; between two stretches rows are missing.
        """
        chosen = self._reader.stretches()
        if chosen is None:
            yield self.signals()
            return
        for stretch in self._open(True).sampled_batches(chosen):
            yield signals_of(stretch)

    def batches(self, progress: Progress | None = None) -> Iterator[Signals]:
        """The signals in use in file order, a batch for a few neighbouring chunks."""
        for batch in read(self._open(False), progress):
            yield signals_of(batch)

    def __iter__(self) -> Iterator[Signals]:
        return self.batches()

    def signals(self, progress: Progress | None = None) -> Signals:
        """The signals in use, whole."""
        parts = [signals_of(empty_batch()), *self.batches(progress)]
        return Signals(*(pl.concat(frames) for frames in zip(*parts, strict=True)))

    def mapping(self) -> LogMapping:
        """The mapping that finds the same channels again."""
        return proposed_mapping(self._reader.plan, self._mapping, self._reader.known_robot)

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
        return shown(f"<Log {self._reader.path}: {used or 'no channel in use'}>")


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

    def opened(by_index: bool) -> LogReader:
        return open_reader(place, chosen, need_pose=need_pose, between=between, by_index=by_index, also=EXTRA)

    return LogFile(opened, chosen)


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
    mode = frame_of(batch.mode, MODE_COLUMNS)
    known = mode.filter(pl.col("mode").is_in(np.arange(4.0))).with_columns(pl.col("mode").cast(pl.Int8))
    torque = frame_of(batch.torque, TORQUE_COLUMNS)
    speeds = torque.select("t_ns", *WHEEL_COLUMNS).filter(
        pl.any_horizontal(pl.col(WHEEL_COLUMNS).is_not_null())
    )
    wheels = frame_of(batch.wheels, WHEEL_COLUMNS) if len(batch.wheels) else speeds
    return Signals(
        frame_of(batch.pose, POSE_COLUMNS),
        torque,
        with_mode_names(known, ("mode",)),
        wheels,
        frame_of(batch.command, COMMAND_COLUMNS),
    )


def frame_of(rows: Rows, names: tuple[str, ...]) -> pl.DataFrame:
    """Rows of one signal, null where unknown."""
    columns = {"t_ns": rows.t_ns} | dict(zip(names, rows.values, strict=True))
    return pl.DataFrame(columns, nan_to_null=True)
