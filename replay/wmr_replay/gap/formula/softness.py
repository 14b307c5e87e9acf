"""How soft a formula's frictions are: the speeds over which they change their sign.

The dictionary has two softnesses for each speed. A contact's own is found where a formula holds such a
friction, the same in all terms that have the same.
"""

import re
from dataclasses import replace

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula.formula import Formula, score
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.model.dictionary import SOFT_SIGNS
from wmr_schemas.shape_factors import shape_text
from wmr_schemas.terms import Term

DICTIONARY = {text for texts in SOFT_SIGNS.values() for text in texts}
SOFT = re.compile(r"soft\((\w+),([^)]+)\)")


def with_own_softness(problem: Problem, formula: Formula) -> Formula:
    """The formula with the softness at which it scores best, of steps by a factor from the dictionary's."""
    for text in sorted(softs_of(formula) & DICTIONARY):
        formula = softened(problem, formula, text)
    return formula


def softened(problem: Problem, formula: Formula, start: str) -> Formula:
    """The best along steps to softer frictions, or where these are worse to harder ones."""
    own = problem.settings.formula
    for step in (own.softer, 1 / own.softer):
        best, text = formula, start
        for _ in range(own.most_softer):
            other = stepped(text, step)
            longer = refitted(problem, best, text, other)
            if score(problem, longer) <= score(problem, best):
                break
            best, text = longer, other
        if best is not formula:
            return best
    return formula


def refitted(problem: Problem, formula: Formula, before: str, after: str) -> Formula:
    """The formula with another factor in the place of one, fitted again."""
    n_tried = 2 * problem.settings.formula.most_softer
    groups = tuple(changed(group, before, after, n_tried) for group in formula.groups)
    extension, values = formula.fit.extension, formula.fit.extension.effects
    for old, new in zip(formula.groups, groups, strict=True):
        for name, other in zip(old.names, new.names, strict=True):
            extension = extension.without(name).with_effect(other, values[name])
    iterations = problem.settings.budget.best_diffusion
    return replace(formula, fit=fit_model(problem, extension, formula.fit.noise, iterations), groups=groups)


def changed(group: Group, before: str, after: str, n_tried: int) -> Group:
    """The group with another factor; what was tried for a soft one counts once."""
    terms = tuple(with_factor(term, before, after) for term in group.terms)
    if terms == group.terms:
        return group
    return replace(group, terms=terms, n_tried=group.n_tried * (n_tried if before in DICTIONARY else 1))


def with_factor(term: Term, before: str, after: str) -> Term:
    """The term with one factor in the place of another."""
    return Term(term.channel, tuple(after if factor == before else factor for factor in term.factors))


def softs_of(formula: Formula) -> set[str]:
    """The soft factors of a formula."""
    terms = (term for group in formula.groups for term in group.terms)
    return {factor for term in terms for factor in term.factors if SOFT.fullmatch(factor)}


def stepped(text: str, step: float) -> str:
    """A soft factor whose softness is ``step`` times as large."""
    match = SOFT.fullmatch(text)
    assert match is not None
    return shape_text("soft", match[1], step * float(match[2]))
