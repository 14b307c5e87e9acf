"""Columns of the samples table as arrays: what the stages hand on to tables and timeline."""

from typing import Any

import numpy as np

from wmr_replay.align import AlignedBatch
from wmr_replay.identify import Motion, Slip, Verdict
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S
from wmr_schemas.modes import MODES, ContactMode, ModeSet
from wmr_schemas.status import Status

Columns = dict[str, np.ndarray[Any, Any]]
"""By name, equally long; ``status`` as positions in ``Status``; NaN where unknown."""

POSTERIOR = tuple(f"p_{mode.label}" for mode in MODES)


def measured(start_ns: int, rows: AlignedBatch) -> Columns:
    """Time, pose and truth, as they came."""
    x_m, y_m, yaw_rad = rows.pose
    t_s = (rows.t_ns - start_ns) / NS_PER_S
    return {
        "t_ns": rows.t_ns,
        "t_s": t_s,
        "x_m": x_m,
        "y_m": y_m,
        "yaw_rad": yaw_rad,
        "mode_true": rows.mode_true,
    }


def unknown(start_ns: int, rows: AlignedBatch, all_modes: ModeSet) -> Columns:
    """Rows about which nothing can be said yet: ``mode_set`` is ``all_modes``."""
    n = len(rows)
    verdict = {
        "mode": np.full(n, ContactMode.UNDECIDED, np.int8),
        "mode_set": np.full(n, all_modes, np.uint8),
    }
    return measured(start_ns, rows) | verdict | {"status": np.full(n, Status.WARMING_UP, np.int8)}


def estimated(
    start_ns: int, rows: AlignedBatch, motion: Motion, slip: Slip, verdict: Verdict, delay_s: F64, status: I8
) -> Columns:
    """Complete rows."""
    columns = measured(start_ns, rows) | motion._asdict() | verdict._asdict()
    del columns["outcome"], columns["posterior"]
    columns |= dict(zip(POSTERIOR, verdict.posterior, strict=True))
    columns |= {
        "c_k_mps": -motion.v_lat_mps,
        "c_k_mps_sd": motion.v_lat_mps_sd,
        "c_d_mps2_sd": motion.a_long_mps2_sd,
    }
    columns |= {
        "sigma_sum_mps": slip.sum_mps,
        "sigma_diff_mps": slip.diff_mps,
        "delay_s": delay_s,
        "status": status,
    }
    return columns


def concatenate(batches: list[AlignedBatch]) -> AlignedBatch:
    """Aligned batches as one."""
    return AlignedBatch(
        np.concatenate([b.t_ns for b in batches]),
        np.concatenate([b.pose for b in batches], axis=1),
        np.concatenate([b.inputs for b in batches], axis=1),
        np.concatenate([b.mode_true for b in batches]),
    )


def part(rows: AlignedBatch, index: slice | I64) -> AlignedBatch:
    """Some of the rows."""
    return AlignedBatch(rows.t_ns[index], rows.pose[:, index], rows.inputs[:, index], rows.mode_true[index])
