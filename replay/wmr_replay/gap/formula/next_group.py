"""The next group of a formula: the best of those that promise most, fitted with their disturbances."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import evaluate, fit_model
from wmr_replay.gap.formula.groups import Tried
from wmr_replay.gap.formula.scores import ScoredGroup, excess
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.stated import Formula, best_of, is_sound
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.terms import COEFFICIENT


def with_next(problem: Problem, formula: Formula, tried: Tried) -> Formula | None:
    """The formula with the best further group; None where a scan promises nothing.

    As a slow disturbance explains a lasting effect, the best groups of a scan with calm disturbances are
    fitted beside the best of the fitted ones. Neither is the disturbance that is left beside the right group:
    so a first group is chosen once more at the one that the best fit leaves.
    """
    own, current = problem.settings, formula.fit
    noises = [*filter(None, (current.noise, calmed(current.noise, own.diffusion)))]
    first = fitted_of(problem, formula, promising(problem, formula, tried, noises), own.formula.most_fitted)
    best = best_of(problem, first)
    if best is None or formula.groups or not tried.grids:
        return best
    if any(alike(best.fit.noise, noise, own.formula) for noise in noises):
        return best
    known = {one.groups[-1].kind_of_terms for one in first}
    again = promising(problem, formula, tried, [best.fit.noise])
    new = [one for one in again if one.group.kind_of_terms not in known]
    return best_of(problem, [best, *fitted_of(problem, formula, new, own.formula.most_again)])


def alike(one: Diffusion, other: Diffusion, own: FormulaSettings) -> bool:
    """Whether two disturbances are about as large, on both channels."""
    ratios = np.array(one.densities_mps2_rthz) / np.array(other.densities_mps2_rthz)
    return bool(np.all(2 * np.abs(np.log(ratios)) < np.log(own.something_left)))


def promising(
    problem: Problem, formula: Formula, tried: Tried, noises: Iterable[Diffusion]
) -> list[ScoredGroup]:
    """The groups that promise most, their numbers refined: the best at each of some disturbances in turn.

    What a slow disturbance leaves and what a calm one does are not of one scale.
    """
    by_noise = [promising_at(problem, formula, tried, noise) for noise in noises]
    in_turn = [one for turn in zip_longest(*by_noise) for one in turn if one is not None]
    return [*{one.group.names: one for one in reversed(in_turn)}.values()][::-1]


def promising_at(problem: Problem, formula: Formula, tried: Tried, noise: Diffusion) -> list[ScoredGroup]:
    """The groups that promise most at one disturbance, the best first."""
    own, current = problem.settings.candidates, formula.fit
    here = current if noise is current.noise else evaluate(problem, current.extension, noise)
    finer = [refined(problem, here, one) for one in winners(problem, here, tried)]
    finer.sort(key=lambda one: -excess(problem, one))
    least = own.least_score_later if formula.groups else own.least_score
    enough = max(least, own.promising * max((excess(problem, one) for one in finer), default=0.0))
    return [one for one in finer if excess(problem, one) > enough]


def fitted_of(problem: Problem, formula: Formula, some: Sequence[ScoredGroup], most: int) -> list[Formula]:
    """The formula with each of the first ones, where it is sound."""
    longer = (extended(problem, formula, one) for one in some[:most])
    return [one for one in longer if is_sound(problem, one)]


def extended(problem: Problem, formula: Formula, scored: ScoredGroup) -> Formula:
    """The formula with one group more, fitted with its diffusion.

    The numbers of a shape are found again at the disturbance that is left beside it.
    """
    longer = fitted_with(problem, formula, scored)
    if not scored.group.shape:
        return longer
    there = evaluate(problem, formula.fit.extension, longer.fit.noise)
    finer = refined(problem, there, scored)
    if finer.group.names == scored.group.names:
        return longer
    again = fitted_with(problem, replace(formula, fit=there), finer)
    return min(longer, again, key=lambda one: one.fit.deviance)


def fitted_with(problem: Problem, formula: Formula, scored: ScoredGroup) -> Formula:
    """The formula with one group more, fitted with its diffusion."""
    extension = formula.fit.extension
    for name, value in zip(scored.group.names, scored.coefficients, strict=True):
        extension = extension.with_effect(name, {COEFFICIENT: value})
    budget = problem.settings.budget
    fit = fit_model(problem, extension, formula.fit.noise, budget.best_diffusion, budget.last_steps)
    return replace(formula, fit=fit, groups=(*formula.groups, scored.group))
