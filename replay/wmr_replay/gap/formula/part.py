"""The middle of a long log, where formulas are looked for first."""

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate


def is_long(problem: Problem) -> bool:
    """Whether a log has a middle that is a part of it."""
    return len(problem.binned) >= 2 * problem.settings.modes.part_rows


def middle_of(problem: Problem, fit: Fit) -> tuple[Problem, Fit]:
    """The middle of a long log, with the model there as it is; a short log itself.

    What is found there is fitted again on the whole.
    """
    if not is_long(problem):
        return problem, fit
    part = problem.middle(problem.settings.modes.part_rows)
    return part, evaluate(part, fit.extension, fit.noise)
