"""Load steps, slip intervals and patches as sums of losses of α in cells of time.

With s and G of the losses in single cells, a loss over a set of cells a has total sᵀa, size aᵀGa, best loss
total/size and gain total²/size; prefix sums give every interval at once.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.extension import Parameters
from wmr_replay.gap.scan.score import NormalEquations, ScoredCandidate
from wmr_replay.gap.settings.scan import ScanSettings
from wmr_schemas.arrays import F64, I64

PRODUCT_COLUMNS = 16
"""Columns of a product at a time."""


def time_cells(binned: BinnedLog) -> tuple[I64, int]:
    """The cell of time in which each row (n,) lies, and the number of cells."""
    own = binned.settings.scan
    span = float(binned.t_s[-1] - binned.t_s[0])
    n_cells = int(min(own.most_cells, max(1, span // own.least_cell_s)))
    cells = np.minimum((binned.t_s - binned.t_s[0]) / span * n_cells, n_cells - 1)
    return cells.astype(np.int64), n_cells


@dataclass(frozen=True, eq=False)
class Patches:
    """Discs about places on the path: ``centres`` (places, 2) in m, and by radius the share (cells, places)
    of each cell of time spent in each disc.
    """

    centres: F64
    shares: dict[float, F64]

    @classmethod
    def of(cls, binned: BinnedLog, cells: I64, n_cells: int) -> "Patches":
        """A place for each cell, its middle."""
        rows = np.searchsorted(cells, np.arange(n_cells))
        middle = np.minimum((rows + np.append(rows[1:], len(cells))) // 2, len(cells) - 1)
        centres = binned.pose[middle, :2]
        dx, dy = (binned.pose[:, i, None] - centres[:, i] for i in range(2))
        squared_m2 = dx**2 + dy**2
        counts = np.maximum(np.diff(np.append(rows, len(cells))), 1)[:, None]
        shares = {
            r: np.add.reduceat((squared_m2 < r**2).astype(np.float64), rows, axis=0) / counts
            for r in binned.settings.scan.radii_m
        }
        return cls(centres, shares)


@lru_cache(maxsize=4)
def patches_of(binned: BinnedLog) -> Patches:
    """The patches that are scanned; with the same bins, a search scans many models."""
    return Patches.of(binned, *time_cells(binned))


def local_candidates(
    normal: NormalEquations,
    binned: BinnedLog,
    patches: Patches,
    column: int,
    present: Mapping[str, Parameters],
) -> Iterator[ScoredCandidate]:
    """The best load step, slip interval and patch, without those ``present`` in the model.

    The losses of α in cells of time stand in ``normal`` from ``column`` on, those of α_yaw after them.
    """
    own, n_cells = binned.settings.scan, len(patches.centres)
    ahead, turning = slice(column, column + n_cells), slice(column + n_cells, column + 2 * n_cells)
    s, G = normal.s, normal.G
    span = float(binned.t_s[-1] - binned.t_s[0])
    edges = binned.t_s[0] + span / n_cells * np.arange(n_cells + 1)
    if "load_step" not in present:
        yield best_step(s[ahead], G[ahead, ahead], edges, own)
    both_s = s[ahead] + s[turning]
    both_G = G[ahead, ahead] + G[ahead, turning] + G[turning, ahead] + G[turning, turning]
    if "slip_interval" not in present:
        yield best_interval(both_s, both_G, edges, own)
    if "low_friction_patch" not in present:
        yield best_patch(both_s, both_G, patches, own)


def sums_over(s: F64, G: F64) -> tuple[F64, F64]:
    """Prefix sums of s (n + 1,) and of G (n + 1, n + 1)."""
    P = np.concatenate([[0.0], np.cumsum(s)])
    C = np.zeros((len(s) + 1, len(s) + 1))
    C[1:, 1:] = np.cumsum(np.cumsum(G, axis=0), axis=1)
    return P, C


def credible_gain(total: F64, size: F64, settings: ScanSettings) -> tuple[F64, F64]:
    """Loss and gain of each sum; the gain is 0 where no traction can be lost so."""
    low, high = settings.local_loss
    loss = total / size
    return loss, np.where((loss > low) & (loss < high), total**2 / size, 0.0)


def best_step(s: F64, G: F64, edges: F64, settings: ScanSettings) -> ScoredCandidate:
    """A load from t₀ on: the sum of the cells after it. α/(1 + p) = α (1 − loss)."""
    P, C = sums_over(s, G)
    n, margin = len(s), len(s) // settings.step_margin
    starts = np.arange(max(1, margin), n - margin)
    total = P[n] - P[starts]
    size = np.maximum(C[n, n] - C[starts, n] - C[n, starts] + C[starts, starts], 1e-9)
    loss, gain = total / size, total**2 / size
    least, most = settings.step_loss
    gain[(loss > most) | (loss < least)] = 0.0
    i = int(np.argmax(gain))
    parameters = {"mass_ratio": float(loss[i] / (1 - loss[i])), "t0_s": float(edges[starts[i]])}
    return ScoredCandidate("load_step", parameters, float(gain[i]), n)


def best_interval(s: F64, G: F64, edges: F64, settings: ScanSettings) -> ScoredCandidate:
    """A loss of α and α_yaw between two edges."""
    P, C = sums_over(s, G)
    i, j = np.triu_indices(len(edges), 1)
    length = edges[j] - edges[i]
    fits = (length >= settings.shortest_interval_s) & (length <= settings.longest_interval_s)
    i, j = i[fits], j[fits]
    size = np.maximum(C[j, j] - C[i, j] - C[j, i] + C[i, i], 1e-9)
    loss, gain = credible_gain(P[j] - P[i], size, settings)
    k = int(np.argmax(gain))
    parameters = {
        "start_s": float(edges[i[k]]),
        "end_s": float(edges[j[k]]),
        "loss": float(min(loss[k], settings.most_local_loss)),
    }
    return ScoredCandidate("slip_interval", parameters, float(gain[k]), len(i))


def sizes_of(share: F64, G: F64) -> F64:
    """aᵀGa (places,) of each column a of ``share`` (cells, places).

    Few columns at a time: for so small a product BLAS starts no threads, which would wait for each other
    longer than they work, and the answer does not depend on the number of cores.
    """
    parts = (share[:, a : a + PRODUCT_COLUMNS] for a in range(0, share.shape[1], PRODUCT_COLUMNS))
    return np.concatenate([np.sum(part * (G @ part), axis=0) for part in parts])


def best_patch(s: F64, G: F64, patches: Patches, settings: ScanSettings) -> ScoredCandidate:
    """A loss within a disc about a place on the path."""
    found = ScoredCandidate("low_friction_patch", {}, -1.0, 1)
    for radius, share in patches.shares.items():
        size = np.maximum(sizes_of(share, G), 1e-9)
        loss, gain = credible_gain(share.T @ s, size, settings)
        k = int(np.argmax(gain))
        if gain[k] > found.gain:
            x, y = patches.centres[k]
            place = {"x_m": float(x), "y_m": float(y), "radius_m": radius}
            parameters = place | {"loss": float(min(loss[k], settings.most_local_loss))}
            n_tried = len(settings.radii_m) * len(s)
            found = ScoredCandidate("low_friction_patch", parameters, float(gain[k]), n_tried)
    return found
