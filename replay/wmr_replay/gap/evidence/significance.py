"""How sure an effect is, and how like the others: block-robust covariance, Wald test, R²."""

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as fisher

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, inverse_information
from wmr_replay.gap.model.candidates import LOCAL, candidate_of, is_place
from wmr_schemas.arrays import F64, Bool

BLOCK_S, LEVEL = 2.0, 0.01
LEAST_MOVED = 0.05


def sizes_of(fit: Fit, name: str) -> list[int]:
    """Places of an effect's parameters that say how large it is, and not where."""
    return [j for j, (owner, key) in enumerate(fit.keys) if owner == name and not is_place(name, key)]


def likeness(problem: Problem, fit: Fit, name: str) -> float:
    """Share of the effect's sensitivity that the other effects explain, R²."""
    own = sizes_of(fit, name)
    others = [j for j, (n, _) in enumerate(fit.keys) if n != name]
    if not others:
        return 0.0
    flat = fit.psi[problem.train].reshape(-1, len(fit.keys))
    shares = []
    for j in own:
        left = flat[:, j] - flat[:, others] @ np.linalg.lstsq(flat[:, others], flat[:, j], rcond=1e-8)[0]
        shares.append(1 - float(left @ left) / max(float(flat[:, j] @ flat[:, j]), 1e-30))
    return max(shares)


def robust_p(problem: Problem, fit: Fit, name: str) -> float:
    """Block-robust Wald test (blocks of 2 s) of the effect's size. Where the size is no distance from the
    base model, the likelihood ratio stands alone; where the blocks that tell of it are few, the test is the
    plain one.
    """
    if not candidate_of(name).declaration.zero_is_absent:
        return 0.0
    size = sizes_of(fit, name)
    values = fit.values[size]
    V, n_blocks = covariance(problem, fit)
    if name in LOCAL:
        V = inverse_information(fit.psi[problem.train])
    wald = float(values @ np.linalg.lstsq(V[np.ix_(size, size)], values, rcond=1e-10)[0]) / len(size)
    if name in LOCAL:
        return float(chi2.sf(wald * len(size), len(size)))
    return float(fisher.sf(wald, len(size), n_blocks - len(size)))


def covariance(problem: Problem, fit: Fit) -> tuple[F64, int]:
    """Covariance (q, q) of the fitted parameters, robust to what colours the innovations over blocks of 2 s:
    I⁻¹ (Σ_b s_b s_bᵀ) I⁻¹ with the block scores s_b; its diagonal is never below I⁻¹. And how many blocks.
    """
    psi = fit.psi[problem.train]
    e = np.clip(fit.innovations[problem.train], -6, 6)
    block = np.unique(problem.drive.t_s[problem.train] // BLOCK_S, return_inverse=True)[1]
    scores = np.zeros((block.max() + 1, psi.shape[2]))
    np.add.at(scores, block, np.einsum("ijk,ij->ik", psi, e))
    inverse = inverse_information(psi)
    sandwich = inverse @ (scores.T @ scores) @ inverse
    return np.where(np.eye(len(inverse), dtype=bool), np.maximum(sandwich, inverse), sandwich), len(scores)


def touched(problem: Problem, fit: Fit, name: str) -> Bool:
    """The fitted rows (n,) whose innovations an effect's size moves."""
    own = sizes_of(fit, name)
    moved = np.square(fit.psi[:, :, own]).sum(axis=(1, 2))
    return np.asarray((moved > LEAST_MOVED * moved.mean()) & problem.train)
