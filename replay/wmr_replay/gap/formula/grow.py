"""A formula grown by one group of terms after the other, and pruned of those that it does not need."""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model, gauss_newton
from wmr_replay.gap.evidence.excitation import gain_in_manoeuvres
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.next_group import with_next
from wmr_replay.gap.formula.scores import log_n
from wmr_replay.gap.formula.stated import Formula, held_out, score, worth


def grow(problem: Problem, rest: Fit, tried: Tried) -> Formula:
    """The formula on top of ``rest``; without groups where none explains enough."""
    formula = Formula(rest, rest)
    while len(formula.groups) < problem.settings.formula.most_groups:
        longer = passing(problem, formula, with_next(problem, formula, tried))
        if longer is None:
            break
        parts = longer.groups[-1].parts
        longer = replace(longer, groups=(*longer.groups[:-1], *parts))
        formula = pruned(problem, longer) if len(parts) > 1 else longer
    return pruned(problem, formula)


def passing(problem: Problem, before: Formula, longer: Formula | None) -> Formula | None:
    """The longer formula where its last group explains enough, and the held-out rows too."""
    if longer is None or worth(problem, longer) < score(problem, before) + margin(problem, before, longer):
        return None
    return longer if not before.groups or is_seen_elsewhere(problem, before, longer) else None


def is_seen_elsewhere(problem: Problem, before: Formula, longer: Formula) -> bool:
    """Whether the held-out rows are no less likely with the last group, and where it reads efforts,
    manoeuvres are likelier by more than it costs: smaller efforts answer what the groups before leave.
    """
    if held_out(problem, longer.fit) > held_out(problem, before.fit):
        return False
    return gain_in_manoeuvres(before.fit, longer.fit) > longer.groups[-1].price(log_n(problem))


def margin(problem: Problem, before: Formula, longer: Formula) -> float:
    """What the last group must explain beyond its price: one that brings another quantity to its channel more
    than the wrong form of those before may leave.
    """
    own, channel = problem.settings.formula, longer.groups[-1].terms[0].channel
    known = {name for group in before.groups for name in group.quantities if channel in group.quantities}
    if not before.groups:
        return own.first_margin
    if not known or {*longer.groups[-1].quantities} <= known:
        return own.margin
    return max(own.margin, own.beyond_library * before.gain)


def pruned(problem: Problem, formula: Formula) -> Formula:
    """The formula without the groups that it does not need beside the others."""
    while len(formula.groups) > 1:
        costs = [loss_without(problem, formula, group) for group in formula.groups]
        spare = [
            cost - group.price(log_n(problem)) for cost, group in zip(costs, formula.groups, strict=True)
        ]
        weakest = int(np.argmin(spare))
        if spare[weakest] > 0:
            order = np.argsort(costs)[::-1]
            return replace(formula, groups=tuple(formula.groups[int(i)] for i in order))
        formula = without(problem, formula, formula.groups[weakest])
    return formula


def loss_without(problem: Problem, formula: Formula, group: Group) -> float:
    """What the deviance grows by without a group, the disturbance as it is."""
    extension = formula.fit.extension
    for name in group.names:
        extension = extension.without(name)
    rest = gauss_newton(problem, extension, formula.fit.noise, problem.settings.budget.last_steps)
    return rest.deviance - formula.fit.deviance


def without(problem: Problem, formula: Formula, group: Group) -> Formula:
    """The formula fitted again without a group."""
    extension, budget = formula.fit.extension, problem.settings.budget
    for name in group.names:
        extension = extension.without(name)
    fit = fit_model(problem, extension, formula.fit.noise, budget.best_diffusion)
    return replace(formula, fit=fit, groups=tuple(one for one in formula.groups if one is not group))
