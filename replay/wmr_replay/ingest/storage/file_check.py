"""Check of a file's first bytes for a log's magic: MCAP's or a ROS bag's; others are named, with advice."""

from wmr_replay.ingest.storage.source import LogPath
from wmr_schemas.errors import LogUnusable

MCAP_MAGIC = b"\x89MCAP0\r\n"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
SQLITE_MAGIC = b"SQLite format 3\0"
ROS1_MAGIC = b"#ROSBAG V2.0\n"
_FOREIGN = (
    (b"#ROSBAG V", "this is a ROS 1 bag of another version than 2.0", "Convert it with rosbag fix first."),
    (b"\x1f\x8b", "the file as a whole is compressed with gzip", "Unpack it:\n  gunzip {path}"),
    (b"ULog\x01\x12\x35", "this is a PX4 ULog, not MCAP", "Convert it to MCAP first."),
)
_LONGEST = 16


def magic_of(path: LogPath) -> bytes:
    """The magic with which a log file starts: MCAP's, SQLITE_MAGIC or ROS1_MAGIC; empty for another file.

    Raises LogUnusable for a file that cannot be read.
    """
    head = _head(path)
    known = (MCAP_MAGIC, SQLITE_MAGIC, ROS1_MAGIC)
    return next((magic for magic in known if head.startswith(magic)), b"")


def _head(path: LogPath) -> bytes:
    """The first bytes of a file. Raises LogUnusable."""
    try:
        with path.open("rb") as file:
            return file.read(_LONGEST)
    except OSError as error:
        raise unreadable(path, error) from None


def check_log_file(path: LogPath, shown: LogPath | None = None) -> None:
    """Raises LogUnusable unless an MCAP file or a ROS bag starts at ``path``; messages name ``shown``."""
    if magic_of(path):
        return
    head = _head(path)
    path = shown or path
    if not head:
        raise LogUnusable(path, "the file is empty", "Nothing was recorded, or copying it failed.")
    if MCAP_MAGIC.startswith(head):
        raise LogUnusable(
            path, "the file ends inside MCAP's magic", "Copying it failed, or recording never began."
        )
    for magic, problem, advice in _FOREIGN:
        if head.startswith(magic):
            raise LogUnusable(path, problem, advice.format(path=path, stem=path.stem))
    raise LogUnusable(
        path,
        "this is not an MCAP file nor a ROS bag: its first bytes are of neither",
        "Give a .mcap, .db3 or .bag file, or a rosbag2 directory.",
    )


def unreadable(path: LogPath, error: OSError) -> LogUnusable:
    """The error for a file that the system does not hand out."""
    if isinstance(error, FileNotFoundError):
        return LogUnusable(path, "there is no such file", "Check the path.")
    return LogUnusable(path, f"the file cannot be read ({error.strerror})", "Check its permissions.")
