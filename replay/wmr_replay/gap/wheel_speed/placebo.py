"""Placebo gate: how much would the dictionary explain of records in which nothing is missing?

Such records are made of the errors that remain with the term in the model, in clusters of random sign, which
keeps their colour (the wild bootstrap of Liu, 1988, by clusters). To first order the score of a column is
s = Ψᵀe, so that no model is fitted again.
"""

import numpy as np

from wmr_replay.gap.wheel_speed.estimate import Fit, View, White, inverse
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_schemas.arrays import F64


def placebo_p(problem: Problem, before: Fit, after: Fit, columns: F64, observed: float, draws: int) -> float:
    """Share of placebo records whose best column gains as much as ``observed``, itself counted.

    ``columns`` (3, c, K, B) are the whitened columns of the whole dictionary, at the noise of ``after``.
    """
    view = View.of(problem, after.noises)
    own = view.rows(view.errors(after.values), view.columns(after.values, before.parameters))
    white = view.rows(view.errors(after.values), columns)
    psi = projected(white.columns, own)
    square = np.maximum((psi**2).sum(axis=0), 1e-12)
    scores = np.zeros((int(white.cluster.max(initial=-1)) + 1, psi.shape[1]))
    np.add.at(scores, white.cluster, psi * white.errors[:, None])
    signs = np.random.default_rng(0).choice((-1.0, 1.0), (draws, len(scores)))
    best = ((signs @ scores) ** 2 / square).max(axis=1)
    return float((1 + (best >= observed).sum()) / (1 + draws))


def projected(columns: F64, own: White) -> F64:
    """Columns (m, c) less what the model's own parameters explain of them."""
    if not own.columns.shape[1]:
        return columns
    share = inverse(own.columns.T @ own.columns) @ (own.columns.T @ columns)
    return np.asarray(columns - own.columns @ share)
