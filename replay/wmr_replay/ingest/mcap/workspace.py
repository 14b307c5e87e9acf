"""The decompressor and the memory with which one thread opens chunk after chunk."""

import zlib
from functools import cached_property
from typing import TYPE_CHECKING

try:
    from isal.isal_zlib import crc32
except ImportError:  # not built for every machine; six times slower without
    crc32 = zlib.crc32

if TYPE_CHECKING:
    import zstandard

__all__ = ["Workspace", "crc32"]


class Workspace:
    """For one thread alone. Fresh memory for each chunk would cost a tenth of the time to decompress it."""

    def __init__(self) -> None:
        self._room = memoryview(b"")

    @cached_property
    def zstd(self) -> "zstandard.ZstdDecompressor":
        """The decompressor, made when the first chunk needs it."""
        import zstandard  # noqa: PLC0415 – only logs that use it pay for it

        return zstandard.ZstdDecompressor()

    def room(self, n_bytes: int) -> memoryview:
        """Writable memory of that size. What it held before is lost."""
        if len(self._room) < n_bytes:
            self._room = memoryview(bytearray(n_bytes))
        return self._room[:n_bytes]
