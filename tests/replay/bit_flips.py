"""Small logs with flipped bits: which of them lose messages, and whether anything is said about it.

``python tests/replay/bit_flips.py [N]`` replays N damaged logs (default 2000) and prints a table.
"""

import io
import struct
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer

from wmr_replay.ingest import open_log
from wmr_schemas import PoseTrack, TorqueTrack
from wmr_schemas.errors import WmrError
from wmr_schemas.messages import METADATA_NAME, jsonmsg, proto, ros2
from wmr_schemas.robot import RobotParameters

T0, STEP_NS, N = 1_700_000_000_000_000_000, 20_000_000, 200
CODECS = {codec.name: codec for codec in (ros2.CODEC, proto.CODEC, jsonmsg.CODEC)}
MESSAGE_HEAD = struct.Struct("<BQHI")
"""Opcode, length, channel and sequence: what decides whether a message is found, and as whose."""


@dataclass(frozen=True)
class Form:
    """How a log is written."""

    compression: str
    """``zstd``, ``lz4``, ``stored``; ``unchunked`` without chunks."""
    crc: bool
    index: bool
    statistics: bool
    sequences: bool
    encoding: str = "ros2"

    @property
    def has_checksums(self) -> bool:
        """Whether a checksum covers the messages."""
        return self.crc and self.compression != "unchunked"


def forms() -> list[Form]:
    """Every combination that a writer can make, CDR; and the other encodings where nothing protects them."""
    switches = list(product((True, False), repeat=4))
    found = [Form(kind, *each) for kind in ("zstd", "lz4", "stored", "unchunked") for each in switches]
    found = [form for form in found if form.compression != "unchunked" or not (form.crc or form.index)]
    bare = [Form("unchunked", False, False, *each) for each in product((True, False), repeat=2)]
    return found + [
        Form(form.compression, form.crc, form.index, form.statistics, form.sequences, encoding)
        for form in bare
        for encoding in ("protobuf", "json")
    ]


def log_bytes(form: Form, **more: bool) -> bytes:
    """A log of pose and torques in turns, and a channel that serves as nothing."""
    codec, out = CODECS[form.encoding], io.BytesIO()
    kind = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}.get(
        form.compression, CompressionType.NONE
    )
    writer = Writer(
        out,
        chunk_size=4000,
        compression=kind,
        use_chunking=form.compression != "unchunked",
        enable_crcs=form.crc,
        index_types=IndexType.ALL if form.index else IndexType.NONE,
        use_statistics=form.statistics,
        **more,
    )
    writer.start(codec.profile, "test")
    writer.add_metadata(METADATA_NAME, RobotParameters(alpha=0.02, half_track_m=1.0).to_metadata())
    t_ns, s = T0 + STEP_NS * np.arange(N), 0.02 * np.arange(N)
    pose = codec.encode_pose(PoseTrack(t_ns, s, 0.1 * s, 0.2 * s))
    torque = codec.encode_torque(TorqueTrack(t_ns, 10 + s, 12 - s, 1 + s, 1 + 0.9 * s), None)
    ids = []
    for topic, schema in (("/pose", codec.pose), ("/wheel_torques", codec.torque), ("/other", codec.pose)):
        schema_id = writer.register_schema(schema.name, codec.schema_encoding, schema.definition)
        ids.append(writer.register_channel(topic, codec.message_encoding, schema_id))
    for k in range(N):
        t = int(t_ns[k])
        for channel, data in zip(ids, (pose[k], torque[k], pose[k]), strict=True):
            if channel != ids[2] or k % 4 == 0:
                sequence = (k // 4 if channel == ids[2] else k) + 1 if form.sequences else 0
                writer.add_message(channel, t, data, t, sequence)
    writer.finish()
    return out.getvalue()


def message_heads(content: bytes) -> list[int]:
    """Offsets of the message records outside chunks or in stored ones."""
    starts = []
    for k in range(N):
        stamp = struct.pack("<QQ", T0 + STEP_NS * k, T0 + STEP_NS * k)
        at = content.find(stamp)
        while at > 0:
            if content[at - MESSAGE_HEAD.size] == 5:
                starts.append(at - MESSAGE_HEAD.size)
            at = content.find(stamp, at + 1)
    return starts


def flipped(content: bytes, rng: np.random.Generator, heads: list[int]) -> bytes:
    """Bits changed: one to four anywhere, or with ``heads`` one in type, length or channel of a message."""
    damaged = bytearray(content)
    if heads:
        places = [int(rng.choice(heads)) + int(rng.integers(MESSAGE_HEAD.size - 4))]
    else:
        places = rng.integers(8, len(damaged), rng.integers(1, 5)).tolist()
    for place in places:
        damaged[place] ^= 1 << int(rng.integers(8))
    return bytes(damaged)


@dataclass(frozen=True)
class Found:
    """Rows by role, and everything that is said about losses."""

    rows: dict[str, int]
    said: frozenset[str]


def read(path: Path, content: bytes, *, everything: bool = False) -> Found | None:
    """What is read of a log; None where it is refused with a sentence."""
    path.write_bytes(content)
    try:
        reader = open_log(path)
        batches = list(reader.batches(everything=everything))
    except WmrError:
        return None
    rows = {role: sum(len(getattr(batch, role)) for batch in batches) for role in ("pose", "torque")}
    said = [*reader.losses.notes, *reader.remarks, *reader.stamp_notes]
    said += [f"{name} {n}" for name, n in reader.losses.counts().items() if n]
    return Found(rows, frozenset(said))


def is_silent(before: Found, after: Found | None) -> bool:
    """Whether rows are missing and nothing is said that is not said of the intact log. A role that is gone as
    a whole is seen by everyone.
    """
    if after is None or after.said - before.said:
        return False
    return any(0 < after.rows[role] < n for role, n in before.rows.items())


def has_lost(before: Found, after: Found | None) -> bool:
    """Whether any row is missing."""
    return after is None or any(after.rows[role] < n for role, n in before.rows.items())


def campaign(n: int, seed: int = 0) -> Iterator[tuple[Form, bool, bool, bytes]]:
    """For n damaged logs, spread over the forms: whether rows are lost, and whether silently."""
    rng, known = np.random.default_rng(seed), forms()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        made = [log_bytes(form) for form in known]
        intact = [read(path, content) for content in made]
        places = [message_heads(content) for content in made]
        for k in range(n):
            which = k % len(known)
            damaged = flipped(made[which], rng, places[which] if (k // len(known)) % 2 else [])
            before, after = intact[which], read(path, damaged)
            assert before is not None
            silent = is_silent(before, after)
            yield known[which], has_lost(before, after), silent, damaged if silent else b""


def main() -> None:
    """Print how many logs lose messages and say nothing, by form."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    keep = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    total, lost, silent = Counter[str](), Counter[str](), Counter[str]()
    for k, (form, is_lost, nothing_said, content) in enumerate(campaign(n)):
        protection = [name for name in ("crc", "index", "statistics", "sequences") if getattr(form, name)]
        key = f"{form.compression:10}{' '.join(protection) or 'nothing'}"
        key = key if form.encoding == "ros2" else f"{key} ({form.encoding})"
        total[key] += 1
        lost[key] += is_lost
        silent[key] += nothing_said
        if keep and content:
            (keep / f"{k}.mcap").write_bytes(content)
    for key in sorted(total):
        print(f"{key:60}{total[key]:6}{lost[key]:6}{silent[key]:6}")
    print(f"{'all':60}{total.total():6}{lost.total():6}{silent.total():6}")


if __name__ == "__main__":
    main()
