"""What pictures of a replay draw of the samples table, on pages and for papers alike."""

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
