"""A formula on top of a model: what it says for its price, and whether its terms are sound."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.covariance import inverse_information
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.formula.families import PLACED
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.formula.scores import log_n
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
        peak = np.exp(-0.5) if group.family.kind == "hill" else 1.0
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


def held_out(problem: Problem, fit: Fit) -> float:
    """−2 log likelihood of the held-out rows."""
    return float(fit.row_deviance[~problem.train].sum())


def best_of(problem: Problem, some: Iterable[Formula]) -> Formula | None:
    """The formula that says most of all rows for its price, those that were not fitted among them."""
    return max(some, key=lambda one: worth(problem, one) - held_out(problem, one.fit), default=None)


def worth(problem: Problem, formula: Formula) -> float:
    """The score with its last group pruned: a term without numbers that it does not need costs nothing."""
    last, fit = formula.groups[-1], formula.fit
    spared = [
        fit.keys.index((term.name, COEFFICIENT)) for term in last.terms if term in last.family.plain_terms
    ]
    if not spared:
        return score(problem, formula)
    deviation = np.sqrt(np.diag(inverse_information(fit.psi[problem.train])))
    needs = np.square(np.array(fit.values) / deviation)[spared]
    return score(problem, formula) + float(np.sum(np.maximum(log_n(problem) - needs, 0.0)))
