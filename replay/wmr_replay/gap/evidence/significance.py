"""Significance gate: block-robust Wald test of an effect's size, and its correlation with other effects."""

import numpy as np
from scipy.special import chdtrc, fdtrc

from wmr_replay.gap.estimation.covariance import (
    inverse_information,
    robust_covariance,
    sandwich,
    time_blocks,
)
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.sideslip import creep_slope, known_creep, most_compliance
from wmr_replay.gap.model.candidates import LOCAL, candidate_of, is_place
from wmr_schemas.arrays import F64, Bool

LEVER_ARM = "pose_lever_arm"


def size_columns(fit: Fit, name: str) -> list[int]:
    """Columns of an effect's parameters that make it one and say how large it is, without those that say when
    and where.
    """
    absent = candidate_of(name).absent
    return [
        j
        for j, (owner, key) in enumerate(fit.keys)
        if owner == name and key not in absent and not is_place(name, key)
    ]


def correlation(problem: Problem, fit: Fit, name: str) -> float:
    """R² in [0, 1]: the share of the effect's sensitivity that the other effects explain."""
    own = size_columns(fit, name)
    others = [j for j, (n, _) in enumerate(fit.keys) if n != name]
    if not others:
        return 0.0
    flat = fit.psi[problem.train].reshape(-1, len(fit.keys))
    shares = []
    for j in own:
        left = flat[:, j] - flat[:, others] @ np.linalg.lstsq(flat[:, others], flat[:, j], rcond=1e-8)[0]
        shares.append(1 - float(left @ left) / max(float(flat[:, j] @ flat[:, j]), 1e-30))
    return max(shares)


def wald_p(problem: Problem, fit: Fit, name: str) -> float:
    """P value of the Wald test that the effect's size is 0, robust over blocks of 2 s.

    Returns 0 where the size is no distance from the base model, so that the likelihood ratio decides alone.
    A local effect is seen in few blocks; its test is the plain one. A lever arm is tested beside the tyres'
    sideslip, unless it lies ahead of an axle that does not creep: a sideslip moves the pose the other way.
    """
    if not candidate_of(name).declaration.zero_is_absent:
        return 0.0
    size = size_columns(fit, name)
    values = fit.values[size]
    V, n_blocks = robust_covariance(problem, fit)
    if name in LOCAL:
        V = inverse_information(fit.psi[problem.train])
    if name == LEVER_ARM and (fit.values[size[0]] < 0.0 or known_creep(fit.extension) > 0.0):
        moved, V = beside_sideslip(problem, fit)
        values = values + moved[size]
    wald = float(values @ np.linalg.lstsq(V[np.ix_(size, size)], values, rcond=1e-10)[0]) / len(size)
    if name in LOCAL:
        return float(chdtrc(len(size), wald * len(size)))
    return float(fdtrc(len(size), n_blocks - len(size), wald))


def beside_sideslip(problem: Problem, fit: Fit) -> tuple[F64, F64]:
    """How far the parameters move (q,) where the tyres creep sideways by an unknown compliance besides, and
    their covariance (q, q), robust over blocks.

    Both move the pose sideways in a turn, by x·yaw_rate and by −compliance·v·yaw_rate. A compliance is known
    to half the largest one that is a sideslip; beyond that an arm is an arm at any speed.
    """
    slope = creep_slope(problem, fit.extension, fit.noise)[:, :, None]
    return beside(problem, fit, slope, np.array([most_compliance(problem, fit.extension) / 2]))


def beside(problem: Problem, fit: Fit, slopes: F64, known_to: F64) -> tuple[F64, F64]:
    """How far the parameters move (q,) in one step beside k unknowns besides, of the sensitivities ``slopes``
    (n, 3, k), and their covariance (q, q), robust over blocks. Each unknown is 0 to the standard deviations
    ``known_to`` (k,): one row more says so.
    """
    train, own, (q, k) = problem.train, problem.settings.significance, (len(fit.keys), len(known_to))
    known = np.zeros((k, 3, q + k))
    known[:, 0, q:] = np.diag(1 / known_to)
    psi = np.concatenate([np.concatenate([fit.psi, slopes], axis=2)[train], known])
    e = np.clip(fit.innovations[train], -own.clip_sd, own.clip_sd)
    e = np.concatenate([e, np.zeros((k, 3))])
    block = time_blocks(problem, own.block_s)
    block = np.append(block, block.max() + 1 + np.arange(k))
    step = inverse_information(psi) @ np.einsum("ijk,ij->k", psi, e)
    return step[:q], sandwich(psi, e - psi @ step, block)[:q, :q]


def rows_that_show(problem: Problem, fit: Fit, name: str) -> Bool:
    """The fitted rows (n,) whose innovations an effect's size moves."""
    moved = np.square(fit.psi[:, :, size_columns(fit, name)]).sum(axis=(1, 2))
    least = problem.settings.significance.least_moved * moved.mean()
    return np.asarray((moved > least) & problem.train)
