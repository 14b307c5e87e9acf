"""A ROS bag's file by its first bytes."""

from pathlib import Path

from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.storage.file_check import ROS1_MAGIC, SQLITE_MAGIC, magic_of
from wmr_replay.ingest.storage.source import LogPath


def container_of(path: LogPath) -> Container | None:
    """The bag in a file of this machine, or None for an MCAP file."""
    if not isinstance(path, Path):
        return None
    magic = magic_of(path)
    if magic == SQLITE_MAGIC:
        from wmr_replay.ingest.bags.sqlite_bag import SqliteBag  # noqa: PLC0415 – few logs need it

        return SqliteBag(path)
    if magic == ROS1_MAGIC:
        from wmr_replay.ingest.bags.ros1_bag import Ros1Bag  # noqa: PLC0415 – few logs need it

        return Ros1Bag(path)
    return None
