"""Logs whose channels are stamped by other clocks than the recorder's."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.writer import Writer

from wmr_schemas.arrays import F64
from wmr_schemas.messages import METADATA_NAME
from wmr_schemas.signals import Log
from wmr_synth.recorder import channels_of, find_codec, register

TOPICS = {"pose": "/pose", "torque": "/wheel_torques", "truth": "/ground_truth/mode"}
START_NS = 1_700_000_000 * 10**9
Seconds = Callable[[F64], F64]
"""From seconds since the log's start to seconds."""


def nothing(t_s: F64) -> F64:
    """0 s throughout."""
    return np.zeros_like(t_s)


def write_clocks(
    log: Log,
    path: Path,
    *,
    stamps: dict[str, Seconds] | None = None,
    delays: dict[str, Seconds] | None = None,
    recorder: Seconds = nothing,
) -> Path:
    """Write a log that was measured at its stamps since 2023, as a recorder sees it.

    By role, ``stamps`` is what a channel's clock is off, and ``delays`` how long its transport takes;
    ``recorder`` is what the recorder's clock is off. The order of the file is that of the arrivals.
    """
    codec = find_codec("ros2")
    roles = {topic: role for role, topic in TOPICS.items()}
    first_ns = int(log.pose.t_ns[0])
    messages, entries = [], []
    for index, channel in enumerate(channels_of(log, codec, None)):
        role = roles[channel.topic]
        t_s = (channel.t_ns - first_ns) * 1e-9
        off_ns = np.rint(1e9 * (stamps or {}).get(role, nothing)(t_s)).astype(np.int64)
        arrival_s = t_s + (delays or {}).get(role, nothing)(t_s)
        logged_s = arrival_s + recorder(arrival_s)
        stamps_ns = (START_NS + channel.t_ns - first_ns + off_ns).tolist()
        whole = channel.messages(slice(0, len(t_s)))
        messages.append([stamped(message, t_ns) for message, t_ns in zip(whole, stamps_ns, strict=True)])
        logged_ns = START_NS + np.rint(1e9 * logged_s).astype(np.int64)
        entries += zip(arrival_s, [index] * len(t_s), range(len(t_s)), logged_ns.tolist(), strict=True)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(codec.profile, "made up")
        writer.add_metadata(METADATA_NAME, log.robot.to_metadata())
        ids = [register(writer, codec, channel) for channel in channels_of(log, codec, None)]
        for _, index, k, log_ns in sorted(entries):
            writer.add_message(ids[index], log_ns, messages[index][k], log_ns, k)
        writer.finish()
    return path


def stamped(message: bytes, t_ns: int) -> bytes:
    """A CDR message that begins with a header, with another stamp."""
    return message[:4] + struct.pack("<iI", *divmod(t_ns, 10**9)) + message[12:]
