"""The files behind a path: one file, those of a rosbag2 directory, or one to be unpacked first."""

import re
from collections.abc import Callable
from pathlib import Path

from wmr_replay.ingest.storage.file_check import ZSTD_MAGIC, check_log_file, unreadable
from wmr_replay.ingest.storage.source import LogPath
from wmr_schemas.errors import LogUnusable

_LISTED = re.compile(r"^(\s*)relative_file_paths:\s*\n((?:\1\s*-\s*.*\n?)+)", re.MULTILINE)
_SIDE_FILES = ("-wal", "-shm", "-journal")
"""What SQLite keeps beside a file that is or was open."""
_FIRST_NUMBER = re.compile(r"(\d+)")


def bag_files(path: LogPath) -> list[LogPath]:
    """The files of a log in the order in which they were recorded. Raises LogUnusable."""
    if not path.is_dir():
        return [path]
    files: list[LogPath] = [_beside(path, name) for name in _listed(path / "metadata.yaml")]
    for pattern in ("*.mcap*", "*.db3*"):
        files = files or sorted(
            (file for file in path.glob(pattern) if not file.name.endswith(_SIDE_FILES)), key=_natural
        )
    if not files:
        raise LogUnusable(
            path, "this is a directory without any .mcap or .db3 file", "Give a file or a rosbag2 directory."
        )
    return files


def _beside(folder: LogPath, name: str) -> LogPath:
    """A listed file; early rosbag2 versions list it with the directory's name in front."""
    file = folder / name
    return folder / name.rpartition("/")[2] if isinstance(file, Path) and not file.exists() else file


def _listed(metadata: LogPath) -> list[str]:
    """``relative_file_paths`` of a rosbag2 directory, or nothing."""
    if not metadata.is_file():
        return []
    found = _LISTED.search(metadata.read_text(encoding="utf-8", errors="replace"))
    lines = found[2].splitlines() if found else []
    return [line.strip().removeprefix("-").strip().strip("\"'") for line in lines]


def _natural(path: LogPath) -> list[str]:
    """A key that sorts ``bag_2`` before ``bag_10``."""
    return [piece.zfill(12) if piece.isdigit() else piece for piece in _FIRST_NUMBER.split(path.name)]


def plain_file(path: LogPath, folder: Callable[[], Path]) -> tuple[LogPath, str]:
    """A file ready to be read, unpacked into ``folder()`` if need be, and what was lost in unpacking it.

    Raises LogUnusable when it is no log file.
    """
    try:
        with path.open("rb") as file:
            packed = file.read(len(ZSTD_MAGIC)) == ZSTD_MAGIC
    except OSError as error:
        raise unreadable(path, error) from None
    if not packed:
        check_log_file(path)
        return path, ""
    copy = folder() / path.name.removesuffix(".zst").removesuffix(".zstd")
    problem = _unpack(path, copy)
    if not copy.stat().st_size:
        raise LogUnusable(
            path, "nothing of its zstd data can be unpacked", "Copying it failed; get it again."
        )
    check_log_file(copy, shown=path)
    return copy, problem


def _unpack(path: LogPath, copy: Path) -> str:
    """Unpack a file as far as it goes; what was wrong."""
    import zstandard  # noqa: PLC0415 – only packed files pay for it

    with path.open("rb") as packed, copy.open("wb") as out:
        stream = zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
        try:
            while piece := stream.read(1 << 20):
                out.write(piece)
        except zstandard.ZstdError as error:
            return f"{path.name}: its zstd data are damaged after {out.tell()} bytes ({error})"
    return ""
