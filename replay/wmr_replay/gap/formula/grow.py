"""A formula grown by one group of terms after the other, and pruned of those that it does not need."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate, fit_model, gauss_newton
from wmr_replay.gap.formula.by_heading import with_heading
from wmr_replay.gap.formula.formula import Formula, extended, is_sound, score, simplest, unseen_between
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.modulated import with_modulation
from wmr_replay.gap.formula.part import middle_of
from wmr_replay.gap.formula.passes import is_of_one_pass
from wmr_replay.gap.formula.placed import with_placement
from wmr_replay.gap.formula.scores import ScoredGroup, excess, log_n
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.model.work import work_on
from wmr_replay.gap.settings.formula import FormulaSettings

FORMULAS = "formulas beside what is named"
"""What a long log's search leaves out last."""


def grow(problem: Problem, rest: Fit, tried: Tried) -> Formula:
    """The formula on top of ``rest``; without groups where none explains enough. On a long log it begins with
    what the middle shows.
    """
    formula = shown_by_a_part(problem, rest, tried)
    beside, work = bool(rest.extension.effects), work_on(problem.binned.log.pose)
    while len(formula.groups) < problem.settings.formula.most_groups:
        if beside and not work.allows(FORMULAS):
            break
        further = [one for one in longer_ones(problem, formula, tried) if passes(problem, formula, one)]
        if not further:
            break
        longer = simplest(problem, further)
        parts = longer.groups[-1].parts
        longer = replace(longer, groups=(*longer.groups[:-1], *parts))
        longer = pruned(problem, longer) if len(parts) > 1 else longer
        formula = with_placement(problem, formula, with_modulation(problem, longer, parts))
    return with_heading(problem, pruned(problem, formula))


def grown_both_ways(problem: Problem, rest: Fit, tried: Tried) -> list[Formula]:
    """The formula on top of ``rest``, and where it may be a controller's answer, the one that grows without
    the efforts that answer; the better one first, and only those that have groups.

    What holds a robot back is answered by its controller: group by group, an answer may explain as much.
    """
    found = [grow(problem, rest, tried)]
    if any(group.may_answer for group in found[0].groups):
        found.append(grow(problem, rest, tried.without_answers))
    return sorted((one for one in found if one.groups), key=lambda one: -score(problem, one))


def shown_by_a_part(problem: Problem, rest: Fit, tried: Tried) -> Formula:
    """The formula that the middle of a long log shows, where it explains enough of the whole; else none."""
    nothing, (part, there) = Formula(rest, rest), middle_of(problem, rest)
    if part is problem:
        return nothing
    shown, budget = grow(part, there, tried), problem.settings.budget
    if not shown.groups:
        return nothing
    fit = fit_model(problem, shown.fit.extension, rest.noise, budget.best_diffusion, budget.last_steps)
    whole = pruned(problem, Formula(rest, fit, shown.groups))
    enough = score(problem, whole) >= problem.settings.formula.first_margin
    return whole if enough and unseen_between(problem, rest, whole.fit) >= 0 else nothing


def passes(problem: Problem, before: Formula, longer: Formula) -> bool:
    """Whether the last group of a longer formula explains enough, and the held-out rows too.

    What the first group explains of the held-out rows counts beside the fitted ones: a slow disturbance that
    is fitted explains most of a place, and foresees none of it. Half as many, they may lose no more than half
    of what the fitted ones gain.
    """
    own = problem.settings.formula
    gained, unseen = score(problem, longer) - score(problem, before), unseen_gain(problem, before, longer)
    if before.groups:
        return gained >= own.margin and unseen >= 0
    return gained + max(unseen, 0.0) >= own.first_margin and unseen >= -gained / 2


def unseen_gain(problem: Problem, before: Formula, longer: Formula) -> float:
    """What −2 log likelihood of the held-out rows falls by."""
    return unseen_between(problem, before.fit, longer.fit)


def longer_ones(problem: Problem, formula: Formula, tried: Tried) -> list[Formula]:
    """The formula with each of the best further groups; none where a scan promises nothing.

    As a slow disturbance explains a lasting effect, the best groups of a scan with calm disturbances are
    fitted beside the best at those that are left. What one scan promises is nothing to the other's measure:
    each has its own best, and a group that is one of both is fitted from where it promises more.
    """
    settings, current = problem.settings, formula.fit
    least = settings.candidates.least_score_later if formula.groups else settings.candidates.least_score
    chosen: list[ScoredGroup] = []
    for noise in filter(None, (current.noise, calmed(current.noise, settings.diffusion))):
        here = current if noise is current.noise else evaluate(problem, current.extension, noise)
        found = winners(problem, here, tried.with_overtones(formula.groups, settings.formula))
        finer = [refined(problem, here, one) for one in found]
        scores = [excess(problem, one) for one in finer]
        enough = max(least, settings.candidates.promising * max(scores, default=0.0))
        promising = [one for one, beyond in zip(finer, scores, strict=True) if beyond > enough]
        chosen += to_fit(ranked(problem, promising), settings.formula)
    longer = [extended(problem, formula, one) for one in ranked(problem, chosen)]
    return [one for one in longer if is_sound(problem, one) and not is_of_one_pass(problem, one.groups[-1])]


def ranked(problem: Problem, scored: Iterable[ScoredGroup]) -> list[ScoredGroup]:
    """Each group once, at its better score, the best last."""
    distinct: dict[tuple[str, ...], ScoredGroup] = {}
    for one in sorted(scored, key=lambda one: excess(problem, one), reverse=True):
        distinct.setdefault(one.group.names, one)
    return [*reversed(distinct.values())]


def to_fit(found: Sequence[ScoredGroup], own: FormulaSettings) -> list[ScoredGroup]:
    """The best of the groups, the best last, and the best of those that are no answer of a controller.

    A controller's efforts follow what holds the robot back. So, with calm disturbances, many a group of
    efforts explains nearly as much as what does.
    """
    first = list(found[-own.most_fitted :])
    apart = [one for one in found if not one.group.may_answer][-own.most_apart :]
    return [*(one for one in apart if one not in first), *first]


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
