"""A file behind a URL as a file: a read asks for its bytes and no others."""

import io
from typing import Any

from wmr_schemas.errors import LogUnusable

N_ATTEMPTS = 3
NETWORK = "Check the address, the network and your credentials."


class RangeFile(io.RawIOBase):
    """A remote file that is read by ranges: a read asks for its bytes and no others, three times at most."""

    def __init__(self, place: object, file: Any, size_bytes: int) -> None:
        super().__init__()
        self._place, self._file, self._size = place, file, size_bytes
        self._position = 0

    def readable(self) -> bool:
        """True: the file is open for reading."""
        return True

    def seekable(self) -> bool:
        """True: any byte can be read next."""
        return True

    def tell(self) -> int:
        """The position of the next byte."""
        return self._position

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Set the position of the next byte; nothing is fetched."""
        self._position = (
            offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: self._size}[whence]
        )
        return self._position

    def read(self, n_bytes: int | None = -1) -> bytes:
        """The next bytes, fewer only at the end. Raises LogUnusable when they do not come."""
        left = max(self._size - self._position, 0)
        wanted = left if n_bytes is None or n_bytes < 0 else min(n_bytes, left)
        data = self._fetched(wanted) if wanted else b""
        self._position += len(data)
        return data

    def _fetched(self, n_bytes: int) -> bytes:
        """Exactly ``n_bytes`` from the position on. Raises LogUnusable after three attempts."""
        problem = ""
        for _ in range(N_ATTEMPTS):
            try:
                self._file.seek(self._position)
                data = bytes(self._file.read(n_bytes))
            except ValueError:
                raise
            except Exception as error:
                problem = f"{type(error).__name__}: {error}"
                continue
            if len(data) == n_bytes:
                return data
            problem = f"{len(data)} of {n_bytes} bytes came"
        raise LogUnusable(self._place, f"byte {self._position} cannot be fetched ({problem})", NETWORK)

    def close(self) -> None:
        """Close the connection to the server."""
        if not self.closed:
            self._file.close()
        super().close()
