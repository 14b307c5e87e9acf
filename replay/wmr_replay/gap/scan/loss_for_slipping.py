"""Losses of traction in place of slipping: the best interval and the best patch, with their rows rolling.

An identifier calls a loss of traction slipping. It may act in a part of such an interval, and a patch that is
crossed several times in many. With innovations e at the log's modes, and A, B their sensitivities to all
traction lost in each piece and to traction per unit left there, rows that keep the share k of the traction
of rolling in the pieces a leave e − A a + k B a, slipping or not before. Prefix sums give every interval.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.scan.local_effects import Patches, sizes_of, time_cells
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.settings.scan import ScanSettings
from wmr_schemas.arrays import F64, Bool


class Sums(NamedTuple):
    """Of sets of cells, aᵀAᵀe, aᵀBᵀe, aᵀAᵀA a, aᵀBᵀA a and aᵀBᵀB a."""

    lost: F64
    left: F64
    lost_lost: F64
    left_lost: F64
    left_left: F64


class Scores(NamedTuple):
    """Aᵀe and Bᵀe (m,), AᵀA, BᵀA and BᵀB (m, m) of m cells."""

    lost: F64
    left: F64
    lost_lost: F64
    left_lost: F64
    left_left: F64

    @classmethod
    def of(cls, e: F64, lost: F64, left: F64) -> "Scores":
        """From e (3n,), A and B (3n, m)."""
        return cls(lost.T @ e, left.T @ e, lost.T @ lost, left.T @ lost, left.T @ left)


def losses_for_slipping(binned: BinnedLog, scores: Scores) -> list[ScoredCandidate]:
    """The best slip interval and the best patch that explain more than slipping does; those alone that
    replace some.
    """
    own, (cells, n_cells) = binned.settings.scan, time_cells(binned)
    slipping = np.bincount(cells, binned.slips, n_cells).astype(np.float64)
    span = float(binned.t_s[-1] - binned.t_s[0])
    edges = binned.t_s[0] + span / n_cells * np.arange(n_cells + 1)
    patches = Patches.of(binned, cells, n_cells)
    return [best_interval(scores, slipping, edges, own), *best_patches(scores, slipping, patches, own)]


def gain_of(sums: Sums, replaces: Bool, settings: ScanSettings) -> tuple[F64, F64]:
    """The best loss 1 − k of each set, and by how much it lowers |e|²; no gain where no slipping is
    replaced, or where no credible loss is left.
    """
    least = 1.0 - settings.most_local_loss
    most = 1.0 - settings.local_loss[0]
    kept = -(sums.left - sums.left_lost) / np.maximum(sums.left_left, 1e-9)
    kept = np.clip(kept, least, most)
    gain = 2 * sums.lost - sums.lost_lost - 2 * kept * (sums.left - sums.left_lost)
    gain = gain - kept**2 * sums.left_left
    return 1.0 - kept, np.where(replaces & (kept < most), gain, 0.0)


def best_interval(scores: Scores, slipping: F64, edges: F64, settings: ScanSettings) -> ScoredCandidate:
    """The best loss between two edges in place of slipping."""
    i, j = np.triu_indices(len(edges), 1)
    length = edges[j] - edges[i]
    fits = (length >= settings.shortest_interval_s) & (length <= settings.longest_interval_s)
    i, j = i[fits], j[fits]

    def single(s: F64) -> F64:
        upto = np.concatenate([[0.0], np.cumsum(s)])
        return np.asarray(upto[j] - upto[i])

    def double(G: F64) -> F64:
        upto = np.zeros((len(G) + 1, len(G) + 1))
        upto[1:, 1:] = np.cumsum(np.cumsum(G, axis=0), axis=1)
        return np.asarray(upto[j, j] - upto[i, j] - upto[j, i] + upto[i, i])

    s = scores
    sums = Sums(single(s.lost), single(s.left), double(s.lost_lost), double(s.left_lost), double(s.left_left))
    loss, gain = gain_of(sums, single(slipping) > 0, settings)
    k = int(np.argmax(gain))
    parameters = {"start_s": float(edges[i[k]]), "end_s": float(edges[j[k]]), "loss": float(loss[k])}
    return ScoredCandidate("slip_interval", parameters, float(gain[k]), len(i))


def best_patches(
    scores: Scores, slipping: F64, patches: Patches, settings: ScanSettings
) -> list[ScoredCandidate]:
    """The best loss in a disc in place of slipping."""
    found: list[ScoredCandidate] = []
    n_tried = len(settings.radii_m) * len(slipping)
    for radius, share in patches.shares.items():
        sums = Sums(
            share.T @ scores.lost,
            share.T @ scores.left,
            sizes_of(share, scores.lost_lost),
            sizes_of(share, scores.left_lost),
            sizes_of(share, scores.left_left),
        )
        loss, gain = gain_of(sums, share.T @ slipping > 0, settings)
        k = int(np.argmax(gain))
        x, y = patches.centres[k]
        parameters = {"x_m": float(x), "y_m": float(y), "radius_m": radius, "loss": float(loss[k])}
        found.append(ScoredCandidate("low_friction_patch", parameters, float(gain[k]), n_tried))
    return [max(found, key=lambda one: one.gain)]
