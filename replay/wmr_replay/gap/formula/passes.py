"""Efforts that act less at a place which the robot passed once: a slip, as far as a log can tell.

An identifier misses slips, and takes their ends for traction. Where it says the modes, what efforts do at a
place must be seen in more than one pass.
"""

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64

AT_A_PLACE = ("bump(", "disc(", "band(", "strip(")


def is_of_one_pass(problem: Problem, group: Group) -> bool:
    """Whether a group of efforts at a place may be a slip that no mode says."""
    if not problem.binned.identified or not group.may_answer:
        return False
    terms = [term for term in group.terms if any(factor.startswith(AT_A_PLACE) for factor in term.factors)]
    columns = columns_of(problem.binned)
    squares = [term.evaluate(columns) ** 2 for term in terms]
    if not squares:
        return False
    own = problem.settings.formula
    return largest_pass(problem.binned.t_s, np.sum(squares, axis=0), own) > own.most_of_one_pass


def largest_pass(t_s: F64, squares: F64, own: FormulaSettings) -> float:
    """The largest share of the sum of squares (n,) in one pass; 0 where it acts most of the time, and so at
    no place.
    """
    acts = np.flatnonzero(squares > own.seen_of_a_pass * squares.max(initial=0.0))
    if not 0 < len(acts) < len(squares) / 2:
        return 0.0
    passes = np.cumsum(np.diff(t_s[acts], prepend=t_s[acts[0]]) > own.between_passes_s)
    return float(np.bincount(passes, squares[acts]).max() / squares[acts].sum())
