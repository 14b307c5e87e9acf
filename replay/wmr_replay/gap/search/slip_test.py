"""Whether an effect is no other than the base model's own slipping.

It is held against slipping in the history that explains the same stretch best (:mod:`.slipping_history`): by
how much it is likelier, and whether that is more than its price and a margin.
"""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, cost_of, fit_model
from wmr_replay.gap.estimation.relabel import with_slipping
from wmr_replay.gap.estimation.unknown_modes import causal_deviance
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.dynamics import Base, Row
from wmr_replay.gap.model.extension import Extension, weight
from wmr_replay.gap.search.fit_candidates import seen_parameters
from wmr_replay.gap.search.slip_doubts import losses_by_piece, slips_alike
from wmr_replay.gap.search.slipping_history import Pieces, likeliest_history
from wmr_replay.gap.settings.search import SlipSettings
from wmr_schemas.arrays import F64, Bool

SATURATION = "torque_saturation"


class Rival(NamedTuple):
    """The model's own slipping in place of an effect: the problem with its history, the rows (n,) where that
    may differ, and by how much it is less likely, the price of the changes of mode included.
    """

    problem: Problem
    rows: Bool
    excess: float


def may_be_slipping(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether the effect ``name`` of the model ``fit`` may be slipping that an identifier missed.

    It may unless it is clearly likelier than slipping in the likeliest history, also with unknown modes near
    it (:func:`gain_unlabelled`), and no shorter than an interval that is looked for. Where a robot's masses
    are unknown, so is what its slipping loses, and only a small loss is none; none is of a calibrated robot,
    whose slipping is a finding by itself (:mod:`.seen_slipping`). A limit of the torques may be slipping,
    too: a wheel that slips is driven harder by a controller, on a calm drive harder than ever while it rolls.
    Always false for other effects, and for modes that are given.
    """
    if name not in (*LOCAL, SATURATION) or not problem.binned.identified:
        return False
    if name == SATURATION:
        return slipping_rival(problem, fit, name).excess < least_excess(problem, fit, name)
    if problem.binned.log.robot.slip_shares is None:
        least = problem.settings.slip.least_of_unknown
        return bool(fit.extension.misfit) or fit.extension.effects[name]["loss"] > least
    loss, alone = fit.extension.effects[name]["loss"], len(fit.extension.effects) == 1
    if slips_alike(fit.extension.base, loss, problem.settings.slip, alone=alone):
        return True
    acts = weight(name, fit.extension.effects[name], problem.binned) > problem.settings.slip.half
    if problem.binned.step_s[acts].sum() < problem.settings.scan.shortest_interval_s:
        return True
    least = least_excess(problem, fit, name)
    return slipping_rival(problem, fit, name).excess < least or gain_unlabelled(problem, fit, name) < least


@lru_cache(maxsize=16)
def gain_unlabelled(problem: Problem, fit: Fit, name: str) -> float:
    """By how much an effect makes the log likelier, in −2 log likelihood, where the modes of the rows near it
    are not known with it nor without it: slips and skids that labels miss explain what they can.
    """
    binned = problem.binned
    acts = weight(name, fit.extension.effects[name], binned) > problem.settings.slip.half
    unlabelled = replace(problem, train=problem.train & ~close_to(acts, binned))
    without, with_it = fit.extension.without(name), fit.extension
    gain = causal_deviance(unlabelled, without, fit.noise) - causal_deviance(unlabelled, with_it, fit.noise)
    return float(gain.sum())


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
