"""From an MCAP file to columns: records, layouts, signals. Everything enters through :func:`open_log`."""

from wmr_replay.ingest.between import Between
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.reader import LogReader, open_log, sha256_of
from wmr_replay.ingest.storage.source import LogPath, RemotePath, log_path, size_of
from wmr_schemas.batches import RawBatch, Rows

__all__ = [
    "Between",
    "LogPath",
    "LogReader",
    "Losses",
    "RawBatch",
    "RemotePath",
    "Rows",
    "log_path",
    "open_log",
    "sha256_of",
    "size_of",
]
