"""The samples table of signals that are in memory already: the same engine, no file."""

import polars as pl

from wmr_replay.pipeline.memory import replay_columns
from wmr_replay.pipeline.settings import Settings
from wmr_replay.tables.samples import samples_frame
from wmr_schemas.signals import Log


def replay_log(log: Log, settings: Settings | None = None) -> pl.DataFrame:
    """The samples table of a log in memory, by its own nominal parameters."""
    return pl.concat([samples_frame(columns) for columns in replay_columns(log, settings)])
