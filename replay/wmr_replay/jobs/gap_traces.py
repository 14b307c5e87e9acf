"""The traces of a gap analysis as a table, the way it lies on disk."""

import numpy as np
import polars as pl

from wmr_replay.gap.result.result import Traces
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.tables import GAP_TRACES, polars_schema

CHANNELS = ("longitudinal", "lateral", "yaw")


def traces_frame(traces: Traces) -> pl.DataFrame:
    """A row per bin; what is not known is null."""
    columns: dict[str, object] = {
        "t_ns": traces.start_ns + np.round(traces.t_s * NS_PER_S).astype(np.int64),
        "t_s": traces.t_s,
        "mode": traces.mode.astype(np.int8),
        "held_out": traces.held_out.astype(bool),
        **dict(zip(("x_m", "y_m", "yaw_rad"), traces.measured.T, strict=True)),
        **model_columns("base", traces.measured, traces.base_path, traces.base_residual),
        **model_columns("extended", traces.measured, traces.extended_path, traces.extended_residual),
        **traces.quantities,
    }
    schema = polars_schema(GAP_TRACES)
    known = pl.DataFrame(
        {name: columns.get(name, np.full(len(traces.t_s), np.nan)) for name in schema}, schema=schema
    )
    real = [name for name, dtype in schema.items() if dtype == pl.Float64]
    return known.with_columns(pl.when(pl.col(name).is_finite()).then(name) for name in real)


def model_columns(model: str, measured: F64, path: F64, residual: F64) -> dict[str, F64]:
    """The columns of one model: simulated path, errors, residuals."""
    gap = measured - path
    names = (f"{model}_x_m", f"{model}_y_m", f"{model}_yaw_rad")
    return {
        **dict(zip(names, path.T, strict=True)),
        f"{model}_error_m": np.hypot(gap[:, 0], gap[:, 1]),
        f"{model}_error_yaw_rad": gap[:, 2],
        **{f"{model}_residual_{channel}": residual[:, k] for k, channel in enumerate(CHANNELS)},
    }
