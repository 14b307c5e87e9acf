"""From an MCAP file to columns: records, layouts, signals. Everything enters through :func:`open_log`."""

from wmr_replay.ingest.between import Between
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.reader import LogReader, open_log, sha256_of
from wmr_replay.ingest.signals import RawBatch, Rows

__all__ = ["Between", "LogReader", "Losses", "RawBatch", "Rows", "open_log", "sha256_of"]
