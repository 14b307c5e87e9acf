"""Where simulation and measurement disagree: by channel, in time, in space and by regime.

Everything is measured against the noise floor: the prediction errors of the base model, whitened by what the
extended model's diffusion leaves them to be, have a mean square of 1 where nothing is missing.
"""

from collections.abc import Mapping

import numpy as np

from wmr_replay.gap.estimation.binned_log import Drive
from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.model.dynamics import Row, V, W
from wmr_replay.gap.result.result import Interval, Regime, Region, Where
from wmr_schemas.arrays import F64, I64

BLOCK_S, CELL_M = 2.0, 1.0
MOST_PLACES = 5
LEAST_SHARE = 0.05


def locate(drive: Drive, rows: F64, states: F64, errors: F64, base: Diffusion, extended: Diffusion) -> Where:
    """``errors`` (n, 3): whitened prediction errors in x, y and yaw at the extended model's diffusion."""
    by_channel = in_body_frame(errors, drive.pose[:, 2])
    excess = (by_channel**2).sum(axis=1) - by_channel.shape[1]
    return Where(
        channels=ratios(base, extended),
        intervals=intervals_of(drive.t_s, excess),
        regions=regions_of(drive.pose, excess),
        regime=regimes_of(drive, rows, states, by_channel),
    )


def ratios(base: Diffusion, extended: Diffusion) -> Mapping[str, float]:
    """√(Q/Q_none), Q = 2 s² τ the disturbance's density at low frequency; sideways τ is the same in both."""
    long, yaw = base.densities_mps2_rthz
    long_left, yaw_left = extended.densities_mps2_rthz
    return {
        "longitudinal": long / long_left,
        "lateral": base.lat_sd_mps / extended.lat_sd_mps,
        "yaw": yaw / yaw_left,
    }


def in_body_frame(errors: F64, yaw_rad: F64) -> F64:
    """Errors along the heading, to the left, and in yaw, (n, 3)."""
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    ahead = cos * errors[:, 0] + sin * errors[:, 1]
    left = cos * errors[:, 1] - sin * errors[:, 0]
    return np.column_stack([ahead, left, errors[:, 2]])


def intervals_of(t_s: F64, excess: F64) -> tuple[Interval, ...]:
    """Blocks of 2 s with at least a twentieth of the whole excess, neighbours joined, the largest first."""
    block = (t_s // BLOCK_S).astype(np.int64)
    total = np.maximum(np.bincount(block, excess), 0.0)
    if total.sum() <= 0:
        return ()
    share = total / total.sum()
    marked = np.flatnonzero(np.diff(np.concatenate([[0], (share >= LEAST_SHARE).astype(int), [0]])))
    found = [
        Interval(float(a * BLOCK_S), float(b * BLOCK_S), float(share[a:b].sum()))
        for a, b in marked.reshape(-1, 2)
    ]
    return tuple(sorted(found, key=lambda i: -i.share)[:MOST_PLACES])


def regions_of(pose: F64, excess: F64) -> tuple[Region, ...]:
    """Cells of 1 m on the path with the largest shares of the excess."""
    cells, place = np.unique(np.floor(pose[:, :2] / CELL_M).astype(np.int64), axis=0, return_inverse=True)
    total = np.maximum(np.bincount(place.ravel(), excess), 0.0)
    if total.sum() <= 0:
        return ()
    share = total / total.sum()
    largest = [k for k in np.argsort(-share)[:MOST_PLACES] if share[k] >= LEAST_SHARE]
    centres = (cells + 0.5) * CELL_M
    return tuple(
        Region(float(centres[k, 0]), float(centres[k, 1]), CELL_M / 2, float(share[k])) for k in largest
    )


def regimes_of(drive: Drive, rows: F64, states: F64, errors: F64) -> Mapping[str, tuple[Regime, ...]]:
    """Mean squares of the errors in bins of what the robot did."""
    torque = np.abs(rows[:, [Row.LEFT, Row.RIGHT]]).max(axis=1)
    quantities = {
        "speed_mps": (np.abs(states[:, V]), None),
        "yaw_rate_mps": (np.abs(states[:, W]), None),
        "torque_nm": (torque, None),
        "heading_rad": (np.mod(drive.pose[:, 2], 2 * np.pi), np.linspace(0, 2 * np.pi, 9)),
        "mode": (drive.mode, np.arange(-0.5, 4.0)),
    }
    step_s = drive.step_s
    return {
        name: bins_of(values, edges if edges is not None else quantiles(values), errors, step_s)
        for name, (values, edges) in quantities.items()
    }


def quantiles(values: F64) -> F64:
    """Five bins of equal share; fewer where values repeat."""
    return np.unique(np.quantile(values, np.linspace(0, 1, 6)))


def bins_of(values: F64, edges: F64, errors: F64, step_s: F64) -> tuple[Regime, ...]:
    """One regime, bin by bin; empty bins are left out."""
    where: I64 = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    found = []
    for k in range(len(edges) - 1):
        inside = where == k
        if np.any(inside):
            ahead, left, yaw = (errors[inside] ** 2).mean(axis=0)
            seconds = float(step_s[inside].sum())
            found.append(
                Regime(float(edges[k]), float(edges[k + 1]), seconds, float(ahead), float(left), float(yaw))
            )
    return tuple(found)
