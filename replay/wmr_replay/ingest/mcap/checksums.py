"""Which messages of a file a checksum covers, and the checksum over its whole data section."""

from typing import BinaryIO

from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.records import HEAD, MAGIC
from wmr_replay.ingest.mcap.workspace import crc32

NO_CHECKSUMS = "the file has no checksums: a changed bit that leaves the records whole cannot be seen"
_PIECE_BYTES = 8 << 20


def is_covered(span: Span) -> bool:
    """Whether the span's own checksum covers its messages. A head from the index does not tell: yes then."""
    return span.head is not None and (span.by_index or span.head.uncompressed_crc != 0)


def data_section_differs(file: BinaryIO, stop: int, crc: int) -> bool:
    """Whether the bytes up to ``stop``, where the data end, have another checksum than ``crc``.

    Writers differ in where the section begins: at the magic, at the header or behind it.
    """
    file.seek(len(MAGIC))
    _, header_bytes = HEAD.unpack(file.read(HEAD.size))
    starts = 0, len(MAGIC), len(MAGIC) + HEAD.size + header_bytes
    return all(_crc_of(file, start, stop) != crc for start in starts)


def _crc_of(file: BinaryIO, start: int, stop: int) -> int:
    """The checksum of a stretch of the file."""
    file.seek(start)
    crc, left = 0, stop - start
    while left > 0 and (piece := file.read(min(_PIECE_BYTES, left))):
        crc, left = crc32(piece, crc), left - len(piece)
    return crc
