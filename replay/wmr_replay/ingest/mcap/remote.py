"""MCAP files behind URLs: whether ranges of them can be read, and their identity by a few reads."""

import json
from collections.abc import Callable
from pathlib import Path

from wmr_replay.ingest.mcap.index_survey import indexed_survey, read_summary
from wmr_replay.ingest.storage.file_check import MCAP_MAGIC, ZSTD_MAGIC, check_log_file, magic_of
from wmr_replay.ingest.storage.source import LogPath, RemotePath, download, gives_ranges, size_of
from wmr_schemas.text import figure

_VALIDATORS = ("ETag", "etag", "Last-Modified", "mtime", "LastModified", "Content-MD5", "Digest")
_PIECE_BYTES = 8 << 20


def readable_file(path: LogPath, folder: Callable[[], Path]) -> tuple[LogPath, str]:
    """The file itself where ranges of it can be read, else a copy of the whole in ``folder()``, and the
    reason for the copy.

    A copy is made when the server gives no ranges, when the file's index is missing or does not add up, and
    when the file as a whole is packed. Raises LogUnusable.
    """
    if not isinstance(path, RemotePath):
        return path, ""
    why = range_obstacle(path)
    if not why:
        return path, ""
    copy = folder() / path.name
    download(path, copy)
    if not is_packed(copy):
        check_log_file(copy, shown=path)
    return (
        copy,
        f"{path.name}: {why}, so the whole file ({figure(copy.stat().st_size / 1e6, 3)} MB) was fetched",
    )


def range_obstacle(path: RemotePath) -> str:
    """Why the file cannot be read by ranges; empty when it can.

    Raises LogUnusable when it is no log file at all.
    """
    if not gives_ranges(path):
        return "the server gives no ranges of it"
    if is_packed(path):
        return "it is packed as a whole"
    check_log_file(path)
    if magic_of(path) != MCAP_MAGIC:
        return "it is a ROS bag, not MCAP"
    with path.open() as file:
        if indexed_survey(file, size_of(path)) is None:
            return "it has no index that could be used"
    return ""


def is_packed(path: LogPath) -> bool:
    """Whether a file starts like one of zstd."""
    with path.open("rb") as file:
        return file.read(len(ZSTD_MAGIC)) == ZSTD_MAGIC


def update_identity(path: RemotePath, update: Callable[[bytes], None]) -> None:
    """Hash what tells a file from another version of itself: the server's word (``ETag``, date), its size,
    and the summary section with every chunk's place, size and times. Without such a word the whole content.
    """
    details = path.details
    word = {key: str(details[key]) for key in _VALIDATORS if details.get(key)}
    ranges = gives_ranges(path)
    if not word:
        with path.open() as file:
            while piece := file.read(_PIECE_BYTES):
                update(piece)
        return
    update(json.dumps([str(path), details.get("size"), word], sort_keys=True).encode())
    if ranges:
        with path.open() as file:
            update(read_summary(file, size_of(path)))
