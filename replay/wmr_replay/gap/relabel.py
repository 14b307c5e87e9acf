"""Contact modes taken for other ones: what an identifier calls slipping or skidding may be a missing effect."""

import numpy as np

from wmr_replay.gap.drive import Drive
from wmr_replay.gap.field import SLIPPING
from wmr_replay.gap.problem import Problem, calmed
from wmr_replay.gap.refit import Fit
from wmr_replay.gap.sensitivity import NOTHING
from wmr_schemas.arrays import F64, I64, NS_PER_S, Bool
from wmr_schemas.signals import ModeTrack

EDGE_S, SHORTEST_S = 0.4, 0.3
LEAST_APART, SDS = 0.12, 3.0
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
    """The rows (n,) of slipping intervals that leave clearly more traction than the base model's slipping does.

    The loss of α and α_yaw in each interval, about .4 s at its ends left to itself, by least squares on the
    innovations of a filter that takes slipping for ideal and disturbances for calm.
    """
    drive, base = problem.drive, fit.extension.base
    runs = slipping_runs(drive)
    if not runs:
        return np.zeros(len(drive), bool)
    loss, sd = losses(problem, fit, runs)
    slipping = 1.0 - max(base.slip_share, base.slip_share_yaw)
    other = loss + SDS * sd < slipping - LEAST_APART
    rows = np.zeros(len(drive), bool)
    for (a, b), unlike in zip(runs, other, strict=True):
        rows[a:b] = unlike
    return rows


def slipping_runs(drive: Drive) -> list[tuple[int, int]]:
    """Rows [a, b) of each slipping interval that is long enough to have an inside."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], drive.mode == SLIPPING, [False]])))
    ends = edges.reshape(-1, 2)
    return [(int(a), int(b)) for a, b in ends if drive.t_s[b - 1] - drive.t_s[a] > 2 * EDGE_S + SHORTEST_S]


def losses(problem: Problem, fit: Fit, runs: list[tuple[int, int]]) -> tuple[F64, F64]:
    """Loss of traction inside each run (r,), 0 as rolling and 1 none left, and its standard deviation."""
    ideal = problem.labelled(without_rows(problem.drive, problem.drive.mode == SLIPPING))
    n, cells = len(runs), cells_of(ideal.drive, runs)
    noise = calmed(fit.noise) or fit.noise
    wanted = NOTHING._replace(cells=cells, n_cells=2 * n + 1)
    passed = ideal.passed(fit.extension, noise, wanted, keep=True)
    both = passed.sensitivities[:, :, : 2 * n] + passed.sensitivities[:, :, 2 * n + 1 : 4 * n + 1]
    flat, e = both.reshape(-1, 2 * n), passed.innovations.ravel()
    G = flat.T @ flat
    seen = np.diag(G) > LEAST_INFORMATION
    V = np.linalg.pinv(G, rcond=1e-10)
    loss = V @ (flat.T @ e)
    left = np.square(e - flat @ loss).reshape(-1, 3).sum(axis=1)
    inside = cells < 2 * n
    scale = max(float(left[inside].mean()) / 3, 1.0)
    sd = np.where(seen, np.sqrt(np.maximum(np.diag(V), 0.0) * scale), np.inf)
    return loss[:n], sd[:n]


def cells_of(drive: Drive, runs: list[tuple[int, int]]) -> I64:
    """By row (n,): k inside of run k, r + k about its ends, 2r elsewhere."""
    r = len(runs)
    cells = np.full(len(drive), 2 * r, np.int64)
    t_s = drive.t_s
    for k, (a, b) in enumerate(runs):
        about = (t_s > t_s[a] - EDGE_S) & (t_s < t_s[b - 1] + EDGE_S)
        within = (t_s > t_s[a] + EDGE_S) & (t_s < t_s[b - 1] - EDGE_S)
        cells[about] = r + k
        cells[within] = k
    return cells
