"""Whether a loss of traction differs from the base model's own slipping.

Slipping leaves ``slip_share`` of α and ``slip_share_yaw`` of α_yaw once σ has settled. Losses of both in an
interval are estimated with their covariance C, and held against slipping's by the distance dᵀ C⁻¹ d.
"""

import numpy as np

from wmr_replay.gap.estimation.diffusion import calm_or_same
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.relabel import with_mode_at
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import weight
from wmr_replay.gap.settings.search import SlipSettings
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.modes import ContactMode


def gentler_than_slipping(problem: Problem, fit: Fit) -> Bool:
    """The rows (n,) of intervals called slipping that leave clearly more traction than slipping does.

    The ends of an interval, 0.4 s each, are not tested.
    """
    binned = problem.binned
    runs = slipping_runs(binned)
    rows = np.zeros(len(binned), bool)
    if runs:
        track = with_mode_at(binned, binned.mode == ContactMode.SLIPPING, ContactMode.IDEAL)
        ideal, cells = problem.relabelled(track), run_cells(binned, runs)
        found = estimate_losses(ideal, fit, cells, 2 * len(runs) + 1)
        gentler = leaves_more(fit.extension.base, *found, problem.settings.slip)
        for k, (a, b) in enumerate(runs):
            rows[a:b] = gentler[2 * k + 1]
    return rows


def leaves_more(base: Base, loss: F64, covariance: F64, settings: SlipSettings) -> Bool:
    """Whether losses (c, 2) of α and α_yaw with covariance (c, 2, 2) are clearly smaller than slipping's.

    Clear is dᵀ C⁻¹ d above 6, where C also holds what quasi-steady losses leave out.
    """
    slipping = 1.0 - np.array([base.slip_share, base.slip_share_yaw])
    apart = slipping - loss
    C = covariance + np.diag(np.array(settings.loss_sd) ** 2)
    weighed = np.linalg.solve(C, apart[..., None])[..., 0]
    clear = np.einsum("ci,ci->c", apart, weighed) > settings.far
    return np.asarray(clear & (weighed @ slipping > 0))


def may_be_slipping(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether the effect ``name`` of the model ``fit`` may be slipping that an identifier missed.

    It may where its loss of traction is not clearly smaller than slipping's, either as fitted or channel by
    channel. Always false for other effects, and for modes that are given.
    """
    if name not in LOCAL or not problem.binned.identified:
        return False
    own, base, loss = problem.settings.slip, fit.extension.base, fit.extension.effects[name]["loss"]
    acts = weight(name, fit.extension.effects[name], problem.binned)
    cells = np.where(acts > own.inside, 1, np.where(acts > 1 - own.inside, 2, 0))
    further, covariance = estimate_losses(problem, fit, cells, 3)
    by_channel = leaves_more(base, 1.0 - (1.0 - loss) * (1.0 - further), (1.0 - loss) ** 2 * covariance, own)
    as_fitted = leaves_more(base, np.full((1, 2), loss), np.zeros((1, 2, 2)), own)
    return not (by_channel[1] and as_fitted[0])


def rows_of_missed_slipping(problem: Problem, fit: Fit) -> Bool:
    """The rows (n,) in which an effect of the model ``fit`` acts that may be slipping."""
    rows = np.zeros(len(problem.binned), bool)
    for name, parameters in fit.extension.effects.items():
        if may_be_slipping(problem, fit, name):
            rows |= weight(name, parameters, problem.binned) > problem.settings.slip.half
    return rows


def slipping_runs(binned: BinnedLog) -> list[tuple[int, int]]:
    """Rows [a, b) of each slipping interval that is long enough to have an inside."""
    own = binned.settings.slip
    slipping = binned.mode == ContactMode.SLIPPING
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slipping, [False]])))
    least_s = 2 * own.edge_s + own.shortest_inside_s
    ends = edges.reshape(-1, 2)
    return [(int(a), int(b)) for a, b in ends if binned.t_s[b - 1] - binned.t_s[a] > least_s]


def run_cells(binned: BinnedLog, runs: list[tuple[int, int]]) -> I64:
    """By row (n,): 2k + 1 inside of interval k, 2k + 2 about its ends, 0 elsewhere."""
    cells, t_s, edge_s = np.zeros(len(binned), np.int64), binned.t_s, binned.settings.slip.edge_s
    for k, (a, b) in enumerate(runs):
        first_s, last_s = t_s[a], t_s[b - 1]
        cells[(t_s > first_s - edge_s) & (t_s < last_s + edge_s)] = 2 * k + 2
        cells[(t_s > first_s + edge_s) & (t_s < last_s - edge_s)] = 2 * k + 1
    return cells


def estimate_losses(problem: Problem, fit: Fit, cells: I64, n: int) -> tuple[F64, F64]:
    """Losses (n, 2) of α and α_yaw in each cell beyond the model's, with covariance (n, 2, 2).

    0 is as the model, 1 none left. ``cells`` (rows,) are numbered below ``n``; 0 is no cell. Least squares on
    the innovations of a filter with calm disturbances.
    """
    targets = NO_TARGETS._replace(cells=cells, n_cells=n)
    noise = calm_or_same(fit.noise, problem.settings.diffusion)
    output = problem.filtered(fit.extension, noise, targets, keep=True)
    flat, e = output.sensitivities.reshape(-1, 2 * n), output.innovations.ravel()
    G = flat.T @ flat + problem.settings.slip.least_information * np.eye(2 * n)
    V = np.linalg.inv(G)
    loss = V @ (flat.T @ e)
    left = np.square(e - flat @ loss).reshape(-1, 3).mean(axis=1)
    V *= max(float(left @ (cells > 0)) / max(int(np.sum(cells > 0)), 1), 1.0)
    pairs = np.arange(n)[:, None] + np.array([0, n])
    return loss[pairs], V[pairs[:, :, None], pairs[:, None, :]]
