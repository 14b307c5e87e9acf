"""A ROS bag's file by its first bytes."""

from pathlib import Path

from wmr_replay.ingest.bags.ros1_bag import Ros1Bag
from wmr_replay.ingest.bags.sqlite_bag import SqliteBag
from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.storage.file_check import ROS1_MAGIC, SQLITE_MAGIC, magic_of
from wmr_replay.ingest.storage.source import LogPath

_KINDS: dict[bytes, type[Container]] = {SQLITE_MAGIC: SqliteBag, ROS1_MAGIC: Ros1Bag}


def container_of(path: LogPath) -> Container | None:
    """The bag in a file of this machine, or None for an MCAP file."""
    kind = _KINDS.get(magic_of(path)) if isinstance(path, Path) else None
    return kind(path) if kind is not None and isinstance(path, Path) else None
