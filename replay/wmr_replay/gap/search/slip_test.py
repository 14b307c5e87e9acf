"""Whether a loss of traction differs from the base model's own slipping.

Slipping leaves ``slip_share`` of α and ``slip_share_yaw`` of α_yaw once σ has settled. Two questions are
asked:

- of an interval that is called slipping, how much more or less than slipping it loses. At the model with its
  slipping, innovations are linear in such further losses; their estimate with covariance C is held against 0
  by the distance dᵀ C⁻¹ d;
- of an effect, how much likelier it is than the model's own slipping in the history that explains the same
  stretch best (:mod:`.slipping_history`).
"""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.diffusion import calm_or_same
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, cost_of, fit_model
from wmr_replay.gap.estimation.relabel import with_slipping
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.dynamics import Base, Row
from wmr_replay.gap.model.extension import Extension, weight
from wmr_replay.gap.scan.local_effects import time_cells
from wmr_replay.gap.scan.loss_for_slipping import Scores, losses_for_slipping
from wmr_replay.gap.scan.score import ScoredCandidate, penalised_gain
from wmr_replay.gap.search.fit_candidates import Hints, seen_parameters
from wmr_replay.gap.search.slipping_history import Pieces, likeliest_history
from wmr_replay.gap.settings.search import SlipSettings
from wmr_schemas.arrays import F64, I64, Bool

SATURATION = "torque_saturation"


class Rival(NamedTuple):
    """The model's own slipping in place of an effect: the problem with its history, the rows (n,) where that
    may differ, and by how much it is less likely, the price of the changes of mode included.
    """

    problem: Problem
    rows: Bool
    excess: float


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
    edges = np.flatnonzero(np.diff(binned.slips, prepend=False, append=False)).reshape(-1, 2)
    joined: list[tuple[int, int]] = []
    for a, b in edges.tolist():
        if joined and binned.t_s[a] - binned.t_s[joined[-1][1] - 1] < own.close_s:
            joined[-1] = joined[-1][0], b
        else:
            joined.append((a, b))
    least_s = 2 * own.edge_s + own.shortest_inside_s
    return [(a, b) for a, b in joined if binned.t_s[b - 1] - binned.t_s[a] > least_s]


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


def may_be_slipping(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether the effect ``name`` of the model ``fit`` may be slipping that an identifier missed.

    It may unless it is clearly likelier than slipping in the likeliest history, and no shorter than an
    interval that is looked for. Where a robot's masses are unknown, so is what its slipping loses,
    and only a small loss is none. A limit of the torques may be slipping, too: a wheel that slips is driven
    harder by a controller, on a calm drive harder than ever while it rolls. Always false for other
    effects, and for modes that are given.
    """
    if name not in (*LOCAL, SATURATION) or not problem.binned.identified:
        return False
    if name == SATURATION:
        return slipping_rival(problem, fit, name).excess < least_excess(problem, fit, name)
    if problem.binned.log.robot.slip_shares is None:
        return fit.extension.effects[name]["loss"] > problem.settings.slip.least_of_unknown
    loss, alone = fit.extension.effects[name]["loss"], len(fit.extension.effects) == 1
    if slips_alike(fit.extension.base, loss, problem.settings.slip, alone=alone):
        return True
    acts = weight(name, fit.extension.effects[name], problem.binned) > problem.settings.slip.half
    if problem.binned.step_s[acts].sum() < problem.settings.scan.shortest_interval_s:
        return True
    return slipping_rival(problem, fit, name).excess < least_excess(problem, fit, name)


def least_excess(problem: Problem, fit: Fit, name: str) -> float:
    """What a loss of traction must explain beyond slipping: the margin, and its own price."""
    n, own = len(problem.binned), problem.settings.slip
    price = seen_parameters(problem, fit, name) * float(np.log(3 * n)) + 2 * float(np.log(n))
    return price + (own.separate_alike if loses_as_slipping(fit, name, own) else own.separate)


def loses_as_slipping(fit: Fit, name: str, settings: SlipSettings) -> bool:
    """Whether a loss of traction is about as large as the model's slipping, ahead or in turning."""
    if name not in LOCAL:
        return False
    base, loss = fit.extension.base, fit.extension.effects[name]["loss"]
    left = np.array([base.slip_share, base.slip_share_yaw])
    return bool(np.any(np.abs(1.0 - left - loss) < settings.as_large))


def slips_alike(base: Base, loss: float, settings: SlipSettings, *, alone: bool = True) -> bool:
    """Whether a loss is near that of the model's slipping, ahead and in turning; in one of them where it is
    not ``alone``: what the wrong form of another effect leaves makes up for the other one.
    """
    left = np.array([base.slip_share, base.slip_share_yaw])
    near = np.abs(1.0 - left - loss) < settings.least_apart
    return bool(np.all(near) if alone else np.any(near))


@lru_cache(maxsize=16)
def slipping_rival(problem: Problem, fit: Fit, name: str) -> Rival:
    """Slipping in the place of an effect: the model's own, or, where that is clearly less likely, slipping
    that in the whole log is as near to the effect's loss as the model may be wrong, if that explains more.
    """
    base, binned, loss = fit.extension.base, problem.binned, losses_of(problem, fit.extension, name)
    acts = np.any(loss > problem.settings.slip.half * loss.max(), axis=0)
    near = close_to(acts, binned)
    if not np.any(near):
        return Rival(problem, near, 0.0)
    own = rival_of(problem, fit, name, near, base)
    if own.excess < least_excess(problem, fit, name):
        return own
    moved = towards(base, float(loss[:, acts].mean()), problem.settings.slip)
    return min(own, rival_of(problem, fit, name, near, moved), key=lambda rival: rival.excess)


def losses_of(problem: Problem, extension: Extension, name: str) -> F64:
    """The shares (2, n) of the torques that an effect takes away, ahead and in turning."""
    binned = problem.binned
    if name in LOCAL:
        parameters = extension.effects[name]
        return np.tile(weight(name, parameters, binned) * parameters["loss"], (2, 1))
    acting, free = (model.rows(binned) for model in (extension, extension.without(name)))
    kept, asked = (
        np.stack([rows[:, Row.RIGHT] + rows[:, Row.LEFT], rows[:, Row.RIGHT] - rows[:, Row.LEFT]])
        for rows in (acting, free)
    )
    share = np.divide(kept, asked, out=np.ones_like(kept), where=asked != 0)
    return np.clip(1.0 - share, 0.0, 1.0)


def towards(base: Base, loss: float, settings: SlipSettings) -> Base:
    """The model with slipping that loses as nearly ``loss`` as its own may be wrong."""
    near = (
        float(np.clip(1.0 - loss, share - settings.least_apart, share + settings.least_apart))
        for share in (base.slip_share, base.slip_share_yaw)
    )
    share, share_yaw = (max(one, 1e-3) for one in near)
    return base._replace(slip_share=share, slip_share_yaw=share_yaw)


def rival_of(problem: Problem, fit: Fit, name: str, near: Bool, base: Base) -> Rival:
    """Slipping as ``base`` says in place of an effect, in the likeliest history over the rows ``near``."""
    binned, loss = problem.binned, losses_of(problem, fit.extension, name)
    slips = nearest_history(problem, fit, loss, near, base)
    rival = problem.relabelled(with_slipping(binned, slips))
    extension = replace(fit.extension.without(name), base=base)
    without = fit_model(rival, extension, fit.noise, problem.settings.budget.ranked_diffusion)
    return Rival(rival, near, cost_of(without) - cost_of(fit))


def close_to(rows: Bool, binned: BinnedLog) -> Bool:
    """The rows (n,) within 0.6 s of others."""
    if not np.any(rows):
        return rows
    t_s, at = binned.t_s, binned.t_s[rows]
    after = np.minimum(np.searchsorted(at, t_s), len(at) - 1)
    apart = np.minimum(np.abs(at[after] - t_s), np.abs(at[np.maximum(after - 1, 0)] - t_s))
    return np.asarray(apart < binned.settings.slip.close_s)


def nearest_history(problem: Problem, fit: Fit, loss: F64, near: Bool, base: Base) -> Bool:
    """Where the log slips (n,) as ``base`` says, if the effect's ``loss`` (2, n) is slipping; unchanged
    outside of ``near``.
    """
    binned, own, seen = problem.binned, problem.settings.slip, fit.extension.base
    piece_s = max(own.piece_s, float(binned.step_s[near].sum()) / own.most_pieces)
    kind = np.where(near, (binned.t_s / piece_s).astype(np.int64), -1)
    e, by_piece, piece = losses_by_piece(problem, fit, fit.noise, kind)
    share = np.array([[base.slip_share], [base.slip_share_yaw]])
    seen_share = np.array([[seen.slip_share], [seen.slip_share_yaw]])
    kept = (1.0 - loss) * np.where(binned.slips, seen_share, 1.0)
    counts = np.bincount(piece)
    mean = np.stack([np.bincount(piece, channel) / counts for channel in kept])
    mean = np.maximum(mean, own.least_information)
    m = len(counts)
    flat = by_piece.reshape(len(e), 2 * m)
    pieces = Pieces(
        s=(flat.T @ e).reshape(2, m),
        G=(flat.T @ flat).reshape(2, m, 2, m),
        rolling=1.0 - 1.0 / mean,
        slipping=1.0 - share / mean,
        slips=np.bincount(piece, binned.slips) / counts > own.half,
        free=np.bincount(piece, near) > 0,
    )
    slips = likeliest_history(pieces, problem.settings.modes.change_cost)
    return np.where(near, slips[piece], binned.slips)


def missed_slipping(problem: Problem, fit: Fit) -> Problem:
    """The problem with the effects of ``fit`` that may be slipping as that; itself where there is none."""
    slips, binned = problem.binned.slips.copy(), problem.binned
    missed = [name for name in fit.extension.effects if may_be_slipping(problem, fit, name)]
    for name in missed:
        rival = slipping_rival(problem, fit, name)
        slips[rival.rows] = rival.problem.binned.slips[rival.rows]
    return problem.relabelled(with_slipping(binned, slips)) if missed else problem
