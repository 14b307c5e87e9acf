"""Where a batch's results lie: a directory, or a prefix behind a URL.

A file appears whole or not at all: in a directory it is moved into place, an object store shows an object
when it is complete. Results count once their completion record is there, which is written last.
"""

import contextlib
import json
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

from wmr_replay.ingest import LogPath

RECORDS = "records"
PARTITION = "log="
Record = dict[str, Any]


class Store(ABC):
    """Files by name, names with slashes."""

    @property
    @abstractmethod
    def place(self) -> LogPath:
        """The directory or prefix."""

    @abstractmethod
    def put(self, file: Path, name: str) -> None:
        """Move a finished file into the store under this name."""

    @abstractmethod
    def size(self, name: str) -> int | None:
        """Size of a file; None when there is none."""

    @abstractmethod
    def read(self, name: str) -> bytes:
        """Content of a file. Raises FileNotFoundError."""

    @abstractmethod
    def remove(self, name: str) -> None:
        """Remove a file, if it is there."""

    @abstractmethod
    def names(self, folder: str, ending: str) -> list[str]:
        """Files directly in a folder, sorted."""

    @abstractmethod
    def workshop(self) -> contextlib.AbstractContextManager[Path]:
        """A temporary folder for files that are not finished yet."""

    @abstractmethod
    def opened(self) -> contextlib.AbstractContextManager[None]:
        """Open the store for this batch alone; remove unfinished files of an interrupted one."""

    def put_bytes(self, content: bytes, name: str) -> None:
        """A small file."""
        with self.workshop() as folder:
            part = folder / "part"
            part.write_bytes(content)
            self.put(part, name)

    def record(self, key: str) -> Record | None:
        """The completion record of a log, if all that it lists is there."""
        try:
            found: Record = json.loads(self.read(f"{RECORDS}/{key}.json"))
        except (FileNotFoundError, json.JSONDecodeError):
            return None
        whole = all(self.size(name) == facts["size_bytes"] for name, facts in found["files"].items())
        return found if whole else None

    def complete(self, record: Record) -> None:
        """Write the completion record."""
        self.put_bytes(
            (json.dumps(record, indent=1, sort_keys=True) + "\n").encode(), record_name(record["key"])
        )

    def done(self) -> list[str]:
        """Logs that have a record."""
        return [name.removesuffix(".json") for name in self.names(RECORDS, ".json")]


def record_name(key: str) -> str:
    """Where a completion record lies."""
    return f"{RECORDS}/{key}.json"


def timeline_name(key: str) -> str:
    """Where a log's timeline lies."""
    return f"timelines/{key}.rrd"
