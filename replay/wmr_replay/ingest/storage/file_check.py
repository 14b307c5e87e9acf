"""Check of a file's first bytes for MCAP's magic; other formats are named, with advice."""

from wmr_replay.ingest.storage.source import LogPath
from wmr_schemas.errors import LogUnusable

CONVERT = "Convert it:\n  rosbags-convert --src {path} --dst {stem} --dst-storage mcap --dst-version 9"
MCAP_MAGIC = b"\x89MCAP0\r\n"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_FOREIGN = (
    (b"SQLite format 3\0", "this is a ROS 2 bag in SQLite form (.db3), not MCAP", CONVERT),
    (b"#ROSBAG V", "this is a ROS 1 bag, not MCAP", CONVERT),
    (b"\x1f\x8b", "the file as a whole is compressed with gzip", "Unpack it:\n  gunzip {path}"),
    (b"ULog\x01\x12\x35", "this is a PX4 ULog, not MCAP", "Convert it to MCAP first."),
)
_LONGEST = 16


def check_mcap_file(path: LogPath, shown: LogPath | None = None) -> None:
    """Raises LogUnusable unless an MCAP file starts at ``path``; messages name ``shown``."""
    try:
        with path.open("rb") as file:
            head = file.read(_LONGEST)
    except OSError as error:
        raise unreadable(path, error) from None
    if head.startswith(MCAP_MAGIC):
        return
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
    raise LogUnusable(path, "this is not an MCAP file: its first bytes are not MCAP's", "Give a .mcap file.")


def unreadable(path: LogPath, error: OSError) -> LogUnusable:
    """The error for a file that the system does not hand out."""
    if isinstance(error, FileNotFoundError):
        return LogUnusable(path, "there is no such file", "Check the path.")
    return LogUnusable(path, f"the file cannot be read ({error.strerror})", "Check its permissions.")
