"""Files broken on purpose: the bytes of a good log become a damaged one's; what a reader should say.

The records of MCAP (https://mcap.dev/spec) are an opcode, a length of 8 bytes and the content, between two
magics. Each way is deterministic; what is random takes the generator that it is given.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, CHUNK, MESSAGE_INDEX, DATA_END = 0x02, 0x03, 0x04, 0x06, 0x07, 0x0F
NO_SUMMARY = struct.pack("<BQQQI", FOOTER, 20, 0, 0, 0)
"""The footer of a file without an index."""
HEADER_BYTES = 9
CHUNK_CRC_OFFSET = 24
"""Of ``uncompressed_crc`` in a chunk: behind two stamps and the uncompressed size."""

EXIT_DONE, EXIT_LOG_UNUSABLE = 0, 3


@dataclass(frozen=True)
class Record:
    """Where a record lies: ``start`` … ``stop`` with its header; ``body`` is where its content starts."""

    opcode: int
    start: int
    stop: int

    @property
    def body(self) -> int:
        """The first byte of the content."""
        return self.start + HEADER_BYTES


@dataclass(frozen=True)
class Damage:
    """A way to break a log: ``apply(bytes, generator)``, and the answer of ``wmr-replay run`` to it.

    ``summary`` holds columns of the summary with the values expected; a bound starts with ``>=``.
    """

    description: str
    apply: Callable[[bytes, np.random.Generator], bytes]
    exit_code: int = EXIT_DONE
    exit_code_strict: int = EXIT_LOG_UNUSABLE
    summary: dict[str, Any] = field(default_factory=dict)

    def expected(self) -> dict[str, Any]:
        """As the manifest says it."""
        return {
            "exit_code": self.exit_code,
            "exit_code_strict": self.exit_code_strict,
            "summary": self.summary,
        }


def records(data: bytes) -> Iterator[Record]:
    """The records of a whole file, in order."""
    start = len(MAGIC)
    while start + HEADER_BYTES <= len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, start)
        yield Record(opcode, start, start + HEADER_BYTES + length)
        start += HEADER_BYTES + length


def chunks(data: bytes) -> list[Record]:
    """The chunks of a file."""
    return [record for record in records(data) if record.opcode == CHUNK]


def middle_chunk(data: bytes) -> Record:
    """The chunk in the middle of the file."""
    found = chunks(data)
    return found[len(found) // 2]


def content_span(data: bytes, chunk: Record) -> tuple[int, int]:
    """Where the compressed records of a chunk lie."""
    name_at = chunk.body + CHUNK_CRC_OFFSET + 4
    (name_bytes,) = struct.unpack_from("<I", data, name_at)
    return name_at + 4 + name_bytes + 8, chunk.stop


def changed(data: bytes, at: int, new: bytes) -> bytes:
    """``data`` with the bytes from ``at`` on replaced."""
    return data[:at] + new + data[at + len(new) :]


def unchanged(data: bytes, _: np.random.Generator) -> bytes:
    """The good log, to compare with."""
    return data


def truncated(data: bytes, _: np.random.Generator) -> bytes:
    """Cut inside the chunk in the middle, as when the recorder lost its power."""
    start, stop = content_span(data, middle_chunk(data))
    return data[: (start + stop) // 2]


def without_footer(data: bytes, _: np.random.Generator) -> bytes:
    """Cut in front of the end of the data: all chunks, no index, no footer, no magic."""
    end = next(record for record in records(data) if record.opcode == DATA_END)
    return data[: end.start]


def without_summary(data: bytes, _: np.random.Generator) -> bytes:
    """A whole file whose writer wrote no index: data end, footer of zeros, magic."""
    end = next(record for record in records(data) if record.opcode == DATA_END)
    return data[: end.stop] + NO_SUMMARY + MAGIC


def crc_flipped(data: bytes, _: np.random.Generator) -> bytes:
    """One bit of one chunk's checksum is wrong; its content is not."""
    at = middle_chunk(data).body + CHUNK_CRC_OFFSET
    return changed(data, at, bytes([data[at] ^ 1]))


def bits_flipped(data: bytes, rng: np.random.Generator) -> bytes:
    """One bit wrong inside each of three chunks."""
    found = chunks(data)
    for index in rng.choice(np.arange(1, len(found) - 1), 3, replace=False).tolist():
        start, stop = content_span(data, found[index])
        at = int(rng.integers(start, stop))
        data = changed(data, at, bytes([data[at] ^ (1 << int(rng.integers(8)))]))
    return data


def chunk_missing(data: bytes, _: np.random.Generator) -> bytes:
    """The chunk in the middle and its indexes are gone; the file ends as an unindexed one does."""
    chunk = middle_chunk(data)
    following = (record for record in records(data) if record.start >= chunk.stop)
    stop = next(record.start for record in following if record.opcode != MESSAGE_INDEX)
    return without_footer(data[: chunk.start] + data[stop:], np.random.default_rng(0))


def unknown_compression(data: bytes, _: np.random.Generator) -> bytes:
    """One chunk says that it is compressed in a way that no reader knows."""
    return changed(data, middle_chunk(data).body + CHUNK_CRC_OFFSET + 8, b"zstX")


def zeros_inside(data: bytes, _: np.random.Generator) -> bytes:
    """4 KiB of zeros where a chunk was, as a file system leaves them after a crash."""
    start, _stop = content_span(data, middle_chunk(data))
    return changed(data, start + 100, bytes(4096))


def no_messages(data: bytes, _: np.random.Generator) -> bytes:
    """Header, schemas and channels (those that the summary repeats), and not one message."""
    found = list(records(data))
    first = next(record.start for record in found if record.opcode == CHUNK)
    end = next(record.start for record in found if record.opcode == DATA_END)
    known = [record for record in found if record.opcode in {SCHEMA, CHANNEL} and record.start > end]
    channels = b"".join(data[record.start : record.stop] for record in known)
    return data[:first] + channels + struct.pack("<BQI", DATA_END, 4, 0) + NO_SUMMARY + MAGIC


def empty(_: bytes, __: np.random.Generator) -> bytes:
    """Nothing at all."""
    return b""


def no_mcap(data: bytes, _: np.random.Generator) -> bytes:
    """The magic at the start is wrong."""
    return changed(data, 0, b"\x00" * len(MAGIC))


UNUSABLE = EXIT_LOG_UNUSABLE
DAMAGES: dict[str, Damage] = {
    "none": Damage(
        "the good log, to compare with", unchanged, 0, 0, {"n_chunks_damaged": 0, "truncated": False}
    ),
    "truncated": Damage("cut inside the chunk in the middle", truncated, summary={"truncated": True}),
    "no-footer": Damage(
        "no index, no footer, no magic at the end", without_footer, summary={"truncated": True}
    ),
    "no-summary": Damage("whole, but without index", without_summary, 0, 0, {"truncated": False}),
    "crc-flipped": Damage("a wrong checksum", crc_flipped, summary={"n_chunks_damaged": 1}),
    "bit-flips": Damage("a bit wrong in each of three chunks", bits_flipped, summary={"n_chunks_damaged": 3}),
    "missing-chunk": Damage(
        "a chunk gone, and the index", chunk_missing, summary={"truncated": True, "n_gaps": ">= 1"}
    ),
    "unknown-compression": Damage(
        "a chunk compressed in an unknown way", unknown_compression, summary={"n_chunks_damaged": 1}
    ),
    "zeros": Damage("4 KiB of zeros inside a chunk", zeros_inside, summary={"n_chunks_damaged": 1}),
    "no-messages": Damage("channels without a message", no_messages, UNUSABLE, UNUSABLE),
    "empty": Damage("an empty file", empty, UNUSABLE, UNUSABLE),
    "no-mcap": Damage("a wrong magic at the start", no_mcap, UNUSABLE, UNUSABLE),
}
"""Every way by name."""
