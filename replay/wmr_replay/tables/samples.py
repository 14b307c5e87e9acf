"""Columns of arrays → the samples table."""

import polars as pl

from wmr_replay.pipeline.columns import Columns
from wmr_schemas.arrays import I8
from wmr_schemas.tables import SAMPLES, STATUS_DTYPE, polars_schema

SCHEMA = polars_schema(SAMPLES)
STATUS = pl.Series(STATUS_DTYPE.categories).cast(STATUS_DTYPE)


def samples_frame(columns: Columns) -> pl.DataFrame:
    """The samples table of one batch: absent columns and NaN become null, ``mode_true`` −1 becomes null."""
    n = len(columns["t_ns"])
    series = []
    for name, dtype in SCHEMA.items():
        if name not in columns:
            series.append(pl.Series(name, dtype=dtype).extend_constant(None, n))
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
