"""Property test: the columns of any log, intact or damaged, are those of the reference reader.

Encoding, message layouts, order, chunking, compression, indexes, repeated records and damage vary together.
The reference is ``mcap`` with ``mcap-ros2-support``, ``mcap-protobuf-support`` and ``json``.
"""

import io
import json
import math
import struct
from dataclasses import dataclass
from functools import cache

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.json_format import ParseDict
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.exceptions import McapError
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoders
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.decoder import DecoderFactory as Ros2Decoders

from wmr_replay.ingest import open_log
from wmr_schemas.errors import WmrError
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.messages import jsonmsg, proto, ros2

T0 = 1_700_000_000_000_000_000
WHEELS = ["left_wheel_joint", "right_wheel_joint"]
CODECS = {"cdr": ros2.CODEC, "protobuf": proto.CODEC, "json": jsonmsg.CODEC}


# Writing ----------------------------------------


@dataclass(frozen=True)
class Said:
    """One message: what it says, in the words of its encoding, and when it was logged."""

    role: str
    fields: dict
    log_ns: int


@cache
def encoder(encoding: str, role: str):
    """``fields -> bytes`` by somebody else's encoder."""
    schema = getattr(CODECS[encoding], role) if role != "chat" else None
    if encoding == "json" or schema is None:
        return lambda fields: json.dumps(fields).encode()
    if encoding == "cdr":
        return serialize_dynamic(schema.name, schema.definition.decode())[schema.name]
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.definition).file:
        pool.AddSerializedFile(file.SerializeToString())
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))

    def encode(fields):
        stamp = fields["timestamp"]
        message = ParseDict({k: v for k, v in fields.items() if k != "timestamp"}, kind())
        message.timestamp.seconds, message.timestamp.nanos = stamp["sec"], stamp["nsec"]
        return message.SerializeToString()

    return encode


def log_bytes(encoding: str, said: list[Said], options: dict) -> bytes:
    """The log of these messages, in this order."""
    out, codec = io.BytesIO(), CODECS[encoding]
    writer = Writer(out, **options)
    writer.start(profile=codec.profile, library="test")
    channels = {}
    for role, topic in (("chat", "/chat"), ("pose", "/pose"), ("torque", "/wheel_torques")):
        if any(message.role == role for message in said):
            schema = getattr(codec, role) if role != "chat" else None
            schema_id = (
                writer.register_schema(schema.name, codec.schema_encoding, schema.definition) if schema else 0
            )
            how = codec.message_encoding if schema else "json"
            channels[role] = writer.register_channel(topic, how, schema_id)
    for k, message in enumerate(said):
        data = encoder(encoding, message.role)(message.fields)
        writer.add_message(channels[message.role], message.log_ns, data, message.log_ns + 1, k)
    writer.finish()
    return out.getvalue()


# The reference ----------------------------------------


def value_at(thing, path):
    """A field of an object or a dictionary."""
    for name in path.split("."):
        thing = thing[name] if isinstance(thing, dict) else getattr(thing, name)
    return thing


def stamp_of(thing) -> int:
    for sec, nanosec in (
        ("header.stamp.sec", "header.stamp.nanosec"),
        ("timestamp.sec", "timestamp.nsec"),
        ("timestamp.seconds", "timestamp.nanos"),
    ):
        try:
            return int(value_at(thing, sec)) * 10**9 + int(value_at(thing, nanosec))
        except (AttributeError, KeyError):
            continue
    raise AssertionError("no stamp")


def pose_row(thing) -> tuple:
    x, y, z, w = (value_at(thing, f"pose.orientation.{axis}") for axis in "xyzw")
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return stamp_of(thing), value_at(thing, "pose.position.x"), value_at(thing, "pose.position.y"), yaw


def torque_row(thing) -> tuple:
    names = list(value_at(thing, "name"))

    def wheel(array, name):
        values = list(value_at(thing, array))
        return values[names.index(name)] if names.index(name) < len(values) else math.nan

    return stamp_of(thing), *(wheel(array, name) for array in ("effort", "velocity") for name in WHEELS)


def reference_rows(content: bytes) -> dict[str, list[tuple]]:
    """Rows by role, as far as the reference reader comes."""
    schemas, channels, rows = {}, {}, {"pose": [], "torque": []}
    decoders = {"cdr": Ros2Decoders(), "protobuf": ProtobufDecoders()}
    try:
        for record in StreamReader(io.BytesIO(content), validate_crcs=True).records:
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message) and channels[record.channel_id].topic != "/chat":
                channel = channels[record.channel_id]
                how, schema = channel.message_encoding, schemas.get(channel.schema_id)
                decode = json.loads if how == "json" else decoders[how].decoder_for(how, schema)
                role, row = ("pose", pose_row) if channel.topic == "/pose" else ("torque", torque_row)
                rows[role].append(row(decode(record.data)))
    except (McapError, EOFError, struct.error, ValueError, KeyError):
        pass
    return rows


# Ours ----------------------------------------


def our_rows(path, content: bytes):
    """Rows by role, and the losses."""
    path.write_bytes(content)
    reader = open_log(path, LogMapping(clock="header"))
    batches = list(reader.batches())
    rows = {
        role: [
            (t, *values)
            for batch in batches
            for t, values in zip(
                getattr(batch, role).t_ns.tolist(), getattr(batch, role).values.T.tolist(), strict=True
            )
        ]
        for role in ("pose", "torque")
    }
    return rows, reader.losses


def equal(ours: list[tuple], theirs: list[tuple]) -> bool:
    """To the last bit, but for yaw, which is equal up to rounding."""
    if [row[0] for row in ours] != [row[0] for row in theirs]:
        return False
    a, b = (np.array([row[1:] for row in rows], float) for rows in (ours, theirs))
    if not len(a) or a.shape[1] == 4:
        return np.array_equal(a, b, equal_nan=True)
    return np.array_equal(a[:, :2], b[:, :2]) and bool(np.all(np.cos(a[:, 2] - b[:, 2]) > 1 - 1e-12))


# Any log ----------------------------------------

numbers = st.one_of(st.sampled_from([0.0, -0.0, 1.0]), st.floats(-1e9, 1e9), st.integers(-5, 5).map(float))
stamps = st.integers(0, 3 * 10**9).map(lambda t: T0 + t)
frames = st.sampled_from(["map", "", "odom_combined", 'a "map"'])


def stamped(encoding: str, t_ns: int, frame: str) -> dict:
    sec, nanosec = divmod(t_ns, 10**9)
    if encoding == "cdr":
        return {"header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}}
    return {"timestamp": {"sec": sec, "nsec": nanosec}, "frame_id": frame}


@st.composite
def poses(draw, encoding: str) -> Said:
    t_ns, half = draw(stamps), draw(st.floats(-1.5, 1.5))
    position = dict(zip("xyz", draw(st.tuples(numbers, numbers, numbers)), strict=True))
    orientation = {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}
    fields = stamped(encoding, t_ns, draw(frames)) | {
        "pose": {"position": position, "orientation": orientation}
    }
    return Said("pose", fields, draw(stamps))


@st.composite
def torques(draw, encoding: str) -> Said:
    names = draw(st.permutations(draw(st.sampled_from([WHEELS, [*WHEELS, "arm_joint"]]))))
    array = st.lists(numbers, min_size=len(names), max_size=len(names))
    fields = stamped(encoding, draw(stamps), draw(frames)) | {
        "name": list(names),
        "position": [],
        "velocity": draw(st.one_of(array, st.just([]))),
        "effort": draw(st.one_of(array, array, st.just([]))),
    }
    return Said("torque", fields, draw(stamps))


chats = st.builds(lambda text, t: Said("chat", {"text": text}, t), st.text(max_size=40), stamps)
flags = st.sampled_from([IndexType.ALL, IndexType.NONE, IndexType.CHUNK, IndexType.MESSAGE])
writer_options = st.fixed_dictionaries({
    "compression": st.sampled_from(CompressionType),
    "chunk_size": st.sampled_from([1, 200, 1000, 1 << 20]),
    "use_chunking": st.sampled_from([True, True, True, False]),
    "index_types": flags,
    "repeat_channels": st.booleans(),
    "repeat_schemas": st.booleans(),
    "use_statistics": st.booleans(),
    "use_summary_offsets": st.booleans(),
    "enable_crcs": st.booleans(),
})  # fmt: skip


@st.composite
def logs(draw) -> tuple[str, list[Said], dict]:
    """Encoding, messages in the order of the file, and how they are written."""
    encoding = draw(st.sampled_from(sorted(CODECS)))
    some = st.one_of(poses(encoding), poses(encoding), torques(encoding), torques(encoding), chats)
    said = [draw(poses(encoding)), *draw(st.lists(some, max_size=25))]
    return encoding, draw(st.permutations(said)), draw(writer_options)


def any_log(n: int):
    return settings(max_examples=n, deadline=None, suppress_health_check=list(HealthCheck))


@any_log(100)
@given(log=logs())
def test_the_columns_of_any_log_equal_the_reference(tmp_path_factory, log):
    content = log_bytes(*log)
    ours, losses = our_rows(tmp_path_factory.mktemp("any") / "a.mcap", content)
    theirs = reference_rows(content)
    assert not losses.any(), losses.notes
    assert equal(ours["pose"], theirs["pose"])
    assert equal(ours["torque"], theirs["torque"])


@any_log(100)
@given(log=logs(), at=st.floats(0, 1, exclude_max=True))
def test_cut_off_anywhere_any_log_gives_at_least_what_the_reference_gives(tmp_path_factory, log, at):
    content = log_bytes(*log)
    cut = content[: int(at * len(content))]
    whole, intact = reference_rows(content), reference_rows(cut)
    try:
        ours, losses = our_rows(tmp_path_factory.mktemp("cut") / "a.mcap", cut)
    except WmrError:
        assert not intact["pose"]
        return
    for role, rows in ours.items():
        assert len(rows) >= len(intact[role])
        assert equal(rows, whole[role][: len(rows)])
    assert losses.truncated
    assert losses.notes


@any_log(100)
@given(log=logs(), flips=st.lists(st.integers(0, 1 << 24), min_size=1, max_size=3))
def test_flipped_bits_in_any_log_give_rows_of_it_or_a_named_error(tmp_path_factory, log, flips):
    content, options = log_bytes(*log), log[2]
    damaged = bytearray(content)
    for flip in flips:
        damaged[flip // 8 % len(content)] ^= 1 << flip % 8
    try:
        ours, _ = our_rows(tmp_path_factory.mktemp("flip") / "a.mcap", bytes(damaged))
    except WmrError:
        return
    if options["use_chunking"] and options["enable_crcs"]:
        stamps_there = {row[0] for row in reference_rows(content)["pose"]}
        assert {row[0] for row in ours["pose"]} <= stamps_there
