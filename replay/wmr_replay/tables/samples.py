"""Columns of arrays → the samples table."""

import numpy as np
import polars as pl

from wmr_replay.columns import Columns
from wmr_schemas.tables import SAMPLES, STATUS_DTYPE, STATUSES, polars_schema

SCHEMA = polars_schema(SAMPLES)
STATUS_NAMES = np.array([status.value for status in STATUSES])


def samples_frame(columns: Columns) -> pl.DataFrame:
    """The samples table of one batch: absent columns and NaN become null, ``mode_true`` −1 becomes null."""
    n = len(columns["t_ns"])
    series = []
    for name, dtype in SCHEMA.items():
        if name not in columns:
            series.append(pl.Series(name, dtype=dtype).extend_constant(None, n))
        elif name == "status":
            series.append(pl.Series(name, STATUS_NAMES[columns[name]]).cast(STATUS_DTYPE))
        elif dtype == pl.Float64:
            series.append(pl.Series(name, columns[name]).fill_nan(None))
        else:
            series.append(pl.Series(name, columns[name], dtype=dtype))
    truth = pl.col("mode_true")
    return pl.DataFrame(series).with_columns(pl.when(truth >= 0).then(truth).alias("mode_true"))
