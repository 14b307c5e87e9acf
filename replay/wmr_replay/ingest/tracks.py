"""A whole log in memory: its signals as checked tracks, sorted by stamp, each stamp once."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.ingest import Between, LogPath, LogReader, Rows, open_log, sha256_of
from wmr_replay.ingest.channels.detect import not_found
from wmr_replay.ingest.channels.named import near_topics
from wmr_replay.ingest.reading import joined
from wmr_schemas.absurd import without_absurd
from wmr_schemas.arrays import I64, NS_PER_S, Bool
from wmr_schemas.errors import ChannelNotFound, LogUnusable
from wmr_schemas.findings import Finding
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack

MOST_ROWS = 10_000_000
"""Rows of pose and torque that are held, at 240 bytes each while they are read and sorted: 2.4 GB at most."""

LEAST_COMMON_S = 8.0
"""Pose and torque have to have so much time in common, or half of the shorter one; 8 s are fitted first."""

Progress = Callable[[str, float], None]
"""Called with the name of the present step and the share that is done, 0 to 1."""


@dataclass(frozen=True, eq=False)
class WholeLog:
    """A log in memory, the hash of its file, notes about losses and irregularities, and findings."""

    log: Log
    sha256: str
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


def read_whole(
    path: LogPath,
    mapping: LogMapping,
    between: Between,
    mode_topic: str | None = None,
    progress: Progress | None = None,
    *,
    clock_offset_s: float = 0.0,
) -> WholeLog:
    """Read ``path`` with pose and torque, and with the contact mode on ``mode_topic`` where one is named.

    No other mode channel is decoded, whatever the log holds. Rows that repeat a stamp or hold no finite pose
    are left out and counted. ``clock_offset_s`` is added to the torques' stamps. Raises LogUnusable without a
    pose or a wheel torque, where the two do not cover the same time, or beyond ``MOST_ROWS``.
    """
    reader = open_with_modes(path, mapping, between, mode_topic)
    if reader.plan.torque is None:
        raise not_found(path, "torque", reader.candidates, reader.plan)
    pose, torque, mode = read_rows(reader, progress)
    torque = torque.moved(clock_offset_s) if clock_offset_s else torque
    finite = np.asarray(np.isfinite(without_absurd(pose.values)).all(axis=0))
    pose, pose_note = once_each(pose, finite, "pose")
    torque, torque_note = once_each(torque, np.ones(len(torque), bool), "torque")
    known = (mode.values[0] >= 0) & (mode.values[0] <= 3)
    mode, mode_note = once_each(mode, known, "mode")
    if reader.limits is not None and len(pose) < 2:
        raise reader.nothing_between(f"{len(pose)} usable poses lie")
    check_content(path, pose, torque, mode, mode_topic)
    check_common_span(path, pose.t_ns, torque.t_ns, clock_offset_s)
    log = Log(pose_track(pose), torque_track(torque), mode_track(mode), reader.robot)
    moved = f"{clock_offset_s:+g} s were added to the stamps of the torques" if clock_offset_s else ""
    said = [moved, *reader.losses.notes, *reader.remarks, *reader.stamp_notes]
    notes = tuple(note for note in [*said, pose_note, torque_note, mode_note] if note)
    return WholeLog(log, sha256_of(path), notes, tuple(reader.findings))


def open_with_modes(
    path: LogPath, mapping: LogMapping, between: Between, mode_topic: str | None
) -> LogReader:
    """The reader, with a mode channel if the user named one, and with none otherwise."""
    try:
        reader = open_log(path, replace(mapping, truth_topic=mode_topic), between=between)
    except ChannelNotFound as error:
        if mode_topic is None or mode_topic not in error.wanted:
            raise
        near = near_topics(mode_topic, (topic for topic, *_ in error.available))
        advice = "Name the topic of a contact mode with --modes topic:TOPIC, or leave --modes out."
        advice = f"{near}\n{advice}" if near else advice
        raise ChannelNotFound(error.wanted, path, error.available, advice) from None
    if mode_topic is None:
        reader.plan.uses.pop("truth", None)
    return reader


def read_rows(reader: LogReader, progress: Progress | None) -> tuple[Rows, Rows, Rows]:
    """Every row of pose, torque and mode, in file order."""
    batches, n_rows = [], 0
    for batch in reader.batches():
        batches.append(batch)
        n_rows += len(batch.pose) + len(batch.torque)
        if n_rows > MOST_ROWS:
            raise LogUnusable(
                reader.path,
                f"it holds more than the {MOST_ROWS:,} rows that are analysed at one time",
                "Take a part of it with --start and --end.",
            )
        if progress is not None:
            progress("reading", reader.position_bytes / max(reader.size_bytes, 1))
    whole = joined(batches)
    return whole.pose, whole.torque, whole.mode


def once_each(rows: Rows, usable: Bool, name: str) -> tuple[Rows, str]:
    """The usable rows by stamp, of equal stamps the first in the file; and what was left out, in words."""
    chosen = np.flatnonzero(usable)
    chosen = chosen[np.lexsort((rows.order[chosen], rows.t_ns[chosen]))]
    first = np.diff(rows.t_ns[chosen], prepend=np.iinfo(np.int64).min) != 0
    kept = chosen[first]
    left_out = (int((~usable).sum()), "hold no usable value"), (int((~first).sum()), "repeat a stamp")
    reasons = [f"{n} {name} rows {why}" for n, why in left_out if n]
    note = f"{' and '.join(reasons)}; they are left out" if reasons else ""
    return Rows(rows.t_ns[kept], rows.order[kept], rows.values[:, kept]), note


def check_content(path: LogPath, pose: Rows, torque: Rows, mode: Rows, mode_topic: str | None) -> None:
    """Raises LogUnusable where a signal has a channel but no usable row."""
    advice = f"`wmr-replay info {path}` says what the log holds; --start and --end choose the part."
    if len(pose) < 2:
        raise LogUnusable(path, f"{len(pose)} usable poses in it", advice)
    if not np.isfinite(without_absurd(torque.values[:2])).all(axis=0).any():
        raise LogUnusable(path, "no row has an effort for both wheels: nothing drives a simulation", advice)
    if mode_topic is not None and not len(mode):
        raise LogUnusable(path, f"no contact mode (0 to 3) on {mode_topic}", advice)


def check_common_span(path: LogPath, pose_ns: I64, torque_ns: I64, clock_offset_s: float) -> None:
    """Raises LogUnusable where poses and torques, by stamp, have too little time in common.

    ``clock_offset_s`` has been added to the torques' stamps.
    """
    spans_s = [(int(t_ns[-1]) - int(t_ns[0])) / NS_PER_S for t_ns in (pose_ns, torque_ns)]
    begin_ns, end_ns = max(pose_ns[0], torque_ns[0]), min(pose_ns[-1], torque_ns[-1])
    common_s = (int(end_ns) - int(begin_ns)) / NS_PER_S
    if common_s >= min(LEAST_COMMON_S, *(span_s / 2 for span_s in spans_s)):
        return
    offset_s = (int(torque_ns[0]) - int(pose_ns[0])) / NS_PER_S
    held = f"{max(common_s, 0.0):.3g} s in common" if common_s > 0 else "no time in common"
    raise LogUnusable(
        path,
        f"poses ({spans_s[0]:.4g} s) and torques ({spans_s[1]:.4g} s) have {held}: "
        f"by their stamps the torques begin {abs(offset_s):.4g} s {'after' if offset_s > 0 else 'before'} "
        "the poses",
        "If they were recorded together, their clocks do not belong together: try --clock log, or "
        f"--clock-offset {clock_offset_s - offset_s:.6g} to add that many seconds to the torques' stamps. "
        f"`wmr-replay info {path}` says what the log holds.",
    )


def pose_track(rows: Rows) -> PoseTrack:
    """The pose as a checked track. Raises InvalidSignal."""
    return PoseTrack(rows.t_ns, *rows.values)


def torque_track(rows: Rows) -> TorqueTrack:
    """The torques as a checked track; an effort that is absurd is unknown."""
    return TorqueTrack(rows.t_ns, *without_absurd(rows.values))


def mode_track(rows: Rows) -> ModeTrack | None:
    """The contact mode as a checked track; None without rows."""
    return ModeTrack(rows.t_ns, rows.values[0].astype(np.int8)) if len(rows) else None
