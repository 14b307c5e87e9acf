"""Scored candidates, and the normal equations that score them.

With whitened innovations e and sensitivities Ψ, a candidate with parameters δ lowers Σe² by λ = sᵀ G⁻¹ s, s =
Ψᵀe, G = ΨᵀΨ, at its best δ = G⁻¹ s (the score test of Rao, 1948).
"""

from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.refit import clipped
from wmr_replay.gap.settings.filter import RefitSettings
from wmr_replay.gap.settings.scan import ScanSettings
from wmr_schemas.arrays import F64, I64, Bool

PIECE_ROWS = 250
"""Rows of a large product at a time."""


@dataclass(frozen=True)
class ScoredCandidate:
    """A candidate that is expected to lower the deviance by ``gain`` at its best ``parameters``.

    ``n_tried`` counts the times, places or grid points at which it was tried.
    """

    name: str
    parameters: dict[str, float]
    gain: float
    n_tried: float


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """s (p,) and G (p, p) over the fitted rows."""

    s: F64
    G: F64

    def gain(self, columns: list[int]) -> tuple[float, F64]:
        """λ and δ of a group of columns; 0 where one of them is not seen."""
        G, s = self.G[np.ix_(columns, columns)], self.s[columns]
        seen = G.diagonal()
        if seen.min() <= 1e-9:
            return 0.0, np.zeros(len(columns))
        delta = np.linalg.solve(G + 1e-12 * np.diag(seen), s)
        return float(s @ delta), np.asarray(delta)


def normal_equations(
    psi: F64, e: F64, nuisance: F64 | None, settings: RefitSettings, fitted: Bool | None = None
) -> NormalEquations:
    """From Ψ (n, 3, p) and e (n, 3), outliers clipped, with ``nuisance`` (n, 3, q) projected out of both.

    Of the rows that are ``fitted`` (n,), by default of all.
    """
    fitted = np.ones(len(psi), bool) if fitted is None else fitted
    residual = np.zeros_like(e)
    residual[fitted] = clipped(e[fitted], settings)
    s, G = product(psi, residual[:, :, None], fitted)[:, 0], squared(psi, fitted)
    if nuisance is None or not nuisance.shape[2]:
        return NormalEquations(s, G)
    A, B = product(nuisance, nuisance, fitted), product(psi, nuisance, fitted)
    A = A + 1e-9 * np.diag(np.diag(A)) + 1e-12 * np.eye(len(A))
    along = product(nuisance, residual[:, :, None], fitted)[:, 0]
    s, G = s - B @ np.linalg.solve(A, along), G - B @ np.linalg.solve(A, B.T)
    return NormalEquations(s, G)


def product(left: F64, right: F64, rows: Bool) -> F64:
    """Σ leftᵀ right (p, q) of (n, 3, p) and (n, 3, q) over the marked rows, without a copy of them."""
    total = np.zeros((left.shape[2], right.shape[2]))
    for a, b in runs(rows):
        total += left[a:b].reshape(-1, left.shape[2]).T @ right[a:b].reshape(-1, right.shape[2])
    return total


def squared(psi: F64, rows: Bool) -> F64:
    """ΨᵀΨ (p, p) of (n, 3, p) over the marked rows, a few at a time.

    Columns that are 0 in these are left out, most of the cells': they have not begun, or are forgotten.
    """
    total = np.zeros((psi.shape[2], psi.shape[2]))
    for start, end in runs(rows):
        for a in range(start, end, PIECE_ROWS):
            flat = psi[a : min(a + PIECE_ROWS, end)].reshape(-1, psi.shape[2])
            seen = np.flatnonzero((flat != 0.0).any(axis=0))
            part = flat if len(seen) == flat.shape[1] else flat[:, seen]
            total[np.ix_(seen, seen)] += part.T @ part
    return total


def runs(rows: Bool) -> I64:
    """First row of each run of marked rows, and the one after its last (m, 2)."""
    return np.flatnonzero(np.diff(rows, prepend=False, append=False)).reshape(-1, 2)


def projected(psi: F64, nuisance: F64) -> F64:
    """Ψ (3n, p) of (n, 3, p), less what the nuisance (n, 3, q) explains of it."""
    flat = psi.reshape(-1, psi.shape[2])
    if not nuisance.shape[2]:
        return flat
    along = directions(nuisance.reshape(-1, nuisance.shape[2]))
    explained = along @ (along.T @ flat)
    return np.asarray(np.subtract(flat, explained, out=explained))


def directions(columns: F64) -> F64:
    """Orthonormal directions (n, r) that the columns (n, q) span; what is 1e-8 of the largest is none."""
    Q, R = np.linalg.qr(columns)
    turned, sizes, _ = np.linalg.svd(R)
    return np.asarray(Q @ turned[:, sizes > 1e-8 * sizes[0]])


def penalised_gain(scored: ScoredCandidate, settings: ScanSettings) -> float:
    """Gain less the price of its parameters, and 2 ln of the places where it was tried."""
    price = settings.parameter_cost * len(scored.parameters)
    return float(scored.gain - price - 2 * np.log(scored.n_tried))
