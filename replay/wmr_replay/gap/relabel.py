"""Contact modes taken for other ones: what an identifier calls slipping or skidding may be a missing
effect.
"""

import numpy as np

from wmr_replay.gap.drive import Drive
from wmr_replay.gap.field import SLIPPING, Base
from wmr_replay.gap.problem import Problem, calmed
from wmr_replay.gap.refit import Fit
from wmr_replay.gap.sensitivity import NOTHING
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.signals import ModeTrack

EDGE_S, SHORTEST_S, PIECE_S = 0.4, 0.3, 1.0
LEAST_APART, SDS, MOST_ALIKE = 0.12, 3.0, 1 / 3
LEAST_INFORMATION = 1e-9


def without_slip(track: ModeTrack) -> ModeTrack:
    """The same, slipping taken for ideal."""
    return ModeTrack(track.t_ns, (track.mode % 2).astype(np.int8))


def without_skid(track: ModeTrack) -> ModeTrack:
    """The same, skidding taken for ideal."""
    return ModeTrack(track.t_ns, (track.mode - track.mode % 2).astype(np.int8))


def without_rows(drive: Drive, rows: Bool) -> ModeTrack:
    """The drive's modes, those of the ``rows`` (n,) taken for ideal."""
    mode = np.where(rows, 0.0, drive.mode).astype(np.int8)
    return ModeTrack(drive.start_ns + np.rint(drive.t_s * NS_PER_S).astype(np.int64), mode)


def unlike_slipping(problem: Problem, fit: Fit) -> Bool:
    """The rows (n,) of intervals called slipping that leave clearly more traction than the base model's
    slipping does, and in less than a third of their seconds as little.

    The loss of α and α_yaw by least squares on the innovations of a filter that takes slipping for ideal and
    disturbances for calm; .4 s about an interval's ends are left to themselves.
    """
    drive, base = problem.drive, fit.extension.base
    runs = slipping_runs(drive)
    rows = np.zeros(len(drive), bool)
    if not runs:
        return rows
    most = most_loss(base)
    wholes, seconds = run_cells(drive, runs), second_cells(drive, runs)
    loss, sd = losses(problem, fit, wholes)
    unlike = loss + SDS * sd < most
    loss, sd = losses(problem, fit, seconds)
    slips = (loss - sd > most)[seconds]
    for k, (a, b) in enumerate(runs):
        rows[a:b] = unlike[2 * k + 1] and np.mean(slips[a:b]) < MOST_ALIKE
    return rows


def most_loss(base: Base) -> float:
    """The loss of traction up to which an interval is clearly not the base model's slipping."""
    return 1.0 - max(base.slip_share, base.slip_share_yaw) - LEAST_APART


def slipping_runs(drive: Drive) -> list[tuple[int, int]]:
    """Rows [a, b) of each slipping interval that is long enough to have an inside."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], drive.mode == SLIPPING, [False]])))
    ends = edges.reshape(-1, 2)
    return [(int(a), int(b)) for a, b in ends if drive.t_s[b - 1] - drive.t_s[a] > 2 * EDGE_S + SHORTEST_S]


def run_cells(drive: Drive, runs: list[tuple[int, int]]) -> I64:
    """By row (n,): 2k + 1 inside of interval k, 2k + 2 about its ends, 0 elsewhere."""
    cells, t_s = np.zeros(len(drive), np.int64), drive.t_s
    for k, (a, b) in enumerate(runs):
        cells[(t_s > t_s[a] - EDGE_S) & (t_s < t_s[b - 1] + EDGE_S)] = 2 * k + 2
        cells[inside(drive, a, b)] = 2 * k + 1
    return cells


def second_cells(drive: Drive, runs: list[tuple[int, int]]) -> I64:
    """By row (n,): a number for each second inside of an interval, and one for the ends of all; 0
    elsewhere.
    """
    cells, used = (run_cells(drive, runs) > 0).astype(np.int64), 1
    for a, b in runs:
        within = np.flatnonzero(inside(drive, a, b))
        t_s = drive.t_s[within] - drive.t_s[within[0]]
        cells[within] = used + 1 + (t_s / PIECE_S).astype(np.int64)
        used = int(cells.max())
    return cells


def inside(drive: Drive, a: int, b: int) -> Bool:
    """The rows (n,) of an interval but for its ends."""
    return np.asarray((drive.t_s > drive.t_s[a] + EDGE_S) & (drive.t_s < drive.t_s[b - 1] - EDGE_S))


def losses(problem: Problem, fit: Fit, cells: I64) -> tuple[F64, F64]:
    """Loss of traction in each cell (c,), 0 as rolling and 1 none left, with its standard deviation; cell 0
    is not known.
    """
    ideal = problem.labelled(without_rows(problem.drive, problem.drive.mode == SLIPPING))
    n = int(cells.max()) + 1
    wanted = NOTHING._replace(cells=cells, n_cells=n)
    passed = ideal.passed(fit.extension, calmed(fit.noise) or fit.noise, wanted, keep=True)
    both = passed.sensitivities[:, :, 1:n] + passed.sensitivities[:, :, n + 1 :]
    flat, e = both.reshape(-1, n - 1), passed.innovations.ravel()
    G = flat.T @ flat
    V = np.linalg.pinv(G, rcond=1e-10)
    loss = V @ (flat.T @ e)
    left = np.square(e - flat @ loss).reshape(-1, 3).sum(axis=1)
    scale = max(float(left[cells > 0].mean()) / 3, 1.0)
    seen = np.diag(G) > LEAST_INFORMATION
    sd = np.where(seen, np.sqrt(np.maximum(np.diag(V), 0.0) * scale), np.inf)
    return np.concatenate([[0.0], loss]), np.concatenate([[np.inf], sd])
