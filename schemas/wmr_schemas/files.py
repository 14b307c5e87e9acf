"""Files that are whole or absent: written under a temporary name beside the target, renamed when complete.

The temporary name holds the process' number, so that two processes that write the same file do not mix their
bytes; the last one to finish wins.
"""

import contextlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeVar

from wmr_schemas.errors import InvalidSetting

K = TypeVar("K")


class PartFile:
    """A file that grows at ``path`` until :meth:`finish` renames it to ``target``."""

    def __init__(self, target: Path) -> None:
        self.target, self.path = target, target.with_name(f".{target.name}.{os.getpid()}.part")

    def finish(self) -> None:
        """Rename the complete file to its target; an older file of that name is replaced."""
        self.path.replace(self.target)

    def discard(self) -> None:
        """Remove the unfinished file; a finished one stays."""
        self.path.unlink(missing_ok=True)


@contextlib.contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """Yield a temporary path to write to; rename it to ``target`` on success, remove it on any failure."""
    with whole_files({None: target}) as paths:
        yield paths[None]


@contextlib.contextmanager
def whole_files(targets: Mapping[K, Path]) -> Iterator[dict[K, Path]]:
    """Yield a temporary path for each target; rename all of them on success, remove all on any failure.

    The first target appears last: where it is found, the others are there already.
    """
    parts = {key: PartFile(target) for key, target in targets.items()}
    try:
        yield {key: part.path for key, part in parts.items()}
        for part in reversed(parts.values()):
            part.finish()
    finally:
        for part in parts.values():
            part.discard()


def check_writable(folder: Path) -> None:
    """Raises InvalidSetting where nothing can be written to a folder, or the folder cannot be made.

    Called before long work; what fails later all the same is an OSError.
    """
    there = next((place for place in (folder, *folder.absolute().parents) if place.exists()), folder)
    if not there.is_dir():
        raise InvalidSetting(f"{folder}: cannot be written ({there} is no directory)")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InvalidSetting(f"{folder}: cannot be written ({there} may not be changed by this user)")


@contextlib.contextmanager
def made_folder(folder: Path) -> Iterator[Path]:
    """Make ``folder`` and its parents; on failure remove those that were made here and are empty."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield folder
    except BaseException:
        for place in missing:
            with contextlib.suppress(OSError):
                place.rmdir()
        raise
