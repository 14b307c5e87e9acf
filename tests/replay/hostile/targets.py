"""What fuzzing runs: one function for each part that reads untrusted bytes.

A part may refuse its input by an error of its own (``Undecodable``, ``UnknownDefinition``, ``WmrError``).
Whatever else comes out of it is a fault, and so is an answer that takes longer than ``MOST_S``.
"""

import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from hostile_files import (
    CASES,
    JOINT_DEFINITION,
    JOINTS,
    POSE,
    POSE_DEFINITION,
    header,
    joints,
    json_pose,
    pose,
    proto_pose,
)
from worker import run

from wmr_replay.ingest import open_log
from wmr_replay.ingest.budgets import Allowance
from wmr_replay.ingest.channels.torque_bindings import TorqueBinding
from wmr_replay.ingest.decoding.bindings import Binding, PoseBinding
from wmr_replay.ingest.decoding.decoder import Decoder
from wmr_replay.ingest.decoding.encodings import Definition, define
from wmr_replay.ingest.decoding.layout import Undecodable
from wmr_replay.ingest.decoding.ros_definitions import UnknownDefinition
from wmr_replay.ingest.mcap.records import MAGIC, Channel, Schema
from wmr_schemas.errors import WmrError

MOST_S = 10.0
STAMP = ("header.stamp.sec", "header.stamp.nanosec")
POSE_FIELDS = PoseBinding("pose.position", "pose.orientation", STAMP)


class Fault(Exception):
    """A part is at fault."""


def read(definition: Definition, binding: Binding, messages: list[bytes]) -> None:
    """Read messages in columns, twice, so that the second time the layouts are known."""
    decoder = Decoder(definition, binding)
    lengths = np.array([len(message) for message in messages])
    data = np.frombuffer(b"".join(messages), np.uint8)
    for _ in range(2):
        columns = decoder.begin(len(messages))
        decoder.read(columns, data, np.cumsum(lengths) - lengths, lengths)
        decoder.close(columns)
        decoder.finish(columns)


def definition_of(
    encoding: str, name: str, language: str, text: bytes, samples: tuple[bytes, ...] = ()
) -> Definition:
    """A channel's definition."""
    return define(Channel(1, 1, "/p", encoding), Schema(1, name, language, text), samples, Allowance())


def definition(data: bytes) -> None:
    """A message definition, and a message that need not fit it."""
    for encoding, language in (("cdr", "ros2msg"), ("cdr", "ros2idl"), ("ros1", "ros1msg")):
        with suppress(UnknownDefinition, Undecodable):
            found = definition_of(encoding, POSE, language, data)
            for message in (pose(3), bytes(300), b"\0\1\0\0" + data):
                with suppress(Undecodable):
                    found.layout(message)


def cdr(data: bytes) -> None:
    """A message in CDR, as a pose and as a joint state."""
    read(
        definition_of("cdr", POSE, "ros2msg", POSE_DEFINITION.encode()),
        POSE_FIELDS,
        [pose(0), data, data[:-1]],
    )
    found = definition_of("cdr", JOINTS, "ros2msg", JOINT_DEFINITION.encode())
    read(found, TorqueBinding(STAMP), [joints(0), data, header(0) + data])


def ros1(data: bytes) -> None:
    """A message in ROS 1's form."""
    found = definition_of("ros1", JOINTS, "ros1msg", JOINT_DEFINITION.encode())
    read(found, TorqueBinding(STAMP), [data, data[4:], header(0)[4:] + data])


def protobuf(data: bytes) -> None:
    """A protobuf message."""
    found = definition_of("protobuf", "made.PoseStamped", "protobuf", proto_pose())
    read(found, PoseBinding("pose.position", "pose.orientation", None), [data, data[1:]])


def descriptor(data: bytes) -> None:
    """A protobuf descriptor."""
    with suppress(UnknownDefinition, Undecodable):
        definition_of("protobuf", "made.PoseStamped", "protobuf", data).layout(data)


def json(data: bytes) -> None:
    """A message in JSON."""
    with suppress(UnknownDefinition):
        found = definition_of("json", POSE, "", b"", (json_pose(0), data))
        read(found, POSE_FIELDS, [json_pose(0), data, data, json_pose(1)])


def records(data: bytes) -> None:
    """The records of a file."""
    with tempfile.TemporaryDirectory() as folder, suppress(WmrError):
        path = Path(folder, "a.mcap")
        path.write_bytes(MAGIC + data)
        for _ in open_log(path).batches():
            pass


def log(data: bytes) -> None:
    """A whole file through ``info`` and ``run``."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        path.write_bytes(data)
        for command in (["info", path], ["run", path, "--out", Path(folder, "out")]):
            code, text = run(command)
            if code not in {0, 3}:
                raise Fault(f"{command[0]} ended with {code}: {text}")


TARGETS: dict[str, Callable[[bytes], None]] = {
    function.__name__: function
    for function in (definition, cdr, ros1, protobuf, descriptor, json, records, log)
}


def warm_up() -> None:
    """Compile what a log needs, which no input shall be charged with."""
    log(CASES["clean"]())
    json(json_pose(3))


def try_out(target: str, data: bytes) -> None:
    """Run a target. Raises whatever comes out of it, or Fault where it takes too long."""
    start = time.process_time()
    TARGETS[target](data)
    if time.process_time() - start > MOST_S:
        raise Fault(f"{target} took {time.process_time() - start:.0f} s")
