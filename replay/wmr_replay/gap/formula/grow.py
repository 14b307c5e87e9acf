"""A formula grown by one group of terms after the other, and pruned of those that it does not need."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import calm_or_same, calmed, fit_diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate, fit_model, gauss_newton
from wmr_replay.gap.formula.families import PLACED
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.part import middle_of
from wmr_replay.gap.formula.scores import ScoredGroup, excess, log_n, with_group
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.work import work_on
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.terms import COEFFICIENT

FORMULAS = "formulas beside what is named"
"""What a long log's search leaves out last."""


@dataclass(frozen=True, eq=False)
class Formula:
    """Groups of terms on top of the model ``rest``, and the fit with both; the strongest group first."""

    rest: Fit
    fit: Fit
    groups: tuple[Group, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all terms."""
        return tuple(name for group in self.groups for name in group.names)

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that have terms."""
        return tuple(dict.fromkeys(term.channel for group in self.groups for term in group.terms))

    @property
    def gain(self) -> float:
        """What the terms lower the deviance by."""
        return self.rest.deviance - self.fit.deviance

    def price(self, problem: Problem) -> float:
        """What the terms cost."""
        return sum(group.price(log_n(problem)) for group in self.groups)


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
        formula = pruned(problem, longer) if len(parts) > 1 else longer
    return pruned(problem, formula)


def grown_both_ways(problem: Problem, rest: Fit, tried: Tried) -> list[Formula]:
    """The formula on top of ``rest``, and where it may be a controller's answer, the one that grows without
    the efforts that answer; the better one first, and only those that have groups.

    What holds a robot back is answered by its controller: group by group, an answer may explain as much.
    """
    found = [grow(problem, rest, tried)]
    if any(group.may_answer for group in found[0].groups):
        found.append(grow(problem, rest, tried.without_answers))
    return sorted((one for one in found if one.groups), key=lambda one: -score(problem, one))


def simplest(problem: Problem, formulas: Sequence[Formula]) -> Formula:
    """The best of the formulas; of those that are as good, the one whose last group reads least, and says
    least where it says most: powers run away where few rows are.
    """
    best = max(score(problem, one) for one in formulas)
    good = [one for one in formulas if score(problem, one) >= best - problem.settings.formula.as_good]
    return min(good, key=lambda one: (len(one.groups[-1].columns), peak_mps2(problem, one)))


def peak_mps2(problem: Problem, formula: Formula) -> float:
    """The largest acceleration that a formula's last group says of any row, fitted or not."""
    columns, values = columns_of(problem.binned), formula.fit.extension.effects
    parts = [values[term.name][COEFFICIENT] * term.evaluate(columns) for term in formula.groups[-1].terms]
    return float(np.max(np.abs(np.sum(parts, axis=0))))


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


def is_sound(problem: Problem, formula: Formula) -> bool:
    """Whether no place is steeper than what a robot drives on, and no term is many times as large as what all
    terms of its channel add up to: such terms describe a few rows by their small difference. Nor does an
    effect beside them grow, which they would take back.
    """
    own, values = problem.settings.formula, formula.fit.extension.effects
    if any(size_of(values[name]) > own.most_change * size_of(alone) for name, alone in beside(formula)):
        return False
    for group in formula.groups:
        size = float(np.hypot.reduce([values[name][COEFFICIENT] for name in group.names]))
        peak = np.exp(-0.5) if group.family.kind in ("hill", "tilt") else 1.0
        if group.family.kind in PLACED and size * peak > own.steepest_mps2:
            return False
    columns = columns_of(problem.binned)
    parts: dict[str, list[F64]] = {}
    for term in (term for group in formula.groups for term in group.terms):
        part = values[term.name][COEFFICIENT] * term.evaluate(columns)
        parts.setdefault(term.channel, []).append(part)
    return all(
        rms(part) <= own.most_cancelling * rms(np.sum(some, axis=0))
        for some in parts.values()
        for part in some
    )


def beside(formula: Formula) -> Iterable[tuple[str, Mapping[str, float]]]:
    """The effects that a formula stands beside, with their parameters without it."""
    return formula.rest.extension.effects.items()


def size_of(parameters: Mapping[str, float]) -> float:
    """The size of an effect of several parameters."""
    return float(np.hypot.reduce(list(parameters.values())))


def rms(values: F64) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def score(problem: Problem, formula: Formula) -> float:
    """Gain less price."""
    return formula.gain - formula.price(problem)


def unseen_between(problem: Problem, before: Fit, after: Fit) -> float:
    """What −2 log likelihood of the held-out rows falls by from one fit to another, no row saying much alone.

    A second of slipping that no label tells speaks against the fit that leaves the calmer disturbance, more
    loudly than all other rows for it.
    """
    most = problem.settings.formula.most_of_a_row
    gained = (before.row_deviance - after.row_deviance)[~problem.train]
    return float(np.clip(gained, -most, most).sum())


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
    return [one for one in longer if is_sound(problem, one)]


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
    """The formula with one group more, fitted with its diffusion.

    Its sizes are found at calm disturbances first: large ones hold what stands beside the group where it was
    without it.
    """
    extension, noise = with_group(formula.fit.extension, scored), formula.fit.noise
    budget, calm = problem.settings.budget, calm_or_same(noise, problem.settings.diffusion)
    extension = gauss_newton(problem, extension, calm, budget.last_steps).extension
    noise = fit_diffusion(problem, extension, noise, budget.best_diffusion)
    fit = gauss_newton(problem, extension, noise, budget.last_steps)
    return replace(formula, fit=fit, groups=(*formula.groups, scored.group))


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
