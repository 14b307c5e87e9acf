"""One batch at a time in one directory."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from wmr_schemas.errors import InvalidSetting


@contextlib.contextmanager
def exclusive(path: Path, place: Path) -> Iterator[None]:
    """Hold the lock file; the operating system releases it when the process ends, in any way.

    Raises InvalidSetting when another process holds it.
    """
    try:
        import fcntl  # noqa: PLC0415 – not on Windows, where nothing guards the directory
    except ImportError:
        yield
        return
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InvalidSetting(f"--out {place}: another batch is writing there; wait for its end") from None
        yield
