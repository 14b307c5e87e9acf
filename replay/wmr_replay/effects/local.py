"""How much of an effect in a stretch of time or a region acts at each row, 0 to 1."""

import numpy as np

from wmr_replay.effects.theta import Values
from wmr_schemas.arrays import F64

EDGE_S, EDGE_M, LOADING_S = 0.15, 0.15, 1.0
"""Widths of the edges: soft, so that times and places have a slope; a load is taken on within seconds."""


def local_weight(name: str, values: Values, t_s: F64, xy_m: F64) -> F64:
    """Weight (n,) of an effect at times ``t_s`` (n,) and positions ``xy_m`` (n, 2)."""
    if name == "load_step":
        return soft_step((t_s - values["t0_s"]) / LOADING_S)
    if name == "slip_interval":
        after, before = (t_s - values["start_s"]) / EDGE_S, (values["end_s"] - t_s) / EDGE_S
        return soft_step(after) * soft_step(before)
    distance = np.hypot(xy_m[:, 0] - values["x_m"], xy_m[:, 1] - values["y_m"])
    return soft_step((values["radius_m"] - distance) / EDGE_M)


def soft_step(x: F64) -> F64:
    """From 0 to 1 about x = 0."""
    return np.asarray(0.5 * (1 + np.tanh(2 * x)))
