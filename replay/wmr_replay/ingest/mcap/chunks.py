"""From a stretch of the file to the bytes of its records: reading, decompressing, checking.

A chunk's header is not trusted: memory grows with the data, not with the header's claim. A chunk that
cannot be read gives no bytes and a reason. Of a chunk that the file's end cuts off, the records before
the cut are recovered.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import BinaryIO, Self, TypeAlias

import numpy as np

from wmr_replay.ingest.budgets import BUDGETS
from wmr_replay.ingest.mcap.records import HEAD, ChunkHead, Malformed, Opcode, parse_chunk_head
from wmr_replay.ingest.mcap.workspace import Workspace, crc32
from wmr_schemas.arrays import U8

_TRUSTED_BYTES = 64 << 20
"""Up to this size memory is allocated by the chunk's header where the frame does not state its size."""
_PIECE_BYTES = 1 << 20
NO_BYTES: U8 = np.frombuffer(b"", np.uint8)
Buffer = bytes | memoryview


@dataclass(frozen=True)
class Span:
    """A stretch of the file that holds messages: a chunk (with its head), or records outside any chunk.

    ``counts``: messages by channel id, empty where neither the file's index nor a walk told them.
    ``whole``: the file does not end in the middle of it.
    """

    offset: int
    data_offset: int
    data_bytes: int
    head: ChunkHead | None = None
    counts: dict[int, int] = field(default_factory=dict)
    whole: bool = True
    times_ns: tuple[int, int] | None = None
    """Earliest and latest log time, where known."""
    file_index: int = 0
    """Which of the log's files it stands in."""
    by_index: bool = False
    """Its head is what the file's index says, without checksum; the chunk's own is read with it."""
    name: str = ""
    """What notes call it, where it is not "the chunk at byte" ``offset``."""

    @property
    def n_rows(self) -> int:
        """Rows of a table that it ranges over; 0 where it is none of a table."""
        return 0


@dataclass(frozen=True, eq=False)
class Block:
    """The records of a span; ``problem`` says why there are none, or why some may be missing.

    ``data`` hold until the same workspace opens the next span.
    """

    span: Span
    data: U8
    problem: str = ""


class SpanFile(ABC):
    """An open log of another format that gives its spans as MCAP records."""

    @abstractmethod
    def load(self, span: Span, workspace: Workspace) -> Block:
        """The records of one span; they hold until the same workspace opens the next one."""

    @abstractmethod
    def close(self) -> None:
        """Close the file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


OpenFile: TypeAlias = BinaryIO | SpanFile
"""A log file opened by one thread: MCAP's bytes, or a log of another format."""


class Unreadable(Exception):
    """A chunk that yields no records, and why."""


def load(file: OpenFile, span: Span, workspace: Workspace) -> Block:
    """Read, decompress and check one span."""
    if isinstance(file, SpanFile):
        return file.load(span, workspace)
    if span.by_index and span.head is not None:
        return load_by_index(file, span, span.head, workspace)
    file.seek(span.data_offset)
    stored = file.read(span.data_bytes)
    if span.head is None:
        return Block(span, np.frombuffer(stored, np.uint8))
    try:
        records = open_chunk(span.head, stored, workspace, whole=span.whole)
    except Unreadable as error:
        return Block(span, NO_BYTES, str(error))
    data = np.frombuffer(memoryview(records).toreadonly(), np.uint8)
    return Block(span, data, "" if span.whole else "the file ends inside it")


def load_by_index(file: BinaryIO, span: Span, claimed: ChunkHead, workspace: Workspace) -> Block:
    """Read a whole chunk record at once, and check that its own head is the one in the index."""
    file.seek(span.offset)
    record = file.read(HEAD.size + claimed.head_bytes + span.data_bytes)
    try:
        if record[: HEAD.size] != HEAD.pack(Opcode.CHUNK, len(record) - HEAD.size):
            raise Unreadable("there is no such chunk where the index says")
        head = parse_chunk_head(record[HEAD.size : HEAD.size + claimed.head_bytes])
        if replace(head, uncompressed_crc=0) != claimed:
            raise Unreadable("its head is not what the index says")
        records = open_chunk(head, record[HEAD.size + head.head_bytes :], workspace, whole=True)
    except (Unreadable, Malformed) as error:
        return Block(span, NO_BYTES, str(error))
    return Block(span, np.frombuffer(memoryview(records).toreadonly(), np.uint8))


def open_chunk(head: ChunkHead, stored: bytes, workspace: Workspace, *, whole: bool) -> Buffer:
    """Decompress a chunk's records and check them. Raises Unreadable."""
    size = head.uncompressed_bytes
    if whole and not BUDGETS.may_unfold(len(stored), size):
        raise Unreadable(f"its {len(stored):,} bytes would unfold to {size:,}, more than is read")
    size = min(size, BUDGETS.most_chunk_bytes)
    codec = _CODECS.get(head.compression)
    if codec is None:
        raise Unreadable(f"unknown compression {head.compression[:40]!r}")
    try:
        records = codec(stored, size, whole, workspace)
    except (MemoryError, ValueError, RuntimeError) as error:
        raise Unreadable(f"{head.compression or 'plain'} data are damaged ({error})") from None
    if not whole:
        records = records[:size]
        if len(records) < size:
            return records
    if len(records) != size:
        raise Unreadable(f"holds {len(records)} bytes where its header claims {size}")
    if head.uncompressed_crc and crc32(records) != head.uncompressed_crc:
        raise Unreadable("its checksum does not match")
    return records


def _plain(stored: bytes, size: int, whole: bool, workspace: Workspace) -> Buffer:
    """Records that are not compressed, at most one byte more than ``size``."""
    return stored[: size + 1]


def _zstd(stored: bytes, size: int, whole: bool, workspace: Workspace) -> Buffer:
    """Records decompressed, at most one byte more than ``size``. Raises ValueError."""
    import zstandard  # noqa: PLC0415 – only logs that use it pay for it

    try:
        claimed = zstandard.frame_content_size(stored) if whole else -1
        if claimed not in {-1, size}:
            raise ValueError(f"the frame claims {claimed} bytes, the chunk {size}")
        stream = workspace.zstd.stream_reader(stored)
        if size > _TRUSTED_BYTES:
            return _read_at_most(stream, size)
        room = workspace.room(size + 1)
        return room[: stream.readinto(room)]
    except zstandard.ZstdError as error:
        raise ValueError(error) from None


def _read_at_most(stream: BinaryIO, size: int) -> Buffer:
    """The stream's content, one byte more than ``size`` at most; grows with it, not with the claim."""
    out = bytearray()
    while len(out) <= size and (piece := stream.read(min(_PIECE_BYTES, size + 1 - len(out)))):
        out += piece
    return memoryview(out)


def _lz4(stored: bytes, size: int, whole: bool, workspace: Workspace) -> Buffer:
    """Records decompressed, at most one byte more than ``size``. Raises ValueError, RuntimeError."""
    from lz4.frame import LZ4FrameDecompressor  # noqa: PLC0415

    if not stored:
        return b""
    stream, piece_bytes = LZ4FrameDecompressor(), size + 1 if size <= _TRUSTED_BYTES else _PIECE_BYTES
    try:
        first: bytes = stream.decompress(stored, max_length=piece_bytes)
        if stream.eof or stream.needs_input or len(first) > size:
            return first
        out = bytearray(first)
        while len(out) <= size and not stream.eof and not stream.needs_input:
            out += stream.decompress(b"", max_length=piece_bytes)
    except EOFError as error:
        raise ValueError(error) from None
    return memoryview(out)


_CODECS: dict[str, Callable[[bytes, int, bool, Workspace], Buffer]] = {"": _plain, "zstd": _zstd, "lz4": _lz4}
