"""Intervals that are called slipping, and what they lose beyond slipping.

Slipping leaves ``slip_share`` of α and ``slip_share_yaw`` of α_yaw once σ has settled. At the model with its
slipping, innovations are linear in further losses; their estimate with covariance C is held against 0 by the
distance dᵀ C⁻¹ d.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.diffusion import calm_or_same
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import weight
from wmr_replay.gap.scan.local_effects import time_cells
from wmr_replay.gap.scan.loss_for_slipping import Scores, losses_for_slipping
from wmr_replay.gap.scan.score import ScoredCandidate, penalised_gain
from wmr_replay.gap.search.fit_candidates import Hints
from wmr_replay.gap.settings.search import SlipSettings
from wmr_schemas.arrays import F64, I64, Bool


class Doubt(NamedTuple):
    """An interval [first, last) of rows that is called slipping, the loss that it shows, and how far that is
    from slipping's, dᵀ C⁻¹ d.
    """

    first: int
    last: int
    loss: float
    distance: float


def unlike_slipping(problem: Problem, fit: Fit) -> list[Doubt]:
    """The intervals called slipping that clearly lose more or less than slipping does, the farthest first.

    Intervals close to each other are one. The ends, 0.4 s each, are not tested.
    """
    binned, own, base = problem.binned, problem.settings.slip, fit.extension.base
    runs = slipping_runs(binned)
    if not runs:
        return []
    further, covariance = further_losses(problem, fit, runs)
    share = np.array([base.slip_share, base.slip_share_yaw])
    inverse = np.linalg.inv(covariance + np.diag((np.array(own.loss_sd) / share) ** 2))
    far = np.einsum("kc,kcd,kd->k", further, inverse, further)
    common = inverse / share / share[:, None]  # of both losses, 1 − share (1 − further)
    kept = np.einsum("kcd,kd->k", common, share * (1.0 - further)) / common.sum(axis=(1, 2))
    loss = 1.0 - np.clip(kept, 1.0 - problem.settings.scan.most_local_loss, 1.0)
    doubts = [Doubt(*run, float(loss[k]), float(far[k])) for k, run in enumerate(runs)]
    if binned.log.robot.slip_shares is None:
        doubts = [d for d in doubts if d.loss < own.least_of_unknown]
    return sorted((d for d in doubts if d.distance > own.far), key=lambda d: -d.distance)


def as_losses(binned: BinnedLog, doubt: Doubt) -> Hints:
    """A doubtful interval as a loss of traction in its time, and in its place."""
    at = slice(doubt.first, doubt.last)
    time = {"start_s": float(binned.t_s[doubt.first]), "end_s": float(binned.t_s[doubt.last - 1])}
    centre = (binned.pose[at, :2].min(axis=0) + binned.pose[at, :2].max(axis=0)) / 2
    reach = float(np.hypot(*(binned.pose[at, :2] - centre).T).max())
    place = {"x_m": float(centre[0]), "y_m": float(centre[1]), "radius_m": reach}
    loss = {"loss": doubt.loss}
    return (("slip_interval", time | loss), ("low_friction_patch", place | loss))


def in_place_of_slipping(problem: Problem, fit: Fit) -> list[tuple[Bool, Hints]]:
    """The interval and the patch that explain clearly more than the slipping in them, the better one first:
    the slipping rows (n,) that they replace, and where a fit may start.

    An identifier calls a loss in a part of an interval slipping, and one at all crossings of a patch.
    """
    binned, own = problem.binned, problem.settings.slip
    if not np.any(binned.slips):
        return []
    price, found = problem.settings.scan, losses_for_slipping(binned, scores_of_cells(problem, fit))
    margin = problem.settings.selection.margin_identified
    clear = [
        one
        for one in found
        if penalised_gain(one, price) > margin
        and not slips_alike(fit.extension.base, one.parameters["loss"], own)
    ]
    places: dict[bytes, tuple[Bool, Hints]] = {}
    for one in sorted(clear, key=lambda one: -one.gain):
        rows = binned.slips & (weight(one.name, one.parameters, binned) > 0)
        _, hints = places.get(rows.tobytes(), (rows, ()))
        places[rows.tobytes()] = rows, (*hints, *both_forms(binned, one))
    return list(places.values())


def both_forms(binned: BinnedLog, one: ScoredCandidate) -> Hints:
    """A loss in a time or place, and as the other of both where it acts once: rivals start alike."""
    acts = weight(one.name, one.parameters, binned) > binned.settings.slip.half
    runs = np.flatnonzero(np.diff(acts, prepend=False, append=False)).reshape(-1, 2).tolist()
    same: Hints = ((one.name, one.parameters),)
    if len(runs) != 1:
        return same
    ((first, last),) = runs
    forms = as_losses(binned, Doubt(first, last, one.parameters["loss"], np.inf))
    return (*same, *(form for form in forms if form[0] != one.name))


def scores_of_cells(problem: Problem, fit: Fit) -> Scores:
    """Scores of all traction lost, and of traction left, in each cell of time.

    Innovations count in units of their usual size where that is more than 1.
    """
    binned, base = problem.binned, fit.extension.base
    cells, n_cells = time_cells(binned)
    e, by_piece, piece = losses_by_piece(problem, fit, fit.noise, 2 * cells + binned.slips)
    first = np.flatnonzero(np.diff(piece, prepend=-1))
    share = np.array([[base.slip_share], [base.slip_share_yaw]])
    share = np.where(binned.slips[first], share, 1.0)
    of_cell = (cells[first, None] == np.arange(n_cells)).astype(np.float64)
    unit = max(float(np.sqrt(np.mean(np.square(e)))), 1.0)
    lost, left = by_piece.sum(axis=1) @ of_cell, (by_piece / share).sum(axis=1) @ of_cell
    return Scores.of(e / unit, lost / unit, left / unit)


def slips_as_modelled(problem: Problem, fit: Fit) -> bool:
    """Whether all that is called slipping follows the model closely."""
    own, q = problem.settings.slip, problem.settings.filter.slip_disturbance_mps2_rthz
    return q <= own.close_mps2_rthz and not unlike_slipping(problem, fit)


def slipping_runs(binned: BinnedLog) -> list[tuple[int, int]]:
    """Rows [a, b) of each slipping interval that is long enough to have an inside, close ones joined."""
    own = binned.settings.slip
    least_s = 2 * own.edge_s + own.shortest_inside_s
    return [
        (a, b) for a, b in joined_runs(binned, binned.slips) if binned.t_s[b - 1] - binned.t_s[a] > least_s
    ]


def joined_runs(binned: BinnedLog, rows: Bool) -> list[tuple[int, int]]:
    """The runs [a, b) of ``rows`` (n,), close ones joined."""
    joined: list[tuple[int, int]] = []
    for a, b in np.flatnonzero(np.diff(rows, prepend=False, append=False)).reshape(-1, 2).tolist():
        if joined and binned.t_s[a] - binned.t_s[joined[-1][1] - 1] < binned.settings.slip.close_s:
            joined[-1] = joined[-1][0], b
        else:
            joined.append((a, b))
    return joined


def further_losses(problem: Problem, fit: Fit, runs: list[tuple[int, int]]) -> tuple[F64, F64]:
    """Losses (k, 2) of α and α_yaw inside of each run beyond slipping's, with covariance (k, 2, 2).

    0 is as slipping, 1 none left. What the ends lose is estimated beside it.
    """
    binned, own, m = problem.binned, problem.settings.slip, len(runs)
    kind = np.full(len(binned), -1)
    for k, (a, b) in enumerate(runs):
        first_s, last_s = binned.t_s[a], binned.t_s[b - 1]
        near = (binned.t_s > first_s - own.edge_s) & (binned.t_s < last_s + own.edge_s)
        inside = (binned.t_s > first_s + own.edge_s) & (binned.t_s < last_s - own.edge_s)
        kind[near] = m + k
        kind[inside & binned.slips] = k
    noise = calm_or_same(fit.noise, problem.settings.diffusion)
    e, by_piece, piece = losses_by_piece(problem, fit, noise, kind)
    columns = np.zeros((len(e), 2, 2 * m))
    for k in range(2 * m):
        columns[:, :, k] = by_piece[:, :, np.unique(piece[kind == k])].sum(axis=2)
    flat = columns.reshape(len(e), 4 * m)
    V = np.linalg.inv(flat.T @ flat + own.least_information * np.eye(4 * m))
    loss = V @ (flat.T @ e)
    left = np.square(e - flat @ loss).reshape(-1, 3).mean(axis=1)
    V *= max(float(left[kind >= 0].mean()), 1.0)
    pairs = np.arange(m)[:, None] + np.array([0, 2 * m])
    return loss[pairs], V[pairs[:, :, None], pairs[:, None, :]]


def losses_by_piece(problem: Problem, fit: Fit, noise: Diffusion, kind: I64) -> tuple[F64, F64, I64]:
    """Innovations e (3n,), their sensitivities (3n, 2, m) to losses of α and α_yaw in each of m pieces, and
    the piece (n,) of each row: a run of rows of one ``kind`` (n,).
    """
    piece = np.cumsum(np.diff(kind, prepend=kind[:1]) != 0)
    m = int(piece[-1]) + 1
    targets = NO_TARGETS._replace(cells=piece, n_cells=m)
    output = problem.filtered(fit.extension, noise, targets, keep=True)
    return output.innovations.ravel(), output.sensitivities.reshape(-1, 2, m), piece


def slips_alike(base: Base, loss: float, settings: SlipSettings, *, alone: bool = True) -> bool:
    """Whether a loss is near that of the model's slipping, ahead and in turning; in one of them where it is
    not ``alone``: what the wrong form of another effect leaves makes up for the other one.
    """
    left = np.array([base.slip_share, base.slip_share_yaw])
    near = np.abs(1.0 - left - loss) < settings.least_apart
    return bool(np.all(near) if alone else np.any(near))
