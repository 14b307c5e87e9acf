"""How soft a formula's frictions are: the speeds over which they change their sign.

The dictionary has one softness for each speed. A contact's own is found where a formula holds such a
friction, the same in all of its terms.
"""

import re
from dataclasses import replace

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.formula.grow import Formula, score
from wmr_replay.gap.model.dictionary import SOFT_SIGNS
from wmr_schemas.shape_factors import shape_text
from wmr_schemas.terms import Term

SOFT = re.compile(r"soft\((\w+),([^)]+)\)")


def with_own_softness(problem: Problem, formula: Formula) -> Formula:
    """The formula with the softness at which it scores best, of steps by a factor from the dictionary's."""
    for quantity, text in SOFT_SIGNS.items():
        if text in softs_of(formula):
            formula = softened(problem, formula, quantity, softness_of(text))
    return formula


def softened(problem: Problem, formula: Formula, quantity: str, start: float) -> Formula:
    """The best along steps to softer frictions, or where these are worse to harder ones."""
    own = problem.settings.formula
    for step in (own.softer, 1 / own.softer):
        best, softness = formula, start
        for _ in range(own.most_softer):
            softness *= step
            longer = refitted(problem, best, quantity, softness)
            if score(problem, longer) <= score(problem, best):
                break
            best = longer
        if best is not formula:
            return best
    return formula


def refitted(problem: Problem, formula: Formula, quantity: str, softness: float) -> Formula:
    """The formula with another softness over one quantity, fitted again."""
    n_tried = 2 * problem.settings.formula.most_softer
    groups = tuple(changed(group, quantity, softness, n_tried) for group in formula.groups)
    extension, values = formula.fit.extension, formula.fit.extension.effects
    for old, new in zip(formula.groups, groups, strict=True):
        for before, after in zip(old.names, new.names, strict=True):
            extension = extension.without(before).with_effect(after, values[before])
    iterations = problem.settings.budget.best_diffusion
    return replace(formula, fit=fit_model(problem, extension, formula.fit.noise, iterations), groups=groups)


def changed(group: Group, quantity: str, softness: float, n_tried: int) -> Group:
    """The group with another softness over one quantity; what was tried for it counts once."""
    terms = tuple(with_softness(term, quantity, softness) for term in group.terms)
    if terms == group.terms:
        return group
    first = any(text in term.factors for term in group.terms for text in SOFT_SIGNS.values())
    return replace(group, terms=terms, n_tried=group.n_tried * (n_tried if first else 1))


def with_softness(term: Term, quantity: str, softness: float) -> Term:
    """The term with another softness over one quantity."""
    text = shape_text("soft", quantity, softness)
    soft = (SOFT.fullmatch(factor) for factor in term.factors)
    factors = (
        text if match and match[1] == quantity else factor
        for match, factor in zip(soft, term.factors, strict=True)
    )
    return Term(term.channel, tuple(factors))


def softs_of(formula: Formula) -> set[str]:
    """The soft factors of a formula."""
    terms = (term for group in formula.groups for term in group.terms)
    return {factor for term in terms for factor in term.factors if SOFT.fullmatch(factor)}


def softness_of(text: str) -> float:
    """The number of a soft factor."""
    match = SOFT.fullmatch(text)
    assert match is not None
    return float(match[2])
