"""Rows of one structured type in order: in memory while they are few, then in a temporary file."""

import tempfile
import weakref
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

MOST_BYTES = 32 << 20
"""Held in memory: four minutes at 1 kHz. Rows of a longer log go to a temporary file, which closing removes.
"""
BLOCK_ROWS = 32_768
"""Rows that are read at one time."""

Table = np.ndarray[tuple[int], np.dtype[np.void]]


class Spool:
    """``push`` rows; ``blocks`` gives them again, in blocks that do not depend on how they came.

    The file is closed, and so removed, with the spool; a run that fails halfway leaves none.
    """

    def __init__(self, dtype: npt.DTypeLike) -> None:
        self._dtype = np.dtype(dtype)
        self._file = tempfile.SpooledTemporaryFile(max_size=MOST_BYTES, prefix="wmr-replay-")  # noqa: SIM115
        weakref.finalize(self, self._file.close)

    def push(self, rows: Table) -> None:
        """Append rows."""
        self._file.write(rows.tobytes())

    def blocks(self, n_rows: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows in order, ``n_rows`` at a time."""
        self._file.seek(0)
        while data := self._file.read(n_rows * self._dtype.itemsize):
            yield np.frombuffer(data, self._dtype)
        self._file.seek(0, 2)
