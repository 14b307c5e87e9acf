"""Leads of a scan, and the normal equations that they come from."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.refit import clipped
from wmr_schemas.arrays import F64


@dataclass(frozen=True)
class Lead:
    """A candidate that promises to lower the deviance by ``gain``, with its best parameters."""

    name: str
    parameters: dict[str, float]
    gain: float
    tried: int


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations over the fitted rows: s (p,), G (p, p)."""

    s: F64
    G: F64

    def gain(self, columns: list[int]) -> tuple[float, F64]:
        """λ and δ of a group of columns."""
        G, s = self.G[np.ix_(columns, columns)], self.s[columns]
        if np.any(np.diag(G) <= 1e-9):
            return 0.0, np.zeros(len(columns))
        delta = np.linalg.solve(G + 1e-12 * np.diag(np.diag(G)), s)
        return float(s @ delta), np.asarray(delta)


def normal_equations(psi: F64, e: F64, nuisance: F64 | None) -> Normal:
    """From (n, 3, p) and (n, 3); outliers are clipped, the nuisance is projected out."""
    flat, residual = psi.reshape(-1, psi.shape[2]), clipped(e).ravel()
    s, G = flat.T @ residual, flat.T @ flat
    if nuisance is None or not nuisance.shape[2]:
        return Normal(s, G)
    other = nuisance.reshape(-1, nuisance.shape[2])
    A, B = other.T @ other, flat.T @ other
    A = A + 1e-9 * np.diag(np.diag(A)) + 1e-12 * np.eye(len(A))
    return Normal(s - B @ np.linalg.solve(A, other.T @ residual), G - B @ np.linalg.solve(A, B.T))


def projected(psi: F64, nuisance: F64) -> F64:
    """Ψ (3n, p) of (n, 3, p), less what the nuisance (n, 3, q) explains of it."""
    flat = psi.reshape(-1, psi.shape[2])
    if not nuisance.shape[2]:
        return flat
    other = nuisance.reshape(-1, nuisance.shape[2])
    return np.asarray(flat - other @ np.linalg.lstsq(other, flat, rcond=1e-8)[0])


def score_of(lead: Lead) -> float:
    """Gain less what its freedom costs."""
    return float(lead.gain - 8 * len(lead.parameters) - 2 * np.log(lead.tried))
