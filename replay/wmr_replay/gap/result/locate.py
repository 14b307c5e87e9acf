"""Where simulation and measurement disagree: by channel, in time, in space and by regime.

The measure is the prediction errors of the base model, whitened at the extended model's diffusion: their mean
square is 1 where nothing is missing, and the excess over 1 is shared out.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dynamics import Row, V, W
from wmr_replay.gap.result.result import Interval, Regime, Region, Where
from wmr_replay.gap.settings.result import LocateSettings
from wmr_schemas.arrays import F64, I64
from wmr_schemas.model_file import Effect
from wmr_schemas.modes import MODES


def locate(
    binned: BinnedLog, rows: F64, states: F64, errors: F64, base: Diffusion, extended: Diffusion
) -> Where:
    """Channels, intervals, places and regimes of the largest excess.

    ``errors`` (n, 3): whitened prediction errors of the base model in x, y and yaw at the extended model's
    diffusion; ``rows`` (n, 16) inputs, ``states`` (n, 9) filtered.
    """
    own = binned.settings.locate
    by_channel = in_body_frame(errors, binned.pose[:, 2])
    excess = (by_channel**2).sum(axis=1) - by_channel.shape[1]
    return Where(
        channels=disturbance_ratios(base, extended),
        intervals=intervals_of(binned.t_s, excess, own),
        regions=regions_of(binned.pose, excess, own),
        regime=regimes_of(binned, rows, states, by_channel),
    )


def marked(where: Where, left: Effect) -> Where:
    """``where`` with the time or place of a disagreement in front, whose share of the excess is that of the
    listed ones which it covers.
    """
    p = left.parameters
    if "x_m" in p:
        reach = p["radius_m"]
        share = sum(r.share for r in where.regions if np.hypot(r.x_m - p["x_m"], r.y_m - p["y_m"]) <= reach)
        return replace(where, regions=(Region(p["x_m"], p["y_m"], reach, share), *where.regions))
    start_s, end_s = p["start_s"], p["end_s"]
    share = sum(i.share for i in where.intervals if start_s < i.end_s and end_s > i.start_s)
    return replace(where, intervals=(Interval(start_s, end_s, min(share, 1.0)), *where.intervals))


def placed(left: Effect) -> str:
    """The time or place of a disagreement in words, with the change of traction that it looks like."""
    p = left.parameters
    if "x_m" in p:
        at = f"within {p['radius_m']:.1f} m about ({p['x_m']:.1f}, {p['y_m']:.1f}) m"
    else:
        at = f"from {p['start_s']:.1f} to {p['end_s']:.1f} s"
    return f"{at} model and log disagree as if {p['loss']:.0%} of the traction were lost"


def disturbance_ratios(base: Diffusion, extended: Diffusion) -> Mapping[str, float]:
    """√(Q/Q_extended) by channel, Q = 2 s² τ the disturbance's density at low frequency.

    Sideways τ is the same in both.
    """
    long, yaw = base.densities_mps2_rthz
    long_left, yaw_left = extended.densities_mps2_rthz
    return {
        "longitudinal": long / long_left,
        "lateral": base.lat_sd_mps / extended.lat_sd_mps,
        "yaw": yaw / yaw_left,
    }


def in_body_frame(errors: F64, yaw_rad: F64) -> F64:
    """Errors ahead, to the left, and in yaw, (n, 3), from errors in x, y and yaw."""
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    ahead = cos * errors[:, 0] + sin * errors[:, 1]
    left = cos * errors[:, 1] - sin * errors[:, 0]
    return np.column_stack([ahead, left, errors[:, 2]])


def intervals_of(t_s: F64, excess: F64, settings: LocateSettings) -> tuple[Interval, ...]:
    """Blocks of 2 s with at least a twentieth of the whole excess, neighbours merged, the largest first."""
    block_s = settings.block_s
    block = (t_s // block_s).astype(np.int64)
    total = np.maximum(np.bincount(block, excess), 0.0)
    if total.sum() <= 0:
        return ()
    share = total / total.sum()
    marked = np.flatnonzero(np.diff(np.concatenate([[0], (share >= settings.least_share).astype(int), [0]])))
    found = [
        Interval(float(a * block_s), float(b * block_s), float(share[a:b].sum()))
        for a, b in marked.reshape(-1, 2)
    ]
    return tuple(sorted(found, key=lambda i: -i.share)[: settings.most_places])


def regions_of(pose: F64, excess: F64, settings: LocateSettings) -> tuple[Region, ...]:
    """Cells of 1 m on the path with the largest shares of the excess."""
    cell_m = settings.cell_m
    cells, place = np.unique(np.floor(pose[:, :2] / cell_m).astype(np.int64), axis=0, return_inverse=True)
    total = np.maximum(np.bincount(place.ravel(), excess), 0.0)
    if total.sum() <= 0:
        return ()
    share = total / total.sum()
    largest = [k for k in np.argsort(-share)[: settings.most_places] if share[k] >= settings.least_share]
    centres = (cells + 0.5) * cell_m
    return tuple(
        Region(float(centres[k, 0]), float(centres[k, 1]), cell_m / 2, float(share[k])) for k in largest
    )


def regimes_of(binned: BinnedLog, rows: F64, states: F64, errors: F64) -> Mapping[str, tuple[Regime, ...]]:
    """Mean squares of the errors in bins of speed, yaw rate, torque, heading and mode."""
    own = binned.settings.locate
    torque = np.abs(rows[:, [Row.LEFT, Row.RIGHT]]).max(axis=1)
    quantities = {
        "speed_mps": (np.abs(states[:, V]), None),
        "yaw_rate_mps": (np.abs(states[:, W]), None),
        "torque_nm": (torque, None),
        "heading_rad": (
            np.mod(binned.pose[:, 2], 2 * np.pi),
            np.linspace(0, 2 * np.pi, own.heading_bins + 1),
        ),
        "mode": (binned.mode, np.arange(-0.5, len(MODES))),
    }
    step_s = binned.step_s
    return {
        name: bins_of(
            values, edges if edges is not None else quantiles(values, own.quantile_bins), errors, step_s
        )
        for name, (values, edges) in quantities.items()
    }


def quantiles(values: F64, n_bins: int) -> F64:
    """Edges of ``n_bins`` bins of equal share; fewer where values repeat."""
    return np.unique(np.quantile(values, np.linspace(0, 1, n_bins + 1)))


def bins_of(values: F64, edges: F64, errors: F64, step_s: F64) -> tuple[Regime, ...]:
    """Mean squared errors of each bin between ``edges``; empty bins are left out."""
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
