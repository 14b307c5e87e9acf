"""Columns of the samples table as arrays: what the pipeline hands to tables and timeline."""

from typing import Any

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.identify import Motion, Slip, Verdict
from wmr_schemas.arrays import F64, I8, NS_PER_S
from wmr_schemas.modes import MODES, ContactMode, ModeSet
from wmr_schemas.status import Status

Columns = dict[str, np.ndarray[Any, Any]]
"""Arrays of equal length by column name; ``status`` holds values of ``Status``; NaN where unknown."""

SMOOTHED_POSE = ("smoothed_x_m", "smoothed_y_m", "smoothed_yaw_rad")
"""The pose through the window, at the instant that the window describes; no columns of the samples table."""
EFFORTS = ("left_nm", "right_nm")
"""The torques of each row, for plots; no columns of the samples table."""
POSTERIOR = tuple(f"p_{mode.label}" for mode in MODES)


def measured_columns(start_ns: int, rows: SampleBatch) -> Columns:
    """Time, measured pose, torques and truth of all rows."""
    x_m, y_m, yaw_rad = rows.pose_raw
    return {
        "t_ns": rows.t_ns,
        "t_s": (rows.t_ns - start_ns) / NS_PER_S,
        "x_m": x_m,
        "y_m": y_m,
        "yaw_rad": yaw_rad,
        "mode_true": rows.mode_true,
        "left_nm": rows.inputs[0],
        "right_nm": rows.inputs[1],
    }


def warming_up_columns(start_ns: int, rows: SampleBatch, all_modes: ModeSet) -> Columns:
    """Rows of the initial stretch: the status is ``warming_up`` and ``mode_set`` is ``all_modes``."""
    n = len(rows)
    return measured_columns(start_ns, rows) | {
        "mode": np.full(n, ContactMode.UNDECIDED, np.int8),
        "mode_set": np.full(n, all_modes, np.uint8),
        "status": np.full(n, Status.WARMING_UP, np.int8),
    }


def estimated_columns(
    pose: F64, motion: Motion, slip: Slip, verdict: Verdict, delay_s: F64, status: I8
) -> Columns:
    """Every estimate of the kept rows; ``pose`` (3, n) is the smoothed one."""
    columns = motion._asdict() | verdict._asdict() | dict(zip(SMOOTHED_POSE, pose, strict=True))
    del columns["outcome"], columns["posterior"], columns["wheels"]
    columns |= {} if verdict.wheels is None else verdict.wheels._asdict()
    columns |= dict(zip(POSTERIOR, verdict.posterior, strict=True))
    return columns | {
        "c_k_mps": -motion.v_lat_mps,
        "c_k_mps_sd": motion.v_lat_mps_sd,
        "c_d_mps2_sd": motion.a_long_mps2_sd,
        "sigma_sum_mps": slip.sum_mps,
        "sigma_diff_mps": slip.diff_mps,
        "delay_s": delay_s,
        "status": status,
    }
