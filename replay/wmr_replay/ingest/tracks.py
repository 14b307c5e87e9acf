"""A whole log in memory: its signals as checked tracks, sorted by stamp, each stamp once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from wmr_replay.ingest import Between, LogPath, LogReader, Rows, open_log, sha256_of
from wmr_replay.ingest.channels.detect import not_found
from wmr_replay.ingest.channels.named import near_topics
from wmr_replay.ingest.channels.wheel_bindings import made_up
from wmr_replay.ingest.reading import joined
from wmr_replay.ingest.wheel_tracks import command_track, may_hold_wheels, wheel_track
from wmr_schemas.absurd import without_absurd
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.batches import RawBatch
from wmr_schemas.breaks import BREAKS_NAME, from_metadata
from wmr_schemas.errors import ChannelNotFound, LogUnusable
from wmr_schemas.findings import Finding, Severity
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.signals import CommandTrack, Log, ModeTrack, PoseTrack, TorqueTrack, WheelSpeedTrack

MOST_ROWS = 10_000_000
"""Rows of pose and torque that are held, at 240 bytes each while they are read and sorted: 2.4 GB at most."""

LEAST_COMMON_S = 8.0
"""Pose and torque have to have so much time in common, or half of the shorter one; 8 s are fitted first."""

Need = Literal["torque", "wheel_speed", "commands"]
"""What a log has to hold besides a pose."""
ALSO: dict[Need, tuple[str, ...]] = {
    "torque": (),
    "wheel_speed": ("wheel_speed", "command"),
    "commands": ("wheel_speed", "command"),
}
WORDS: dict[Need, str] = {"torque": "torques", "wheel_speed": "wheel speeds", "commands": "commands"}

OTHER_CLASSES = {
    "steered": "its yaw rate follows from the steering, not from a difference of wheel speeds or torques, of "
    "which the base models of fit and gap are made",
    "drives_sideways": "it moves sideways without a skid, and the base models of fit and gap are robots with "
    "a left and a right side",
}
"""Findings that name a robot of another class, and why it is not analysed."""
OF_ANOTHER = (
    "`wmr-replay run` tells skidding from the poses alone. Where the signs are another robot's, name this "
    "robot's topics with --pose and --torque, or in --map FILE."
)

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
    need: Need = "torque",
) -> WholeLog:
    """Read ``path`` with its pose and what is needed, and with the contact mode on ``mode_topic`` where one
    is named.

    ``need`` is the input that the log has to hold: efforts of both wheels, speeds of both wheels, or
    commands. The others are there where the log has them; for ``torque``, wheel speeds come from the channel
    of the torques alone, and commands are not read. No other mode channel is decoded, whatever the log holds.
    Rows that repeat a stamp or hold no finite pose are left out and counted. ``clock_offset_s`` is added to
    the stamps of all inputs. Raises LogUnusable without a pose or what is needed, where the two do not cover
    the same time, or beyond ``MOST_ROWS``.
    """
    reader = open_with_modes(path, mapping, between, mode_topic, ALSO[need])
    check_channels(reader, need)
    rows = read_rows(reader, progress)
    check_channels(reader, need)
    if clock_offset_s:
        rows = moved(rows, clock_offset_s)
    finite = np.asarray(np.isfinite(without_absurd(rows.pose.values)).all(axis=0))
    pose, pose_note = once_each(rows.pose, finite, "pose")
    torque, torque_note = once_each(rows.torque, np.ones(len(rows.torque), bool), "torque")
    known = (rows.mode.values[0] >= 0) & (rows.mode.values[0] <= 3)
    mode, mode_note = once_each(rows.mode, known, "mode")
    if reader.limits is not None and len(pose) < 2:
        raise reader.nothing_between(f"{len(pose)} usable poses lie")
    inputs = Inputs(torque, wheel_track(rows, reader.plan.uses), command_track(rows))
    check_content(path, pose, inputs, mode, mode_topic, need)
    check_common_span(path, pose.t_ns, inputs.t_ns(need), clock_offset_s, WORDS[need])
    log = Log(
        pose_track(pose),
        torque_track(torque) if has_efforts(torque.values) or need == "torque" else None,
        mode_track(mode),
        reader.robot,
        inputs.wheels,
        inputs.commands,
        breaks_between(reader, pose.t_ns),
    )
    log, wheels_note = with_one_pair_of_wheels(reader, log, need)
    shift = f"{clock_offset_s:+g} s were added to the stamps of the {WORDS[need]}" if clock_offset_s else ""
    said = [shift, *reader.losses.notes, *reader.remarks, *reader.stamp_notes]
    notes = tuple(note for note in [*said, pose_note, torque_note, mode_note, wheels_note] if note)
    return WholeLog(log, sha256_of(path), notes, tuple(reader.findings))


@dataclass(frozen=True, eq=False)
class Inputs:
    """What drives a robot, in each form that the log has."""

    torque: Rows
    wheels: WheelSpeedTrack | None
    commands: CommandTrack | None

    def t_ns(self, need: Need) -> I64:
        """Stamps of the input that is needed, which is there."""
        track = {"torque": self.torque, "wheel_speed": self.wheels, "commands": self.commands}[need]
        assert track is not None
        return track.t_ns


def check_channels(reader: LogReader, need: Need) -> None:
    """Raises ChannelNotFound where no channel may hold what is needed: one that is found may turn out to go
    by another clock. Raises LogUnusable for a robot of another class, whatever its channels hold.
    """
    check_class(reader.path, reader.findings)
    uses = reader.plan.uses
    there = {
        "torque": "torque" in uses,
        "wheel_speed": may_hold_wheels(uses),
        "commands": "command" in uses,
    }
    if not there[need]:
        role = "command" if need == "commands" else need
        raise not_found(reader.path, role, reader.candidates, reader.plan)


def check_class(path: LogPath, findings: Sequence[Finding]) -> None:
    """Raises LogUnusable for a steered or an omnidirectional robot, unless the signs are of other channels
    than those that the user named.
    """
    for found in findings:
        if found.code in OTHER_CLASSES and found.severity != Severity.NOTE:
            raise LogUnusable(path, f"{found.code}: {found.text}; {OTHER_CLASSES[found.code]}", OF_ANOTHER)


def moved(rows: RawBatch, offset_s: float) -> RawBatch:
    """The same rows, every input stamped ``offset_s`` later."""
    return replace(
        rows,
        torque=rows.torque.moved(offset_s),
        wheels=rows.wheels.moved(offset_s),
        command=rows.command.moved(offset_s),
    )


def breaks_between(reader: LogReader, pose_ns: I64) -> tuple[int, ...]:
    """The breaks that the log's metadata name, behind the first pose and up to the last."""
    found = from_metadata(reader.survey.metadata.get(BREAKS_NAME, {}))
    return tuple(t_ns for t_ns in found if pose_ns[0] < t_ns <= pose_ns[-1])


def with_one_pair_of_wheels(reader: LogReader, log: Log, need: Need) -> tuple[Log, str]:
    """The log of a robot with the wheels by which its commands became wheel speeds, and a note on that.

    Measured speeds of wheels whose radius is unknown say nothing beside commands of made-up wheels, and are
    left out.
    """
    use = reader.plan.uses.get("command")
    values = {} if use is None else made_up(use.binding)
    values = {name: value for name, value in values.items() if getattr(log.robot, name) is None}
    if use is None or not values:
        return log, ""
    if need != "commands":
        lacking = " and ".join(values)
        return replace(log, commands=None), f"{use.channel.topic}: left out, since {lacking} is not known"
    said = ", ".join(f"{name} {value:g}" for name, value in values.items())
    note = f"{use.channel.topic}: turned into wheel speeds with {said}, which is made up"
    return replace(log, wheels=None, robot=replace(log.robot, **values)), note


def open_with_modes(
    path: LogPath,
    mapping: LogMapping,
    between: Between,
    mode_topic: str | None,
    also: tuple[str, ...] = (),
) -> LogReader:
    """The reader, with a mode channel if the user named one, and with none otherwise."""
    try:
        reader = open_log(path, replace(mapping, truth_topic=mode_topic), between=between, also=also)
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


def read_rows(reader: LogReader, progress: Progress | None) -> RawBatch:
    """Every row of every signal, in file order."""
    batches, n_rows = [], 0
    for batch in reader.batches():
        batches.append(batch)
        n_rows += sum(map(len, (batch.pose, batch.torque, batch.wheels, batch.command)))
        if n_rows > MOST_ROWS:
            raise LogUnusable(
                reader.path,
                f"it holds more than the {MOST_ROWS:,} rows that are analysed at one time",
                "Take a part of it with --start and --end.",
            )
        if progress is not None:
            progress("reading", reader.position_bytes / max(reader.size_bytes, 1))
    return joined(batches)


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


def check_content(
    path: LogPath, pose: Rows, inputs: Inputs, mode: Rows, mode_topic: str | None, need: Need
) -> None:
    """Raises LogUnusable where a signal has a channel but no usable row."""
    advice = f"`wmr-replay info {path}` says what the log holds; --start and --end choose the part."
    if len(pose) < 2:
        raise LogUnusable(path, f"{len(pose)} usable poses in it", advice)
    if need == "torque" and not has_efforts(inputs.torque.values):
        raise LogUnusable(path, "no row has an effort for both wheels: nothing drives a simulation", advice)
    if need == "wheel_speed" and inputs.wheels is None:
        raise LogUnusable(path, "no row has a speed of both wheels", advice)
    if need == "commands" and inputs.commands is None:
        raise LogUnusable(path, "no row has a command for both wheels", advice)
    if mode_topic is not None and not len(mode):
        raise LogUnusable(path, f"no contact mode (0 to 3) on {mode_topic}", advice)


def check_common_span(
    path: LogPath, pose_ns: I64, torque_ns: I64, clock_offset_s: float, what: str = "torques"
) -> None:
    """Raises LogUnusable where poses and the input ``what``, by stamp, have too little time in common.

    ``clock_offset_s`` has been added to the input's stamps.
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
        f"poses ({spans_s[0]:.4g} s) and {what} ({spans_s[1]:.4g} s) have {held}: "
        f"by their stamps the {what} begin {abs(offset_s):.4g} s {'after' if offset_s > 0 else 'before'} "
        "the poses",
        "If they were recorded together, their clocks do not belong together: try --clock log, or "
        f"--clock-offset {clock_offset_s - offset_s:.6g} to add that many seconds to the {what}' stamps. "
        f"`wmr-replay info {path}` says what the log holds.",
    )


def pose_track(rows: Rows) -> PoseTrack:
    """The pose as a checked track. Raises InvalidSignal."""
    return PoseTrack(rows.t_ns, *rows.values)


def has_efforts(torques: F64) -> bool:
    """Whether a row (4, n) holds an effort of both wheels."""
    return bool(np.isfinite(without_absurd(torques[:2])).all(axis=0).any())


def torque_track(rows: Rows) -> TorqueTrack:
    """The torques as a checked track; an effort that is absurd is unknown."""
    return TorqueTrack(rows.t_ns, *without_absurd(rows.values))


def mode_track(rows: Rows) -> ModeTrack | None:
    """The contact mode as a checked track; None without rows."""
    return ModeTrack(rows.t_ns, rows.values[0].astype(np.int8)) if len(rows) else None
