"""The history of slipping that explains a stretch of a log best, by linear innovations.

With b_c 0 or 1 whether piece c of time slips, the innovations are e − Ψ f(b), f the losses of α and α_yaw in
each piece beyond those at which e and Ψ were computed. The cost |e − Ψ f(b)|² and a price for every change of
b is lowered by setting whole runs of pieces to slipping or not, the best run first.
"""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64, Bool


class Pieces(NamedTuple):
    """Scores s = Ψᵀe (2, m) and G = ΨᵀΨ (2, m, 2, m) of losses in m pieces; the losses (2, m) without and
    with slipping; which pieces (m,) slip, and which of them may change.
    """

    s: F64
    G: F64
    rolling: F64
    slipping: F64
    slips: Bool
    free: Bool


def likeliest_history(pieces: Pieces, change_cost: float) -> Bool:
    """Which pieces (m,) slip at the least cost, from the given history, and from all or none slipping."""
    starts = [pieces.slips, pieces.slips | pieces.free, pieces.slips & ~pieces.free]
    found = [improved(pieces, slips, change_cost) for slips in starts]
    return min(found, key=lambda slips: cost_of_history(pieces, slips, change_cost))


def losses_of(pieces: Pieces, slips: Bool) -> F64:
    """Losses f (2, m); pieces that may not change keep what they have."""
    return np.where(pieces.free, np.where(slips, pieces.slipping, pieces.rolling), 0.0)


def cost_of_history(pieces: Pieces, slips: Bool, change_cost: float) -> float:
    """|e − Ψ f|² − |e|² and the price of the changes."""
    f = losses_of(pieces, slips)
    square = np.einsum("ac,acbd,bd->", f, pieces.G, f) - 2 * np.sum(f * pieces.s)
    return float(square + change_cost * np.sum(slips[1:] != slips[:-1]))


def improved(pieces: Pieces, slips: Bool, change_cost: float) -> Bool:
    """The history with runs of pieces set to slipping or not, while that lowers the cost."""
    for _ in range(len(slips)):
        gains = [(*best_run(pieces, slips, value, change_cost), value) for value in (False, True)]
        change, first, last, value = min(gains)
        if change >= -1e-9:
            break
        slips = slips.copy()
        slips[first:last] = value
    return slips


def best_run(pieces: Pieces, slips: Bool, value: bool, change_cost: float) -> tuple[float, int, int]:
    """The change of the cost, and the run [first, last) that lowers it most when set to ``value``."""
    f, m = losses_of(pieces, slips), len(slips)
    step = losses_of(pieces, np.full(m, value)) - f
    left = pieces.s - np.einsum("acbd,bd->ac", pieces.G, f)
    along = np.concatenate([[0.0], np.cumsum((step * left).sum(axis=0))])
    square = np.zeros((m + 1, m + 1))
    by_piece = np.einsum("ac,acbd,bd->cd", step, pieces.G, step)
    square[1:, 1:] = np.cumsum(np.cumsum(by_piece, axis=0), axis=1)
    diagonal = np.diag(square)
    own = diagonal[:, None] + diagonal - square - square.T
    changes = changes_by_run(slips, value)
    cost = own - 2 * (along - along[:, None]) + change_cost * changes
    fixed = np.concatenate([[0], np.cumsum(~pieces.free)])
    first, last = np.triu_indices(m + 1, 1)
    cost_of_runs = np.where(fixed[last] > fixed[first], np.inf, cost[first, last])
    k = int(np.argmin(cost_of_runs))
    return float(cost_of_runs[k]), int(first[k]), int(last[k])


def changes_by_run(slips: Bool, value: bool) -> I64:
    """How many changes more there are (m + 1, m + 1) with the run [first, last) set to ``value``."""
    m = len(slips)
    differs = np.concatenate([[0], (slips[1:] != slips[:-1]).astype(np.int64), [0]])
    upto = np.concatenate([[0], np.cumsum(differs)])
    before = np.arange(m + 1)
    gone = upto[np.minimum(before + 1, m + 1)] - upto[before][:, None]
    enters = np.concatenate([[False], slips != value])  # the neighbour before run's first piece
    leaves = np.concatenate([slips != value, [False]])
    return np.asarray(enters[:, None].astype(np.int64) + leaves[None, :].astype(np.int64) - gone)
