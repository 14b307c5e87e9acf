"""Where the fit of a candidate starts, and the search for edges in time and space."""

from dataclasses import replace
from itertools import product

import numpy as np

from wmr_replay.gap.estimation.diffusion import calm_or_same, with_calm_lateral
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, gauss_newton, with_values
from wmr_replay.gap.model.candidates import candidate_of, is_place
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import ScoredCandidate


def best_start(problem: Problem, current: Fit, scored: ScoredCandidate) -> ScoredCandidate:
    """The candidate at the likeliest of its starts.

    An effect that declares starts has several, since its slope at no effect says little about its size.
    """
    candidate, extension = candidate_of(scored.name), current.extension
    key, further = candidate.free[0], candidate.declaration.search.starts
    if not further:
        return scored
    calm = with_calm_lateral(current.noise, problem.settings.diffusion)
    values = (scored.parameters[key], *further)
    starts = [replace(scored, parameters={key: value}) for value in values]
    return min(
        starts,
        key=lambda start: problem.deviance(extension.with_effect(start.name, start.parameters), calm),
    )


def search_edges(problem: Problem, fit: Fit, name: str) -> Extension:
    """Edges in time and space by a search along each of them, in ever shorter steps.

    Between the edges of two fits the likelihood is flat, so slopes do not lead there. The disturbances are
    held calm, so that they do not explain what a wrong edge leaves.
    """
    keys = [key for key in candidate_of(name).free if is_place(name, key)]
    if not keys:
        return fit.extension
    settings = problem.settings
    noise, gain = calm_or_same(fit.noise, settings.diffusion), settings.candidates.edge_gain
    for step in settings.candidates.edge_steps:
        here = gauss_newton(problem, fit.extension, noise, settings.budget.last_steps)
        extension, deviance = here.extension, here.deviance
        for key, by in product(keys, (step, -step)):
            new = shifted(extension, name, key, by)
            while (new_deviance := problem.deviance(new, noise)) < deviance - gain:
                extension, deviance = new, new_deviance
                new = shifted(extension, name, key, by)
        fit = replace(fit, extension=extension)
    return fit.extension


def shifted(extension: Extension, name: str, key: str, by: float) -> Extension:
    """The extension with one parameter of an effect changed by ``by``."""
    return with_values(extension, ((name, key),), np.array([extension.effects[name][key] + by]))
