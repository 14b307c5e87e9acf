"""Writes the canonical log as MCAP, and the simulator's side files next to it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from mcap.writer import CompressionType, Writer

from wmr_schemas import __version__
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.breaks import BREAKS_NAME, to_metadata
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_files
from wmr_schemas.messages import (
    COMMAND_TOPIC,
    METADATA_NAME,
    MODE_TOPIC,
    POSE_TOPIC,
    STEERING_JOINTS,
    STEERING_TOPIC,
    TORQUE_TOPIC,
    TWIST_TOPIC,
    WHEEL_TOPIC,
    jsonmsg,
    proto,
    ros2,
)
from wmr_schemas.messages.codec import Codec, MessageSchema, WheelAngles
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import (
    CommandTrack,
    Log,
    ModeTrack,
    PoseTrack,
    SteeringTrack,
    TorqueTrack,
    WheelSpeedTrack,
)
from wmr_synth.synthesis import SimulatedLog
from wmr_synth.truth import side_files, write_truth
from wmr_synth.wheel_speed.plan import CommandsAs

Encoding: TypeAlias = Literal["ros2", "protobuf", "json"]
CODECS: dict[str, Codec] = {codec.name: codec for codec in (ros2.CODEC, proto.CODEC, jsonmsg.CODEC)}
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the messages written so far and their total."""

BLOCK_MESSAGES = 65_536
DEFAULT_CHUNK_BYTES = 1 << 20


def qos(depth: int, *, latched: bool = False) -> str:
    """``offered_qos_profiles`` as rosbag2 writes it: keep last, reliable, volatile or transient local.

    The numbers are those of rmw; every distribution from Humble on reads them.
    """
    forever = "\n    sec: 9223372036\n    nsec: 854775807"
    return (
        f"- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {1 if latched else 2}\n"
        f"  deadline:{forever}\n  lifespan:{forever}\n"
        f"  liveliness: 1\n  liveliness_lease_duration:{forever}\n"
        "  avoid_ros_namespace_conventions: false"
    )


@dataclass(frozen=True, eq=False)
class Channel:
    """One channel to be written: its stamps, and the messages of a range of rows."""

    topic: str
    schema: MessageSchema
    t_ns: I64
    messages: Callable[[slice], list[bytes]]
    qos: str


def mode_channel(codec: Codec, track: ModeTrack) -> Channel:
    """The truth, latched, so that who comes late still gets it."""
    return Channel(
        MODE_TOPIC,
        codec.mode,
        track.t_ns,
        lambda rows: codec.encode_mode(ModeTrack(track.t_ns[rows], track.mode[rows])),
        qos(1, latched=True),
    )


def torque_channel(codec: Codec, track: TorqueTrack, angles: WheelAngles | None) -> Channel:
    """Wheel torques, speeds and angles."""

    def messages(rows: slice) -> list[bytes]:
        piece = TorqueTrack(**{name: column[rows] for name, column in vars(track).items()})
        return codec.encode_torque(piece, None if angles is None else (angles[0][rows], angles[1][rows]))

    return Channel(TORQUE_TOPIC, codec.torque, track.t_ns, messages, qos(10))


def pose_channel(codec: Codec, track: PoseTrack) -> Channel:
    """The external pose."""

    def messages(rows: slice) -> list[bytes]:
        return codec.encode_pose(PoseTrack(**{name: column[rows] for name, column in vars(track).items()}))

    return Channel(POSE_TOPIC, codec.pose, track.t_ns, messages, qos(10))


def wheel_channel(codec: Codec, track: WheelSpeedTrack, angles: WheelAngles | None) -> Channel:
    """Wheel speeds and angles, of a log without torques."""

    def messages(rows: slice) -> list[bytes]:
        position = [] if angles is None else [angle[rows] for angle in angles]
        return codec.encode_joints(
            track.t_ns[rows], (position, [track.left_radps[rows], track.right_radps[rows]], [])
        )

    return Channel(WHEEL_TOPIC, codec.torque, track.t_ns, messages, qos(10))


def command_channel(codec: Codec, track: CommandTrack) -> Channel:
    """Commanded wheel speeds."""

    def messages(rows: slice) -> list[bytes]:
        return codec.encode_joints(
            track.t_ns[rows], ([], [track.left_radps[rows], track.right_radps[rows]], [])
        )

    return Channel(COMMAND_TOPIC, codec.torque, track.t_ns, messages, qos(10))


def steering_channel(codec: Codec, track: SteeringTrack) -> Channel:
    """What a steered robot is steered by, as the position of one joint."""

    def messages(rows: slice) -> list[bytes]:
        return codec.encode_joints(track.t_ns[rows], ([track.position[rows]], [], []), STEERING_JOINTS)

    return Channel(STEERING_TOPIC, codec.torque, track.t_ns, messages, qos(10))


def twist_channel(codec: Codec, track: CommandTrack, robot: RobotParameters) -> Channel:
    """The commands as a twist, by the robot's nominal lengths."""
    radius_m, half_track_m = robot.wheel_radius_m, robot.half_track_m
    if radius_m is None or half_track_m is None:
        raise InvalidSetting("commands as a twist need the robot's wheel_radius_m and half_track_m")
    v_mps = radius_m * (track.right_radps + track.left_radps) / 2
    yaw_rate = radius_m * (track.right_radps - track.left_radps) / (2 * half_track_m)

    def messages(rows: slice) -> list[bytes]:
        return codec.encode_twist(track.t_ns[rows], v_mps[rows], yaw_rate[rows])

    return Channel(TWIST_TOPIC, codec.twist, track.t_ns, messages, qos(10))


def channels_of(
    log: Log, codec: Codec, angles: WheelAngles | None, commands_as: CommandsAs = "wheels"
) -> list[Channel]:
    """The log's channels in the order in which messages of one stamp are written: mode, commands, torque or
    wheel speeds, pose.
    """
    channels = [] if log.mode is None else [mode_channel(codec, log.mode)]
    if log.commands is not None and commands_as != "none":
        twist = commands_as == "twist"
        made = (
            twist_channel(codec, log.commands, log.robot) if twist else command_channel(codec, log.commands)
        )
        channels.append(made)
    if log.steering is not None:
        channels.append(steering_channel(codec, log.steering))
    if log.torque is not None:
        together = log.wheels is None or bool(np.isfinite(log.torque.left_radps).any())
        channels.append(torque_channel(codec, log.torque, angles if together else None))
    if log.wheels is not None and (log.torque is None or not together):
        channels.append(wheel_channel(codec, log.wheels, angles))
    return [*channels, pose_channel(codec, log.pose)]


def merged(channels: list[Channel]) -> tuple[np.ndarray, I64]:
    """The channel index and the stamp of every message, by stamp; ties in the order of the channels."""
    kind = np.repeat(np.arange(len(channels)), [len(channel.t_ns) for channel in channels])
    t_ns = np.concatenate([channel.t_ns for channel in channels])
    order = np.argsort(t_ns, kind="stable")
    return kind[order], t_ns[order]


def in_order(channels: list[Channel]) -> Iterator[list[tuple[int, int, int, bytes]]]:
    """Blocks of (channel index, sequence, stamp in ns, message) in the order of the file."""
    kind, t_ns = merged(channels)
    done = np.zeros(len(channels), int)
    for start in range(0, len(kind), BLOCK_MESSAGES):
        block = kind[start : start + BLOCK_MESSAGES]
        data = np.empty(len(block), object)
        sequence = np.empty(len(block), int)
        for index, channel in enumerate(channels):
            mine = np.flatnonzero(block == index)
            rows = slice(done[index], done[index] + len(mine))
            data[mine] = channel.messages(rows) if len(mine) else []
            sequence[mine] = np.arange(rows.start, rows.stop)
            done[index] = rows.stop
        stamps = t_ns[start : start + BLOCK_MESSAGES]
        yield list(zip(block.tolist(), sequence.tolist(), stamps.tolist(), data.tolist(), strict=True))


def write_mcap(
    log: Log,
    path: Path,
    *,
    encoding: str = "ros2",
    angles: WheelAngles | None = None,
    commands_as: CommandsAs = "wheels",
    chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    progress: Progress | None = None,
) -> None:
    """Write a log as MCAP at ``path`` at once: log time and publish time are the header's stamp.

    ``angles`` are the wheel angles (left, right) at the rows of torques or wheel speeds; without them the
    positions stay empty. ``commands_as`` says how commands are written.
    ``chunk_bytes`` is the size at which a chunk is closed.
    """
    codec = find_codec(encoding)
    channels = channels_of(log, codec, angles, commands_as)
    metadata = {METADATA_NAME: log.robot.to_metadata()}
    metadata |= {BREAKS_NAME: to_metadata(log.breaks_ns)} if log.breaks_ns else {}
    write_channels(channels, codec, metadata, path, chunk_bytes, progress)


def write_played(drive: Mapping[str, F64], robot: RobotParameters, start_ns: int, path: Path) -> None:
    """Write a drive as a robot plays it, in ROS 2's encoding: `/cmd_vel`, and its torques as feedforward.

    ``drive`` holds ``t_s, v_long_mps, yaw_rate_radps, left_nm, right_nm``, (n,) each.
    """
    codec = find_codec("ros2")
    t_ns = start_ns + np.rint(drive["t_s"] * NS_PER_S).astype(np.int64)

    def twists(rows: slice) -> list[bytes]:
        return codec.encode_twist(t_ns[rows], drive["v_long_mps"][rows], drive["yaw_rate_radps"][rows])

    def torques(rows: slice) -> list[bytes]:
        return codec.encode_joints(t_ns[rows], ([], [], [drive["left_nm"][rows], drive["right_nm"][rows]]))

    channels = [
        Channel(TWIST_TOPIC, codec.twist, t_ns, twists, qos(10)),
        Channel(TORQUE_TOPIC, codec.torque, t_ns, torques, qos(10)),
    ]
    write_channels(channels, codec, {METADATA_NAME: robot.to_metadata()}, path)


def write_channels(
    channels: list[Channel],
    codec: Codec,
    metadata: Mapping[str, Mapping[str, str]],
    path: Path,
    chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    progress: Progress | None = None,
) -> None:
    """Write channels and metadata records as MCAP at ``path``."""
    total = sum(len(channel.t_ns) for channel in channels)
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_bytes, compression=CompressionType.ZSTD)
        writer.start(codec.profile, f"wmr-replay/{__version__}")
        for name, record_of in metadata.items():
            writer.add_metadata(name, dict(record_of))
        ids = [register(writer, codec, channel) for channel in channels]
        written = 0
        for block in in_order(channels):
            for index, sequence, t_ns, data in block:
                writer.add_message(ids[index], t_ns, data, t_ns, sequence)
            written += len(block)
            if progress is not None:
                progress(written, total)
        writer.finish()  # type: ignore[no-untyped-call]


def register(writer: Writer, codec: Codec, channel: Channel) -> int:
    """The channel's schema and the channel itself; its id."""
    schema_id = writer.register_schema(channel.schema.name, codec.schema_encoding, channel.schema.definition)
    metadata = {"offered_qos_profiles": channel.qos} if codec.profile == "ros2" else {}
    return writer.register_channel(channel.topic, codec.message_encoding, schema_id, metadata)


def find_codec(encoding: str) -> Codec:
    """The codec of that name."""
    if encoding not in CODECS:
        raise InvalidSetting(f"no encoding {encoding!r}; known are {', '.join(CODECS)}")
    return CODECS[encoding]


def record(
    simulated: SimulatedLog,
    path: Path,
    *,
    encoding: str = "ros2",
    truth: bool = True,
    chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    mode_topic: bool = True,
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Write a simulated log, and with ``truth`` its mode channel and side files; the paths written.

    Without ``mode_topic`` the mode stands in the side files alone. The files appear together, under their
    names, when all are complete. Without ``truth``, side files that an earlier log left under the same name
    are removed: they would describe another log.
    """
    log = simulated.log
    if not (truth and mode_topic):
        log = replace(log, mode=None)
    facts_path, states_path = side_files(path)
    paths = (path, facts_path, states_path) if truth else (path,)
    with whole_files(dict(enumerate(paths))) as temporary:
        write_mcap(
            log,
            temporary[0],
            encoding=encoding,
            angles=simulated.wheel_angles_rad,
            commands_as=simulated.commands_as,
            chunk_bytes=chunk_bytes,
            progress=progress,
        )
        if truth:
            write_truth(simulated, temporary[1], temporary[2])
    if not truth:
        for stale in (facts_path, states_path):
            stale.unlink(missing_ok=True)
    return paths
