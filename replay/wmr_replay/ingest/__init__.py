"""From an MCAP file or a ROS bag to columns of the signals in use. :func:`open_log` is the entrance.

Data goes one way: ``storage`` (where the bytes lie) → ``mcap`` (records and chunks) → ``bags`` (ROS bags as
MCAP records) → ``decoding`` (messages to columns) → ``channels`` (which channel serves as what) → ``reading``
(one pass) → ``reader`` (a log) → ``tracks`` (a whole log in memory). ``losses`` counts what could not be
used; ``between`` is a range of time.
"""

from wmr_replay.ingest.between import Between
from wmr_replay.ingest.gathering import gathered
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
    "gathered",
    "log_path",
    "open_log",
    "sha256_of",
    "size_of",
]
