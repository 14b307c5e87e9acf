"""Columns of arrays → the samples table."""

import polars as pl

from wmr_replay.pipeline.columns import Columns
from wmr_schemas.arrays import I8
from wmr_schemas.tables import HINDSIGHT, SAMPLES, STATUS_DTYPE, polars_schema

SCHEMA = polars_schema(SAMPLES)
LATER = polars_schema(HINDSIGHT)
STATUS = pl.Series(STATUS_DTYPE.categories).cast(STATUS_DTYPE)


def samples_frame(columns: Columns) -> pl.DataFrame:
    """The samples table of one batch: absent columns and NaN become null, ``mode_true`` −1 becomes null."""
    return frame_of(columns, SCHEMA)


def hindsight_frame(columns: Columns) -> pl.DataFrame:
    """The hindsight table of one batch, likewise."""
    return frame_of(columns, LATER)


def frame_of(columns: Columns, schema: pl.Schema) -> pl.DataFrame:
    """Columns as a table of the ``schema``."""
    n = len(columns["t_ns"])
    series = []
    for name, dtype in schema.items():
        if name not in columns:
            series.append(pl.Series(name, [None], dtype=dtype).new_from_index(0, n))
        elif name == "status":
            series.append(STATUS.gather(columns[name]).alias(name))
        elif dtype == pl.Float64:
            series.append(pl.Series(name, columns[name], nan_to_null=True))
        else:
            series.append(pl.Series(name, columns[name], dtype=dtype))
    return pl.DataFrame(series).with_columns(known_truth(columns["mode_true"]))


def known_truth(mode_true: I8) -> pl.Series:
    """The true modes; −1 becomes null."""
    truth = pl.Series("mode_true", mode_true)
    return truth.set(truth < 0, None) if (mode_true < 0).any() else truth
