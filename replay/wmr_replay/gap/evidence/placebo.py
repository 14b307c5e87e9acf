"""Placebo: would the library explain as much of logs in which nothing is missing?

Such logs are the base model's with the disturbance that was fitted: their innovations are those that remain
with the effect in the model, in blocks of 2 s with random signs (a wild bootstrap, Liu 1988, by blocks), so
that what colours them stays. To first order the scores of a log are s = Ψᵀe, so no log has to be filtered
again.
"""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, clipped, gauss_newton
from wmr_replay.gap.search.leads import Lead, Normal, projected, score_of
from wmr_replay.gap.search.scan import Columns, TermColumns
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX

DRAWS = 99
BLOCK_S = 2.0


def placebo_p(problem: Problem, rest: Fit, current: Fit, name: str, seed: int = 0) -> float:
    """Share of placebo logs of which the best candidate explains as much as the effect ``name`` explains of
    the log itself; ``rest`` is the model without it, ``current`` the one with it.
    """
    kind = TermColumns if name.startswith(UNNAMED_PREFIX) else Columns
    columns = kind.of(problem.drive, rest.extension)
    here = gauss_newton(problem, rest.extension, current.noise, 0)
    passed = problem.passed(rest.extension, current.noise, columns.wanted, keep=True)
    passed = columns.own.joined_to(passed, problem, current.noise)
    train = problem.train
    psi = projected(passed.sensitivities[train], here.psi[train])
    G = psi.T @ psi
    observed = columns.leads(Normal(psi.T @ clipped(passed.innovations[train]).ravel(), G))
    least = max((score_of(lead) for lead in observed if lead.name == name), default=-np.inf)
    scores = block_scores(problem, psi, clipped(current.innovations[train]))
    signs = np.random.default_rng(seed).choice((-1.0, 1.0), (DRAWS, len(scores)))
    best = [score_of(best_of(columns.leads(Normal(s, G)))) for s in signs @ scores]
    return float((1 + np.sum(np.array(best) >= least)) / (1 + DRAWS))


def best_of(leads: list[Lead]) -> Lead:
    """The one that promises most."""
    return max(leads, key=score_of)


def block_scores(problem: Problem, psi: F64, e: F64) -> F64:
    """Ψᵀe of each block of 2 s, (blocks, p)."""
    block = np.unique(problem.drive.t_s[problem.train] // BLOCK_S, return_inverse=True)[1]
    starts = np.flatnonzero(np.diff(block, prepend=-1))
    return np.asarray(
        np.add.reduceat((psi * e.reshape(-1, 1)).reshape(len(block), 3, -1).sum(axis=1), starts)
    )
