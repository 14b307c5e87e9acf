"""Losses of α in cells of time, added up to load steps, slip intervals and patches."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.binned_log import Drive
from wmr_replay.gap.model.extension import Parameters
from wmr_replay.gap.search.leads import Lead, Normal
from wmr_schemas.arrays import F64, I64

MOST_CELLS, LEAST_CELL_S = 120, 0.5
LONGEST_INTERVAL_S, SHORTEST_INTERVAL_S = 30.0, 1.0
RADII_M = (0.5, 1.0, 1.5, 2.5)


def time_cells(drive: Drive) -> tuple[I64, int]:
    """The cell of time in which each row lies, and how many there are."""
    span = float(drive.t_s[-1] - drive.t_s[0])
    n_cells = int(min(MOST_CELLS, max(1, span // LEAST_CELL_S)))
    cells = np.minimum((drive.t_s - drive.t_s[0]) / span * n_cells, n_cells - 1)
    return cells.astype(np.int64), n_cells


@dataclass(frozen=True, eq=False)
class Patches:
    """Discs about places on the path: the share (cells, places) of each cell of time spent in each, by
    radius.
    """

    centres: F64
    shares: dict[float, F64]

    @classmethod
    def of(cls, drive: Drive, cells: I64, n_cells: int) -> "Patches":
        """A place for each cell, its middle."""
        rows = np.searchsorted(cells, np.arange(n_cells))
        middle = np.minimum((rows + np.append(rows[1:], len(cells))) // 2, len(cells) - 1)
        centres = drive.pose[middle, :2]
        dx, dy = (drive.pose[:, i, None] - centres[:, i] for i in range(2))
        squared_m2 = dx**2 + dy**2
        counts = np.maximum(np.diff(np.append(rows, len(cells))), 1)[:, None]
        shares = {
            r: np.add.reduceat((squared_m2 < r**2).astype(np.float64), rows, axis=0) / counts for r in RADII_M
        }
        return cls(centres, shares)


def cell_leads(
    normal: Normal, drive: Drive, patches: Patches, column: int, present: Mapping[str, Parameters]
) -> Iterator[Lead]:
    """Load steps, slip intervals and patches out of the losses in cells of time, from ``column`` on."""
    n_cells = len(patches.centres)
    ahead, turning = slice(column, column + n_cells), slice(column + n_cells, column + 2 * n_cells)
    s, G = normal.s, normal.G
    span = float(drive.t_s[-1] - drive.t_s[0])
    edges = drive.t_s[0] + span / n_cells * np.arange(n_cells + 1)
    if "load_step" not in present:
        yield best_step(s[ahead], G[ahead, ahead], edges)
    both_s = s[ahead] + s[turning]
    both_G = G[ahead, ahead] + G[ahead, turning] + G[turning, ahead] + G[turning, turning]
    if "slip_interval" not in present:
        yield best_interval(both_s, both_G, edges)
    if "low_friction_patch" not in present:
        yield best_patch(both_s, both_G, patches)


def sums_over(s: F64, G: F64) -> tuple[F64, F64]:
    """Prefix sums of s (n + 1,) and of G (n + 1, n + 1)."""
    P = np.concatenate([[0.0], np.cumsum(s)])
    C = np.zeros((len(s) + 1, len(s) + 1))
    C[1:, 1:] = np.cumsum(np.cumsum(G, axis=0), axis=1)
    return P, C


def best_step(s: F64, G: F64, edges: F64) -> Lead:
    """A load from t₀ on: the sum of the cells after it. α/(1 + p) = α (1 − loss)."""
    P, C = sums_over(s, G)
    n = len(s)
    starts = np.arange(max(1, n // 10), n - n // 10)
    total = P[n] - P[starts]
    size = np.maximum(C[n, n] - C[starts, n] - C[n, starts] + C[starts, starts], 1e-9)
    loss, gain = total / size, total**2 / size
    gain[(loss > 0.9) | (loss < -2.0)] = 0.0
    i = int(np.argmax(gain))
    parameters = {"mass_ratio": float(loss[i] / (1 - loss[i])), "t0_s": float(edges[starts[i]])}
    return Lead("load_step", parameters, float(gain[i]), n)


def best_interval(s: F64, G: F64, edges: F64) -> Lead:
    """A loss of α and α_yaw between two edges."""
    P, C = sums_over(s, G)
    i, j = np.triu_indices(len(edges), 1)
    length = edges[j] - edges[i]
    fits = (length >= SHORTEST_INTERVAL_S) & (length <= LONGEST_INTERVAL_S)
    i, j = i[fits], j[fits]
    total = P[j] - P[i]
    size = np.maximum(C[j, j] - C[i, j] - C[j, i] + C[i, i], 1e-9)
    loss = total / size
    gain = np.where((loss > 0.02) & (loss < 1.3), total**2 / size, 0.0)
    k = int(np.argmax(gain))
    parameters = {
        "start_s": float(edges[i[k]]),
        "end_s": float(edges[j[k]]),
        "loss": float(min(loss[k], 0.98)),
    }
    return Lead("slip_interval", parameters, float(gain[k]), len(i))


def best_patch(s: F64, G: F64, patches: Patches) -> Lead:
    """A loss within a disc about a place on the path."""
    found = Lead("low_friction_patch", {}, -1.0, 1)
    for radius, share in patches.shares.items():
        size = np.maximum(np.sum(share * (G @ share), axis=0), 1e-9)
        total = share.T @ s
        loss = total / size
        gain = np.where((loss > 0.02) & (loss < 1.3), total**2 / size, 0.0)
        k = int(np.argmax(gain))
        if gain[k] > found.gain:
            x, y = patches.centres[k]
            place = {"x_m": float(x), "y_m": float(y), "radius_m": radius}
            parameters = place | {"loss": float(min(loss[k], 0.98))}
            found = Lead("low_friction_patch", parameters, float(gain[k]), len(RADII_M) * len(s))
    return found
