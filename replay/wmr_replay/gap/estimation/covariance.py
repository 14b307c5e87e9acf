"""Covariance of fitted parameters: inverse information, and the same robust to coloured innovations."""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_schemas.arrays import F64, I64


def inverse_information(psi: F64) -> F64:
    """(ΨᵀΨ)⁻¹ (q, q) of (n, 3, q), as a pseudo-inverse: unseen directions get no variance."""
    flat = psi.reshape(-1, psi.shape[2])
    d = np.sqrt(np.maximum(np.einsum("ij,ij->j", flat, flat), 1e-12))
    return np.asarray(np.linalg.pinv((flat.T @ flat) / np.outer(d, d), rcond=1e-8) / np.outer(d, d))


def time_blocks(problem: Problem, block_s: float) -> I64:
    """The block of ``block_s`` of each fitted row, numbered from 0 without holes."""
    t_s = problem.binned.t_s[problem.train]
    return np.asarray(np.unique(t_s // block_s, return_inverse=True)[1])


def robust_covariance(problem: Problem, fit: Fit) -> tuple[F64, int]:
    """Covariance (q, q) of the fitted parameters, and the number of blocks that it rests on.

    I⁻¹ (Σ_b s_b s_bᵀ) I⁻¹ with I = ΨᵀΨ and the scores s_b of blocks of 2 s, within which innovations may be
    coloured; its diagonal is never below that of I⁻¹. Source: the sandwich of Huber (1967) and White (1982).
    """
    own = problem.settings.significance
    e = np.clip(fit.innovations[problem.train], -own.clip_sd, own.clip_sd)
    block = time_blocks(problem, own.block_s)
    return sandwich(fit.psi[problem.train], e, block), int(block.max()) + 1


def sandwich(psi: F64, e: F64, block: I64) -> F64:
    """The covariance (q, q) of :func:`robust_covariance` from Ψ (n, 3, q), e (n, 3) and the blocks (n,)."""
    scores = np.zeros((int(block.max()) + 1, psi.shape[2]))
    np.add.at(scores, block, np.einsum("ijk,ij->ik", psi, e))
    inverse = inverse_information(psi)
    robust = inverse @ (scores.T @ scores) @ inverse
    return np.where(np.eye(len(inverse), dtype=bool), np.maximum(robust, inverse), robust)
