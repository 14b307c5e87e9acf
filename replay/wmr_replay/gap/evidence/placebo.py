"""Placebo gate: would the library explain as much of logs in which nothing is missing?

Such logs are the base model's with the fitted disturbance. Their innovations are those that remain with the
effect in the model, in blocks of 2 s with random signs, which keeps their colour (the wild bootstrap of Liu,
1988, by blocks). To first order the scores of a log are s = Ψᵀe, so no log is filtered again. A limit or a
dead zone that takes away most of a log's torques is far from the first order: of the log itself it explains
what its fit does.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.covariance import time_blocks
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, clipped, evaluate
from wmr_replay.gap.scan.library import LibraryColumns
from wmr_replay.gap.scan.score import NormalEquations, penalised_gain, projected
from wmr_replay.gap.scan.terms import TermColumns
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX, WITHHOLDING


def placebo_p(problem: Problem, rest: Fit, current: Fit, name: str, seed: int = 0) -> float:
    """Share of placebo logs of which the best candidate explains as much as ``name`` does of the log.

    ``rest`` is the model without the effect, ``current`` the one with it. The share counts the log itself,
    (1 + #{best ≥ observed})/(1 + draws), so that its least value is 0.01.
    """
    settings, train = problem.settings, problem.train
    kind = TermColumns if name.startswith(UNNAMED_PREFIX) else LibraryColumns
    columns = kind.of(problem.binned, rest.extension)
    here = evaluate(problem, rest.extension, current.noise)
    output = problem.filtered(rest.extension, current.noise, columns.targets, keep=True)
    output = columns.own.joined_to(output, problem, current.noise)
    psi = projected(output.sensitivities[train], here.psi[train])
    G = psi.T @ psi
    e = clipped(output.innovations[train], settings.refit)
    observed = columns.scores(NormalEquations(psi.T @ e.ravel(), G))
    own = [one for one in observed if one.name == name]
    if name in WITHHOLDING:
        own += [replace(one, gain=here.deviance - current.deviance) for one in own]
    observed_gain = max((penalised_gain(one, settings.scan) for one in own), default=-np.inf)
    scores = block_scores(problem, psi, clipped(current.innovations[train], settings.refit))
    draws = settings.placebo.draws
    signs = np.random.default_rng(seed).choice((-1.0, 1.0), (draws, len(scores)))
    placebos = (columns.scores(NormalEquations(s, G)) for s in signs @ scores)
    best = [max(penalised_gain(one, settings.scan) for one in scored) for scored in placebos]
    return float((1 + np.sum(np.array(best) >= observed_gain)) / (1 + draws))


def block_scores(problem: Problem, psi: F64, e: F64) -> F64:
    """Ψᵀe of each block of 2 s, (blocks, p)."""
    block = time_blocks(problem, problem.settings.placebo.block_s)
    starts = np.flatnonzero(np.diff(block, prepend=-1))
    return np.asarray(
        np.add.reduceat((psi * e.reshape(-1, 1)).reshape(len(block), 3, -1).sum(axis=1), starts)
    )
