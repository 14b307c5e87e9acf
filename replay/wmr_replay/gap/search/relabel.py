"""Contact modes taken for other ones: what an identifier calls slipping or skidding may be a missing
effect.
"""

import numpy as np

from wmr_replay.gap.estimation.binned_log import Drive
from wmr_replay.gap.estimation.problem import Problem, calmed
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.sensitivity import NOTHING
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.dynamics import Base
from wmr_replay.gap.model.extension import weight
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack

EDGE_S, SHORTEST_S = 0.4, 0.3
LOSS_SD, FAR = np.array([0.07, 0.15]), 6.0
"""How far slipping's own losses of α and α_yaw lie from quasi-steady ones; how far is clear."""
INSIDE, HALF = 0.9, 0.5
LEAST_INFORMATION = 1e-2


def without_skid(track: ModeTrack) -> ModeTrack:
    """The same, skidding taken for ideal."""
    return ModeTrack(track.t_ns, (track.mode - track.mode % 2).astype(np.int8))


def with_rows(drive: Drive, rows: Bool, mode: float) -> ModeTrack:
    """The drive's modes, those of the ``rows`` (n,) taken for another one."""
    changed = np.where(rows, mode, drive.mode).astype(np.int8)
    return ModeTrack(drive.start_ns + np.rint(drive.t_s * NS_PER_S).astype(np.int64), changed)


def unlike_slipping(problem: Problem, fit: Fit) -> Bool:
    """The rows (n,) of intervals called slipping that leave clearly more traction than the base model's
    slipping does; .4 s about an interval's ends are left to themselves.
    """
    drive = problem.drive
    runs = slipping_runs(drive)
    rows = np.zeros(len(drive), bool)
    if runs:
        ideal = problem.labelled(with_rows(drive, drive.mode == ContactMode.SLIPPING, ContactMode.IDEAL))
        gentler = leaves_more(
            fit.extension.base, *losses(ideal, fit, run_cells(drive, runs), 2 * len(runs) + 1)
        )
        for k, (a, b) in enumerate(runs):
            rows[a:b] = gentler[2 * k + 1]
    return rows


def leaves_more(base: Base, loss: F64, covariance: F64) -> Bool:
    """Whether losses (c, 2) of α and α_yaw with their covariance (c, 2, 2) are clearly below slipping's.

    A distance d with dᵀ C⁻¹ d of 6 or more, C the covariance and what quasi-steady losses leave out.
    """
    slipping = 1.0 - np.array([base.slip_share, base.slip_share_yaw])
    apart = slipping - loss
    weighed = np.linalg.solve(covariance + np.diag(LOSS_SD**2), apart[..., None])[..., 0]
    clear = np.einsum("ci,ci->c", apart, weighed) > FAR
    return np.asarray(clear & (weighed @ slipping > 0))


def like_slipping(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether a loss of traction in the model ``fit`` may be slipping that an identifier did not call so:
    what it leaves is not clearly more than the base model's slipping leaves, as it was fitted or by the
    channels.
    """
    if name not in LOCAL or not problem.drive.identified:
        return False
    base, loss = fit.extension.base, fit.extension.effects[name]["loss"]
    acts = weight(name, fit.extension.effects[name], problem.drive)
    cells = np.where(acts > INSIDE, 1, np.where(acts > 1 - INSIDE, 2, 0))
    further, covariance = losses(problem, fit, cells, 3)
    by_channel = leaves_more(base, 1.0 - (1.0 - loss) * (1.0 - further), (1.0 - loss) ** 2 * covariance)[1]
    return not (by_channel and leaves_more(base, np.full((1, 2), loss), np.zeros((1, 2, 2)))[0])


def no_other_than_slipping(problem: Problem, fit: Fit) -> Bool:
    """The rows (n,) in which a loss of traction in the model ``fit`` may be slipping, and acts."""
    rows = np.zeros(len(problem.drive), bool)
    for name, parameters in fit.extension.effects.items():
        if like_slipping(problem, fit, name):
            rows |= weight(name, parameters, problem.drive) > HALF
    return rows


def slipping_runs(drive: Drive) -> list[tuple[int, int]]:
    """Rows [a, b) of each slipping interval that is long enough to have an inside."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], drive.mode == ContactMode.SLIPPING, [False]])))
    ends = edges.reshape(-1, 2)
    return [(int(a), int(b)) for a, b in ends if drive.t_s[b - 1] - drive.t_s[a] > 2 * EDGE_S + SHORTEST_S]


def run_cells(drive: Drive, runs: list[tuple[int, int]]) -> I64:
    """By row (n,): 2k + 1 inside of interval k, 2k + 2 about its ends, 0 elsewhere."""
    cells, t_s = np.zeros(len(drive), np.int64), drive.t_s
    for k, (a, b) in enumerate(runs):
        cells[(t_s > t_s[a] - EDGE_S) & (t_s < t_s[b - 1] + EDGE_S)] = 2 * k + 2
        cells[inside(drive, a, b)] = 2 * k + 1
    return cells


def inside(drive: Drive, a: int, b: int) -> Bool:
    """The rows (n,) of an interval but for its ends."""
    return np.asarray((drive.t_s > drive.t_s[a] + EDGE_S) & (drive.t_s < drive.t_s[b - 1] - EDGE_S))


def losses(problem: Problem, fit: Fit, cells: I64, n: int) -> tuple[F64, F64]:
    """Losses (n, 2) of α and α_yaw in each cell, 0 as the model and 1 none left, with covariance (n, 2, 2);
    ``cells`` (rows,) are numbered below n, 0 counts as no cell.

    Least squares on the innovations of a filter that takes disturbances for calm.
    """
    wanted = NOTHING._replace(cells=cells, n_cells=n)
    passed = problem.passed(fit.extension, calmed(fit.noise) or fit.noise, wanted, keep=True)
    flat, e = passed.sensitivities.reshape(-1, 2 * n), passed.innovations.ravel()
    G = flat.T @ flat + LEAST_INFORMATION * np.eye(2 * n)
    V = np.linalg.inv(G)
    loss = V @ (flat.T @ e)
    left = np.square(e - flat @ loss).reshape(-1, 3).mean(axis=1)
    V *= max(float(left @ (cells > 0)) / max(int(np.sum(cells > 0)), 1), 1.0)
    pairs = np.arange(n)[:, None] + np.array([0, n])
    return loss[pairs], V[pairs[:, :, None], pairs[:, None, :]]
