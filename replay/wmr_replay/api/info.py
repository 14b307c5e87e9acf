"""What a log holds, and what a replay would use of it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from wmr_replay.ingest import LogReader
from wmr_schemas.robot import RobotParameters

ROLES = ("pose", "torque", "truth")


@dataclass(frozen=True)
class LogInfo:
    """What a log holds, and what a replay would use of it. Complete: the whole file was read.

    Attributes:
        channels: One entry per channel: topic, schema, encoding, messages, rate, times, role or ``why_not``.
        used: By role (``pose``, ``torque``, ``truth``) the channel and how it is read; None without one.
        clocks: By role the clock in use, its offset from log time, duplicates, steps back, gaps, jitter.
        losses: Counters of what could not be used, and ``notes``.
        stamp_notes: What is out of the ordinary in the stamps, in words.
        pose_is_odometry: Whether the pose, by its name, was integrated from wheel speeds.
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
            "profile": self.profile,
            "library": self.library,
            "channels": list(self.channels),
            "used": self.used,
            "clocks": self.clocks,
            "robot": self.robot.known(),
            "losses": self.losses,
            "remarks": list(self.remarks),
        }


def info_of(reader: LogReader) -> LogInfo:
    """What is known of a log once it is read."""
    plan, survey = reader.plan, reader.survey
    return LogInfo(
        log=str(reader.path),
        size_bytes=reader.size_bytes,
        profile=survey.profile,
        library=survey.library,
        channels=tuple(channel_facts(reader, channel_id) for channel_id in sorted(survey.catalogue.channels)),
        used={role: plan.as_dict().get(role) for role in ROLES},
        clocks={
            role: {"clock": clock.name, "offset_s": clock.offset_s, **clock.steps.as_dict()}
            for role, clock in reader.clocks.items()
        },
        clock_notes={role: clock.describe() for role, clock in reader.clocks.items()},
        robot=reader.robot,
        losses={**reader.losses.counts(), "notes": reader.losses.notes},
        remarks=tuple(reader.remarks),
        stamp_notes=tuple(reader.stamp_notes),
        pose_is_odometry=plan.pose_is_odometry,
    )


def channel_facts(reader: LogReader, channel_id: int) -> dict[str, Any]:
    """One channel: what it is, how much of it there is, and its role or why it has none."""
    book, tally = reader.survey.catalogue, reader.message_counts.by_channel.get(channel_id)
    channel = book.channels[channel_id]
    schema = book.schemas.get(channel.schema_id)
    return {
        "id": channel_id,
        "topic": channel.topic,
        "schema": schema.name if schema else None,
        "encoding": channel.message_encoding,
        "messages": tally.n if tally else 0,
        "rate_hz": tally.rate_hz if tally else None,
        "first_ns": tally.first_ns if tally else None,
        "last_ns": tally.last_ns if tally else None,
        "role": reader.plan.role(channel_id),
        "why_not": reader.plan.why_not.get(channel_id),
    }
