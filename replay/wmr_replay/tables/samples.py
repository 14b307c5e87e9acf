"""Columns of arrays → the samples table."""

import polars as pl

from wmr_replay.columns import Columns
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
    truth = pl.col("mode_true")
    return pl.DataFrame(series).with_columns(pl.when(truth >= 0).then(truth).alias("mode_true"))
