"""Several files that appear together or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replaced_together(paths: tuple[Path, ...]) -> Iterator[tuple[Path, ...]]:
    """Temporary names beside ``paths``, renamed to them at the end; removed when anything stops the block."""
    temporary = tuple(path.with_name(f".{path.name}.{os.getpid()}.part") for path in paths)
    try:
        yield temporary
        for source, target in reversed(list(zip(temporary, paths, strict=True))):
            source.replace(target)
    finally:
        for source in temporary:
            source.unlink(missing_ok=True)
