"""Copy a log with its messages shuffled within windows of their log time, chunk by chunk.

    python bench/disorder.py LOG COPY [--window 1.8]

The copy has neither index nor summary. To measure time and memory of `run` on it:

    /usr/bin/time -v wmr-replay run COPY
"""

import argparse
import struct
from pathlib import Path

import numpy as np
import zstandard

from wmr_replay.ingest.mcap.chunks import load
from wmr_replay.ingest.mcap.records import HEAD, MAGIC, Opcode
from wmr_replay.ingest.mcap.survey import survey
from wmr_replay.ingest.mcap.walk import HEAD_BYTES, MESSAGE_HEAD_BYTES, walk
from wmr_replay.ingest.mcap.workspace import Workspace

SEED = 0


def record(opcode: Opcode, content: bytes) -> bytes:
    """One record of a file."""
    return HEAD.pack(opcode, len(content)) + content


def shuffled(data: np.ndarray, window_ns: int, rng: np.random.Generator) -> bytes:
    """The records of a chunk: schemas and channels, then messages in random order within each window."""
    found = walk(data)
    messages, others = found.messages, found.others.tolist()
    sizes = [HEAD_BYTES + HEAD.unpack(data[k : k + HEAD.size].tobytes())[1] for k in others]
    pieces = [data[k : k + size].tobytes() for k, size in zip(others, sizes, strict=True)]
    order = np.lexsort((rng.random(len(messages)), messages.log_ns // window_ns))
    starts = messages.offset - HEAD_BYTES - MESSAGE_HEAD_BYTES
    stops = messages.offset + messages.length
    whole = data.tobytes()
    pieces += [whole[a:b] for a, b in zip(starts[order].tolist(), stops[order].tolist(), strict=True)]
    return b"".join(pieces)


def disorder(path: Path, copy: Path, window_s: float) -> None:
    """Write the shuffled copy."""
    rng, pack, workspace = np.random.default_rng(SEED), zstandard.ZstdCompressor(), Workspace()
    window_ns = round(window_s * 1e9)
    with path.open("rb") as file, copy.open("wb") as out:
        out.write(MAGIC + record(Opcode.HEADER, struct.pack("<I4sI", 4, b"ros2", 0)))
        found = survey(path)
        for name, content in found.metadata.items():
            pairs = b"".join(text(key) + text(value) for key, value in content.items())
            out.write(record(Opcode.METADATA, text(name) + struct.pack("<I", len(pairs)) + pairs))
        for span in found.spans:
            assert span.head is not None
            records = shuffled(load(file, span, workspace).data, window_ns, rng)
            stored = pack.compress(records)
            head = struct.pack("<QQQI", span.head.start_ns, span.head.end_ns, len(records), 0) + text("zstd")
            out.write(record(Opcode.CHUNK, head + struct.pack("<Q", len(stored)) + stored))
        out.write(record(Opcode.DATA_END, bytes(4)) + record(Opcode.FOOTER, bytes(20)) + MAGIC)


def text(value: str) -> bytes:
    """A length-prefixed string of a record."""
    return struct.pack("<I", len(value.encode())) + value.encode()


def main() -> None:
    """Read the command line and write the copy."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("copy", type=Path)
    parser.add_argument("--window", type=float, default=1.8)
    options = parser.parse_args()
    disorder(options.log, options.copy, options.window)


if __name__ == "__main__":
    main()
