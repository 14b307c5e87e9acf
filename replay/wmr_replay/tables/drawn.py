"""What pictures of a replay draw of the samples table, on pages and for papers alike."""

import polars as pl

DRAWN = (
    "t_s",
    "x_m",
    "y_m",
    "v_long_mps",
    "v_lat_mps",
    "yaw_rate_radps",
    "delay_s",
    "c_k_mps",
    "c_k_threshold_mps",
    "c_d_mps2",
    "c_d_threshold_mps2",
    "mode",
    "mode_true",
    "alpha",
    "alpha_sd",
)
"""Columns that every picture needs."""

WHEELS = tuple(
    f"{name}{ending}"
    for name in ("slip_left_mps", "slip_right_mps", "wheel_scale", "effective_half_track_m", "icr_offset_m")
    for ending in ("", "_sd")
)
"""Columns that pictures of a log of wheel speeds need; results of earlier versions lack them."""


def with_wheels(samples: pl.LazyFrame) -> pl.LazyFrame:
    """The samples with the columns of ``WHEELS``, null where there are none."""
    known = set(samples.collect_schema().names())
    return samples.with_columns(pl.lit(None, pl.Float64).alias(name) for name in WHEELS if name not in known)


def by_wheel_speeds(samples: pl.DataFrame) -> bool:
    """Whether slip of the wheels is known: the modes were told by wheel speeds."""
    return any(samples[name].count() > 0 for name in ("slip_left_mps", "slip_right_mps"))
