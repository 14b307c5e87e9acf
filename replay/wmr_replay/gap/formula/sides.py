"""What acts on one side of a quantity, or on both: a log that shows one side tells no difference."""

from dataclasses import replace

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.groups import Group

ONE_SIDE, BOTH_SIDES = "above", "beyond"


def two_sided(problem: Problem, formula: Formula) -> Formula:
    """The formula with what sets in on one side of a quantity setting in on both, where that explains hardly
    less: what tells left from right, or ahead from back, must be seen to.
    """
    for group in formula.groups:
        if group.family.kind == ONE_SIDE and group.shape[0] > 0:
            other = refitted(problem, formula, group)
            if other.fit.deviance - formula.fit.deviance < problem.settings.formula.margin:
                formula = other
    return formula


def refitted(problem: Problem, formula: Formula, group: Group) -> Formula:
    """The formula with a group that acts on both sides, fitted again."""
    family = replace(group.family, kind=BOTH_SIDES)
    other = replace(group, family=family, terms=family.terms(group.shape))
    extension, values = formula.fit.extension, formula.fit.extension.effects
    for old, new in zip(group.names, other.names, strict=True):
        extension = extension.without(old).with_effect(new, values[old])
    fit = fit_model(problem, extension, formula.fit.noise, problem.settings.budget.best_diffusion)
    groups = tuple(other if one is group else one for one in formula.groups)
    return replace(formula, fit=fit, groups=groups)
