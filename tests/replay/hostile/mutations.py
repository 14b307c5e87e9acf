"""Damaged logs: intact ones in many forms, of which bits, bytes or stretches were changed, by seed."""

import io
import struct
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer

from wmr_schemas import ModeTrack, PoseTrack, TorqueTrack
from wmr_schemas.messages import METADATA_NAME, jsonmsg, proto, ros2
from wmr_schemas.robot import PAPER_ROBOT

T0_NS, STEP_NS = 1_700_000_000_000_000_000, 20_000_000
N = 150
RULE = "=" * 80
ROS1_HEADER = f"{RULE}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
CODECS = {"cdr": ros2.CODEC, "ros1": ros2.CODEC, "protobuf": proto.CODEC, "json": jsonmsg.CODEC}
FORMS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "stored": {"compression": CompressionType.NONE},
    "unchunked": {"use_chunking": False},
}
CHECKED = {"checked": {}, "unchecked": {"enable_crcs": False}}
INDEXED = {
    "indexed": {},
    "bare": {
        "index_types": IndexType.NONE,
        "repeat_channels": False,
        "repeat_schemas": False,
        "use_statistics": False,
        "use_summary_offsets": False,
    },
}
KINDS = list(product(CODECS, FORMS, CHECKED, INDEXED))
"""Encoding, container, checksums, index of every intact log."""


@dataclass(frozen=True)
class Damaged:
    """A damaged file, and how it came about."""

    content: bytes
    story: str


def damaged(seed: int) -> Damaged:
    """The damaged file of a seed; every kind of intact log comes in turn."""
    rng = np.random.default_rng([seed, 15])
    kind = KINDS[seed % len(KINDS)]
    content = bytearray(intact(kind))
    hits = [DAMAGES[rng.integers(len(DAMAGES))](rng, content) for _ in range(int(rng.integers(1, 5)))]
    return Damaged(bytes(content), f"{'-'.join(kind)}: {'; '.join(hits)}")


@cache
def intact(kind: tuple[str, str, str, str]) -> bytes:
    """The intact log of a kind: 3 s of driving, with truth and every parameter."""
    encoding, form, checked, indexed = kind
    codec, out = CODECS[encoding], io.BytesIO()
    writer = Writer(out, chunk_size=8000, **FORMS[form], **CHECKED[checked], **INDEXED[indexed])
    writer.start(profile=codec.profile, library="intact")
    writer.add_metadata(METADATA_NAME, PAPER_ROBOT.to_metadata())
    ids = []
    for role, topic in (("mode", "/ground_truth/mode"), ("torque", "/wheel_torques"), ("pose", "/pose")):
        schema = getattr(codec, role)
        language = "ros1msg" if encoding == "ros1" else codec.schema_encoding
        definition = as_ros1(schema.definition) if encoding == "ros1" else schema.definition
        schema_id = writer.register_schema(schema.name.replace("/msg/", "/"), language, definition)
        ids.append(
            writer.register_channel(
                topic, "ros1" if encoding == "ros1" else codec.message_encoding, schema_id
            )
        )
    for k, row in enumerate(zip(*messages(encoding), strict=True)):
        for channel_id, message in zip(ids, row, strict=True):
            writer.add_message(channel_id, T0_NS + k * STEP_NS, message, T0_NS + k * STEP_NS, k)
    writer.finish()
    return out.getvalue()


def messages(encoding: str) -> tuple[list[bytes], ...]:
    """Messages of mode, torque and pose."""
    rng = np.random.default_rng(0)
    t_s = np.arange(N) * STEP_NS * 1e-9
    t_ns = T0_NS + np.arange(N) * STEP_NS
    noise = rng.normal(0, 0.002, (3, N))
    pose = PoseTrack(t_ns, 0.8 * t_s + noise[0], 0.1 * t_s**2 + noise[1], 0.2 * t_s + 0.1 * noise[2])
    left, right = 5 + np.sin(t_s), 5 - np.sin(t_s)
    torque = TorqueTrack(t_ns, left, right, np.full(N, 2.3), np.full(N, 2.4))
    mode = ModeTrack(t_ns, np.zeros(N, np.int8))
    codec = CODECS[encoding]
    found = codec.encode_mode(mode), codec.encode_torque(torque, (t_s, t_s)), codec.encode_pose(pose)
    if encoding == "ros1":
        return tuple([ros1_message(cdr) for cdr in role] for role in found)
    return found


def as_ros1(definition: bytes) -> bytes:
    """A ros2msg definition in ROS 1's terms."""
    text = definition.decode()
    start = text.index(f"{RULE}\nMSG: std_msgs/Header")
    text = text[:start] + ROS1_HEADER
    return "\n".join(line.split(" 0")[0].split(" 1")[0] for line in text.splitlines()).encode()


def ros1_message(cdr: bytes) -> bytes:
    """A message of the canonical log without CDR's header and padding."""
    stamp, length = cdr[4:12], struct.unpack_from("<I", cdr, 12)[0]
    out = bytes(4) + stamp + struct.pack("<I", length - 1) + cdr[16 : 16 + length - 1]
    position = 16 + length
    if len(cdr) - position < 16:  # a mode: one byte
        return out + cdr[position : position + 1]
    if len(cdr) == 4 + -(-(position - 4) // 8) * 8 + 56:
        return out + cdr[-56:]
    position += -(position - 4) % 4
    n = struct.unpack_from("<I", cdr, position)[0]
    out, position = out + struct.pack("<I", n), position + 4
    for _ in range(n):
        position += -(position - 4) % 4
        size = struct.unpack_from("<I", cdr, position)[0]
        out += struct.pack("<I", size - 1) + cdr[position + 4 : position + 3 + size]
        position += 4 + size
    for _ in range(3):
        position += -(position - 4) % 4
        count = struct.unpack_from("<I", cdr, position)[0]
        position += 4
        position += -(position - 4) % 8 if count else 0
        out += struct.pack("<I", count) + cdr[position : position + 8 * count]
        position += 8 * count
    return out


# Damage ----------------------------------------


def flip_bit(rng: np.random.Generator, content: bytearray) -> str:
    """One bit."""
    at, bit = int(rng.integers(len(content))), int(rng.integers(8))
    content[at] ^= 1 << bit
    return f"bit {bit} of byte {at}"


def set_byte(rng: np.random.Generator, content: bytearray) -> str:
    """One byte, often to a value at an edge."""
    at = int(rng.integers(len(content)))
    content[at] = int(rng.choice([0, 1, 0x7F, 0x80, 0xFE, 0xFF, int(rng.integers(256))]))
    return f"byte {at} to {content[at]:#04x}"


def set_number(rng: np.random.Generator, content: bytearray) -> str:
    """Four or eight bytes, to a number at an edge."""
    size = int(rng.choice([4, 8]))
    at = int(rng.integers(max(len(content) - size, 1)))
    number = int(rng.choice([0, 1, -1, 2**31 - 1, 2**15, 2**24, 10**6])) & ((1 << 8 * size) - 1)
    content[at : at + size] = number.to_bytes(size, "little")
    return f"{size} bytes at {at} to {number}"


def set_double(rng: np.random.Generator, content: bytearray) -> str:
    """Eight bytes, to a floating-point number at an edge."""
    at = int(rng.integers(max(len(content) - 8, 1)))
    number = float(rng.choice([np.inf, np.nan, 1e308, -1.7e308, 1e200, 5e-324, -0.0, 1e20]))
    content[at : at + 8] = struct.pack("<d", number)
    return f"double at {at} to {number}"


def overwrite(rng: np.random.Generator, content: bytearray) -> str:
    """A stretch, by noise, zeros or text."""
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 200))
    size = min(size, len(content) - at)
    fill = [rng.bytes(size), bytes(size), b"\xff" * size, (b'[{"9e' * size)[:size]][int(rng.integers(4))]
    content[at : at + size] = fill
    return f"{size} bytes at {at} overwritten"


def move(rng: np.random.Generator, content: bytearray) -> str:
    """A stretch, by another of the same file."""
    size = int(rng.integers(1, 400))
    source, target = (int(at) for at in rng.integers(max(len(content) - size, 1), size=2))
    content[target : target + size] = content[source : source + size]
    return f"{size} bytes of {source} over {target}"


def remove(rng: np.random.Generator, content: bytearray) -> str:
    """A stretch taken out."""
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 100))
    del content[at : at + size]
    return f"{size} bytes at {at} taken out"


def insert(rng: np.random.Generator, content: bytearray) -> str:
    """A stretch put in."""
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 100))
    content[at:at] = rng.bytes(size)
    return f"{size} bytes put in at {at}"


def misspell(rng: np.random.Generator, content: bytearray) -> str:
    """A character of a text or number that is readable in the file."""
    at = int(rng.integers(len(content)))
    for place in range(at, len(content)):
        if 0x21 <= content[place] <= 0x7E:
            content[place] = (
                int(rng.integers(0x20, 0x7F)) if rng.random() < 0.7 else int(rng.integers(0x80, 256))
            )
            return f"character at {place}"
    return flip_bit(rng, content)


DAMAGES = [flip_bit, set_byte, set_number, set_double, overwrite, move, remove, insert, misspell, misspell]
