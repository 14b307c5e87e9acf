"""How much each candidate would explain, to first order."""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.wheel_speed.candidates import absent, parameters_of
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import Fit, View, White, inverse
from wmr_replay.gap.wheel_speed.predict import Problem, from_start
from wmr_schemas.arrays import F64
from wmr_schemas.effects import EffectDeclaration

UNSEEN = 1e-6
"""Share of a column's square that the model's others leave of it; below, they are the same. Numerics."""


class Score(NamedTuple):
    """A candidate: the drop of −2 log likelihood that its best size would bring, that size, and the
    information about its parameters with the model's others projected out, (k, k).
    """

    name: str
    gain: float
    start: dict[str, float]
    information: F64


def scan(problem: Problem, current: Fit, candidates: tuple[EffectDeclaration, ...]) -> tuple[Score, ...]:
    """The scores of ``candidates`` beside the effects of ``current``."""
    view = View.of(problem, current.noises)
    errors = view.errors(current.values)
    own = view.columns(current.values, current.parameters)
    white = view.rows(errors, own)
    found = []
    for effect in candidates:
        if effect.name in current.values:
            continue
        if effect.search.grid:
            found.append(on_grid(problem, view, white, errors, current.values, effect))
        else:
            found.append(by_slope(view, white, errors, current.values, effect))
    return tuple(sorted(found, key=lambda score: -score.gain))


def by_slope(view: View, white: White, errors: F64, values: Values, effect: EffectDeclaration) -> Score:
    """From the columns of an effect at size 0."""
    which = parameters_of(effect.name)
    columns = view.rows(errors, view.columns({**values, effect.name: absent(effect.name)}, which)).columns
    left = columns - white.columns @ (inverse(white.columns.T @ white.columns) @ (white.columns.T @ columns))
    known = (columns**2).sum(axis=0) * UNSEEN < (left**2).sum(axis=0)
    left = np.where(known, left, 0.0)
    information = left.T @ left
    # errors are projected too: at the optimum of the others they are free of them
    size = inverse(information) @ (left.T @ white.errors)
    start = {}
    for one, value in zip(which, size, strict=True):
        low, high = one.bounds
        start[one.key] = float(np.clip(value, low, high))
    clipped = np.array(list(start.values()))
    gain = float(2 * clipped @ (left.T @ white.errors) - clipped @ information @ clipped)
    return Score(effect.name, gain, start, information)


def on_grid(
    problem: Problem, view: View, white: White, errors: F64, values: Values, effect: EffectDeclaration
) -> Score:
    """The best of the values at which an effect is tried."""
    (key,) = effect.parameters
    before, best = (
        problem.predicted(values),
        Score(effect.name, 0.0, {key: effect.search.grid[0]}, np.zeros((1, 1))),
    )
    projector = inverse(white.columns.T @ white.columns) @ white.columns.T
    for value in effect.search.grid:
        change = problem.predicted({**values, effect.name: {key: value}}) - before
        blocks = view.white(from_start(problem.bins.blocks(change), problem.bins)[:, None])
        column = view.rows(errors, blocks).columns[:, 0]
        left = column - white.columns @ (projector @ column)
        gain = float(2 * left @ white.errors - left @ left)
        if gain > best.gain:
            best = Score(effect.name, gain, {key: value}, np.array([[left @ left / value**2]]))
    return best
