"""A formula, and the fit of one group of terms more."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import calm_or_same, fit_diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate, gauss_newton
from wmr_replay.gap.formula.families import PLACED
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.formula.scores import ScoredGroup, log_n, with_group
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.model.dictionary import columns_of
from wmr_schemas.arrays import F64
from wmr_schemas.terms import COEFFICIENT


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


def unseen_between(problem: Problem, before: Fit, after: Fit) -> float:
    """What −2 log likelihood of the held-out rows falls by from one fit to another, no row saying much alone.

    A second of slipping that no label tells speaks against the fit that leaves the calmer disturbance, more
    loudly than all other rows for it.
    """
    most = problem.settings.formula.most_of_a_row
    gained = (before.row_deviance - after.row_deviance)[~problem.train]
    return float(np.clip(gained, -most, most).sum())


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
