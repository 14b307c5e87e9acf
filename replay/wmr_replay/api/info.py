"""What a log holds, and what a replay would use of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from wmr_replay.ingest import LogReader
from wmr_replay.ingest.channels.first_rows import has_efforts, has_speeds
from wmr_replay.ingest.mcap.chunk_selection import estimated_counts, indexed_counts
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.message_counts import ChannelCount
from wmr_replay.pipeline.quick_look import QuickLook
from wmr_schemas.batches import RawBatch
from wmr_schemas.findings import without_explained
from wmr_schemas.robot import RobotParameters

ROLES = ("pose", "torque", "truth", "wheel_speed", "command")
WHEEL_SPEED = "wheel_speed"
"""The role of a channel in use that holds wheel speeds, but no effort."""


@dataclass
class Seen:
    """Whether efforts, and speeds, of both wheels were met among the torques."""

    efforts: bool = False
    speeds: bool = False

    def look(self, batch: RawBatch) -> None:
        """Look at the next batch."""
        self.efforts = self.efforts or has_efforts(batch.torque.values)
        self.speeds = self.speeds or has_speeds(batch.torque.values)


@dataclass(frozen=True)
class LogInfo:
    """What a log holds, and what a replay would use of it.

    Attributes:
        complete: Whether the whole file was read. If not, numbers of messages are those of the file's index,
            first and last times are known to a chunk, and clocks, losses and notes are of what was read.
        counts_estimated: Whether numbers of messages are estimates from the rows that were read, since the
            file has no index of them (``.db3``).
        n_chunks: Chunks, or other stretches of records, in the file.
        n_chunks_read: How many of them were read.
        channels: One entry per channel: topic, schema, encoding, messages, rate, times, ``serves_as``, role
            or ``why_not``.
        used: By role (``pose``, ``torque``, ``truth``, ``wheel_speed``, ``command``) the channel and how it
            is read; None without one. A channel of torques with wheel speeds stands under both, one without
            efforts under ``wheel_speed`` alone.
        clocks: By role the clock in use, its offset from log time, duplicates, steps back, gaps, jitter.
        losses: Counters of what could not be used, and ``notes``.
        stamp_notes: What is out of the ordinary in the stamps, in words.
        pose_is_odometry: Whether the pose, by its name, was integrated from wheel speeds.
        has_checksums: Whether a checksum covers any of the messages.
        findings: What is wrong with the data: ``code``, ``severity``, ``text``, ``meaning``, ``advice``,
            ``n``, ``where``, of ``n_poses_looked_at`` poses over ``looked_at_s`` seconds. A replay repairs
            outliers, looks at every pose, and may find more.
    """

    log: str
    size_bytes: int
    profile: str
    library: str
    channels: tuple[dict[str, Any], ...]
    used: dict[str, dict[str, object] | None]
    clocks: dict[str, dict[str, Any]]
    clock_notes: dict[str, str]
    robot: RobotParameters
    losses: dict[str, Any]
    remarks: tuple[str, ...]
    stamp_notes: tuple[str, ...]
    pose_is_odometry: bool
    has_checksums: bool = True
    findings: tuple[dict[str, Any], ...] = ()
    n_poses_looked_at: int = 0
    looked_at_s: float = 0.0
    complete: bool = True
    counts_estimated: bool = False
    n_chunks: int = 0
    n_chunks_read: int = 0

    @property
    def n_messages(self) -> int:
        """Messages of all channels."""
        return sum(channel["messages"] for channel in self.channels)

    @cached_property
    def start_ns(self) -> int:
        """Log time of the first message, 0 without any."""
        return min((c["first_ns"] for c in self.channels if c["first_ns"] is not None), default=0)

    @property
    def duration_s(self) -> float:
        """From the first to the last message, by log time."""
        last_ns = max((c["last_ns"] for c in self.channels if c["last_ns"] is not None), default=0)
        return (last_ns - self.start_ns) / 1e9

    def as_dict(self) -> dict[str, Any]:
        """As ``wmr-replay info --json`` prints it."""
        return {
            "log": self.log,
            "size_bytes": self.size_bytes,
            "complete": self.complete,
            "counts_estimated": self.counts_estimated,
            "chunks": self.n_chunks,
            "chunks_read": self.n_chunks_read,
            "profile": self.profile,
            "library": self.library,
            "channels": list(self.channels),
            "used": self.used,
            "clocks": self.clocks,
            "robot": self.robot.known(),
            "losses": self.losses,
            "remarks": list(self.remarks),
            "has_checksums": self.has_checksums,
            "findings": list(self.findings),
            "n_poses_looked_at": self.n_poses_looked_at,
            "looked_at_s": self.looked_at_s,
        }


def info_of(
    reader: LogReader,
    look: QuickLook,
    seen: Seen,
    chosen: list[list[Span]] | None = None,
) -> LogInfo:
    """What is known of a log once it is read, or once the ``chosen`` stretches of it are.

    ``look`` and ``seen`` have seen the rows that were read.
    """
    plan, survey = reader.plan, reader.survey
    counts, estimated = counts_of(reader, chosen)
    names = {role: role for role in ROLES}
    if not seen.efforts:
        names["torque"] = WHEEL_SPEED
    used = {names[role]: facts for role, facts in plan.as_dict().items()}
    if seen.speeds and "torque" in used:
        used.setdefault(WHEEL_SPEED, used["torque"])
    return LogInfo(
        log=str(reader.path),
        size_bytes=reader.size_bytes,
        profile=survey.profile,
        library=survey.library,
        channels=tuple(
            channel_facts(reader, channel_id, names, counts.get(channel_id))
            for channel_id in sorted(survey.catalogue.channels)
        ),
        used=dict.fromkeys(ROLES) | used,
        clocks={
            names[role]: {"clock": clock.name, "offset_s": clock.offset_s, **clock.steps.as_dict()}
            for role, clock in reader.clocks.items()
        },
        clock_notes={names[role]: clock.describe() for role, clock in reader.clocks.items()},
        robot=reader.robot,
        losses={**reader.losses.counts(), "notes": reader.losses.notes},
        remarks=tuple(reader.remarks),
        stamp_notes=tuple(reader.stamp_notes),
        pose_is_odometry=plan.pose_is_odometry,
        has_checksums=reader.has_checksums,
        findings=tuple(f.as_dict() for f in without_explained([*reader.findings, *look.findings()])),
        n_poses_looked_at=look.n_rows,
        looked_at_s=look.span_s,
        complete=chosen is None,
        counts_estimated=estimated,
        n_chunks=len(survey.spans),
        n_chunks_read=len(survey.spans) if chosen is None else sum(map(len, chosen)),
    )


def counts_of(reader: LogReader, chosen: list[list[Span]] | None) -> tuple[dict[int, ChannelCount], bool]:
    """Messages by channel: as counted, by the index, or estimated from the rows of the ``chosen`` stretches;
    and whether they are estimates.
    """
    read = reader.message_counts.by_channel
    if chosen is None:
        return read, False
    if not reader.survey.by_rows:
        return indexed_counts(reader.survey, reader.limits, read), False
    n_rows_read = sum(span.n_rows for spans in chosen for span in spans)
    return estimated_counts(reader.survey, n_rows_read, read), True


def channel_facts(
    reader: LogReader, channel_id: int, names: Mapping[str, str], tally: ChannelCount | None
) -> dict[str, Any]:
    """One channel: what it is, how much of it there is, what it would serve for, its role or why it has
    none. ``names`` of the roles; ``tally`` of its messages.
    """
    book = reader.survey.catalogue
    channel = book.channels[channel_id]
    schema, role = book.schemas.get(channel.schema_id), reader.plan.role(channel_id)
    return {
        "id": channel_id,
        "topic": channel.topic,
        "schema": schema.name if schema else None,
        "encoding": channel.message_encoding,
        "messages": tally.n if tally else 0,
        "rate_hz": tally.rate_hz if tally else None,
        "first_ns": tally.first_ns if tally else None,
        "last_ns": tally.last_ns if tally else None,
        "serves_as": list(reader.plan.serves_as.get(channel_id, ())),
        "role": None if role is None else names[role],
        "why_not": reader.plan.why_not.get(channel_id),
    }
