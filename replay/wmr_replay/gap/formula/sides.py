"""What acts on one side of a quantity, or on both: a log that shows one side tells no difference."""

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.softness import refitted
from wmr_schemas.shape_factors import shape_text

ONE_SIDE, BOTH_SIDES = "above", "beyond"


def two_sided(problem: Problem, formula: Formula) -> Formula:
    """The formula with what sets in on one side of a quantity setting in on both, where that explains hardly
    less: what tells left from right, or ahead from back, must be seen to.
    """
    for family, shape in [(group.family, group.shape) for group in formula.groups]:
        if family.kind == ONE_SIDE and shape[0] > 0:
            one, both = (shape_text(kind, family.along, *shape) for kind in (ONE_SIDE, BOTH_SIDES))
            other = refitted(problem, formula, one, both)
            if other.fit.deviance - formula.fit.deviance < problem.settings.formula.margin:
                formula = other
    return formula
