"""Scores of groups of terms, by sensitivities of one pass of the filter after the other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS
from wmr_replay.gap.formula.groups import Group, without_terms
from wmr_replay.gap.model.dictionary import as_efforts
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import NormalEquations, normal_equations
from wmr_schemas.arrays import F64
from wmr_schemas.terms import COEFFICIENT, Term


@dataclass(frozen=True)
class ScoredGroup:
    """A group that is expected to lower the deviance by ``gain`` at these coefficients."""

    group: Group
    coefficients: tuple[float, ...]
    gain: float


def with_group(extension: Extension, scored: ScoredGroup) -> Extension:
    """The extension with a group at its coefficients."""
    for name, value in zip(scored.group.names, scored.coefficients, strict=True):
        extension = extension.with_effect(name, {COEFFICIENT: value})
    return extension


def log_n(problem: Problem) -> float:
    """BIC's price of one number."""
    return float(np.log(3 * problem.train.sum()))


def excess(problem: Problem, scored: ScoredGroup) -> float:
    """What a group promises beyond its price."""
    return scored.gain - scored.group.price(log_n(problem))


def efforts_of(problem: Problem, at: Fit, terms: Sequence[Term]) -> F64:
    """Changes of the efforts (k, n, 2) that give the terms' accelerations."""
    return np.stack([change for _, change in as_efforts(problem.binned, at.extension.base, terms)])


def sensitivities_to(problem: Problem, at: Fit, efforts: F64) -> tuple[F64, F64]:
    """Sensitivities (n, 3, k) of the innovations to changes of the efforts, and the innovations (n, 3)."""
    output = problem.filtered(at.extension, at.noise, NO_TARGETS._replace(efforts=efforts), keep=True)
    return output.sensitivities, output.innovations


def equations_of(problem: Problem, at: Fit, efforts: F64) -> NormalEquations:
    """The normal equations of such changes over the fitted rows, beside what the model holds."""
    psi, e = sensitivities_to(problem, at, efforts)
    return normal_equations(psi, e, at.psi, problem.settings.refit, problem.train)


def chunked(groups: Sequence[Group], most: int) -> Iterator[list[Group]]:
    """The groups in parts of about ``most`` columns."""
    part: list[Group] = []
    n_columns = 0
    for group in groups:
        part.append(group)
        n_columns += len(group.terms)
        if n_columns >= most:
            yield part
            part, n_columns = [], 0
    if part:
        yield part


def places_in(part: Sequence[Group]) -> Iterator[tuple[Group, list[int]]]:
    """Each group with the places of its columns."""
    first = 0
    for group in part:
        yield group, list(range(first, first + len(group.terms)))
        first += len(group.terms)


def scored_groups(problem: Problem, at: Fit, groups: Sequence[Group]) -> list[ScoredGroup]:
    """The groups that the model does not hold, the best by gain less price first."""
    found = []
    new = without_terms(groups, at.extension.effects)
    for part in chunked(new, problem.settings.formula.chunk):
        terms = [term for group in part for term in group.terms]
        normal = equations_of(problem, at, efforts_of(problem, at, terms))
        for group, places in places_in(part):
            gain, delta = normal.gain(places)
            found.append(ScoredGroup(group, tuple(float(d) for d in delta), gain))
    price = log_n(problem)
    return sorted(found, key=lambda one: one.group.price(price) - one.gain)
