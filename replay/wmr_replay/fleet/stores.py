"""The two kinds of store, and which of them a place asks for."""

import contextlib
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wmr_replay.fleet.lock import exclusive
from wmr_replay.fleet.store import PARTITION, Store
from wmr_replay.ingest import LogPath, RemotePath
from wmr_replay.ingest.storage.source import located, unreachable
from wmr_schemas.errors import LogUnusable
from wmr_schemas.files import check_writable


class Directory(Store):
    """A directory; unfinished files stay in its ``.partial``, so that moving them into place is one step."""

    def __init__(self, place: Path) -> None:
        self._place = place

    @property
    def place(self) -> Path:
        """The directory."""
        return self._place

    def put(self, file: Path, name: str) -> None:
        """Move it there: one step where both lie on one file system."""
        target = self.place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        file.replace(target)

    def size(self, name: str) -> int | None:
        """Size of a file."""
        target = self.place / name
        return target.stat().st_size if target.is_file() else None

    def read(self, name: str) -> bytes:
        """Content of a file."""
        return (self.place / name).read_bytes()

    def remove(self, name: str) -> None:
        """Remove a file; a partition that is empty goes with it."""
        target = self.place / name
        target.unlink(missing_ok=True)
        if target.parent.name.startswith(PARTITION):
            with contextlib.suppress(OSError):
                target.parent.rmdir()

    def names(self, folder: str, ending: str) -> list[str]:
        """Files directly in a folder."""
        return sorted(path.name for path in (self.place / folder).glob(f"*{ending}"))

    @contextlib.contextmanager
    def workshop(self) -> Iterator[Path]:
        """A folder below ``.partial``."""
        folder = self._partial / uuid.uuid4().hex
        folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    @contextlib.contextmanager
    def opened(self) -> Iterator[None]:
        """Lock the directory, and remove unfinished files of an interrupted batch. Raises InvalidSetting."""
        check_writable(self.place)
        self.place.mkdir(parents=True, exist_ok=True)
        with exclusive(self.place / ".lock", self.place):
            shutil.rmtree(self._partial, ignore_errors=True)
            try:
                yield
            finally:
                shutil.rmtree(self._partial, ignore_errors=True)

    @property
    def _partial(self) -> Path:
        return self.place / ".partial"


class Bucket(Store):
    """A prefix behind a URL: results are made in a temporary folder of this machine, then sent."""

    def __init__(self, place: RemotePath) -> None:
        self._place = place

    @property
    def place(self) -> RemotePath:
        """The prefix."""
        return self._place

    def put(self, file: Path, name: str) -> None:
        """Send it: the object is there once it is whole."""
        system, target = self._located(name)
        with self._speaking(name):
            if not str(self.place).startswith("s3"):
                system.makedirs(target.rpartition("/")[0], exist_ok=True)
            with file.open("rb") as content, system.open(target, "wb") as out:
                shutil.copyfileobj(content, out, 8 << 20)

    def size(self, name: str) -> int | None:
        """Size of an object."""
        system, target = self._located(name)
        with self._speaking(name), contextlib.suppress(FileNotFoundError):
            return int(system.info(target)["size"])
        return None

    def read(self, name: str) -> bytes:
        """Content of an object."""
        system, target = self._located(name)
        with self._speaking(name):
            return bytes(system.cat_file(target))

    def remove(self, name: str) -> None:
        """Remove an object."""
        system, target = self._located(name)
        with self._speaking(name), contextlib.suppress(FileNotFoundError):
            system.rm_file(target)

    def names(self, folder: str, ending: str) -> list[str]:
        """Objects directly in a folder."""
        system, target = self._located(folder)
        with self._speaking(folder), contextlib.suppress(FileNotFoundError):
            found = (str(name).rpartition("/")[2] for name in system.find(target))
            return sorted(name for name in found if name.endswith(ending))
        return []

    @contextlib.contextmanager
    def workshop(self) -> Iterator[Path]:
        """A temporary folder of this machine."""
        with tempfile.TemporaryDirectory(prefix="wmr-replay-") as folder:
            yield Path(folder)

    @contextlib.contextmanager
    def opened(self) -> Iterator[None]:
        """Check that the extra is installed; nothing else is to be prepared."""
        located(self.place)
        yield

    def _located(self, name: str) -> tuple[Any, str]:
        return located(self.place / name)

    @contextlib.contextmanager
    def _speaking(self, name: str) -> Iterator[None]:
        """Turn errors of the remote file system into LogUnusable."""
        try:
            yield
        except (FileNotFoundError, LogUnusable):
            raise
        except Exception as error:
            raise unreachable(self.place / name, error) from None


def store_at(place: LogPath) -> Store:
    """The store at a place."""
    return Bucket(place) if isinstance(place, RemotePath) else Directory(place.absolute())
