"""The covariance behind the reported intervals: noise, and what an answer takes for granted.

    V + m mᵀ + c cᵀ + F

V is robust over blocks, beside the tyres' sideslip. m is how far the sizes move where no row has a mode,
c where the tyres creep by what the log says of it. One log shows such a move once, so that its square
is the estimate of its variance. F is what the forms leave open: the speed over which a friction changes its
sign, the share of a threshold over which a dead zone or a limit of the torques sets in.

An effect whose size may be 0 by that is no finding, however likely it makes the log.
"""

from functools import lru_cache

import numpy as np
from scipy.special import fdtrc

from wmr_replay.gap.estimation.covariance import robust_covariance, time_blocks
from wmr_replay.gap.estimation.own_form import spread_of_forms
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.without_labels import step_without_labels
from wmr_replay.gap.evidence.significance import beside_sideslip, size_columns
from wmr_replay.gap.model.candidates import declaration_of
from wmr_schemas.arrays import F64


@lru_cache(maxsize=4)
def interval_covariance(problem: Problem, fit: Fit) -> tuple[F64, int]:
    """Covariance (q, q) of the fitted parameters, and the number of blocks that it rests on."""
    creep, V = beside_sideslip(problem, fit)
    modes = step_without_labels(problem, fit)
    blocks = time_blocks(problem, problem.settings.significance.block_s)
    moved = np.outer(modes, modes) + np.outer(creep, creep) + spread_of_forms(fit)
    return V + moved, int(blocks.max()) + 1


def may_be_nothing(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether the sizes θ (k,) of an effect of the model ``fit`` are 0 within their 95 % region,
    θᵀ V⁻¹ θ/k ~ F(k, blocks − q).
    """
    V, n_blocks = interval_covariance(problem, fit)
    size, own = size_columns(fit, name), problem.settings.report
    theta = fit.values[size]
    distance = float(theta @ np.linalg.pinv(V[np.ix_(size, size)], hermitian=True) @ theta) / len(size)
    p = float(fdtrc(len(size), max(n_blocks - len(V), own.least_blocks), distance))
    return p > 2 * own.interval_tail


def least_size(problem: Problem, fit: Fit, name: str, in_sd: float) -> float:
    """The size of an effect, of two components their length, less ``in_sd`` of its standard deviations,
    robust over blocks of 2 s; of how a pose is mounted, those of its interval: tyres that creep move it, too.
    """
    own = size_columns(fit, name)
    of_pose = declaration_of(name).acts_on == "pose"
    V = (interval_covariance if of_pose else robust_covariance)(problem, fit)[0][np.ix_(own, own)]
    values = fit.values[own]
    size = float(np.hypot.reduce(values.tolist()))
    along = values / max(size, 1e-12)
    return size - in_sd * float(np.sqrt(max(float(along @ V @ along), 0.0)))
