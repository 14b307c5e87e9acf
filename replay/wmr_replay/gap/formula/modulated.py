"""What is found, shaped by a quantity: furrows that guide a robot only as it rolls.

A place, a heading or a time says where something acts. How it fades with a speed or an effort is looked for
at once, of those that it reads too: else further terms make up for it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate
from wmr_replay.gap.formula.formula import Formula, extended, is_sound, score, unseen_between
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.modulations import (
    a_moving_floor,
    modulations_of,
    shapes_instead,
    towards_a_speed,
)
from wmr_replay.gap.formula.scores import excess
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import winners


def with_modulation(problem: Problem, formula: Formula, groups: Sequence[Group]) -> Formula:
    """The formula with those of these groups that it still has shaped by one quantity more, where that
    explains enough more; or in their place those that have numbers, or those that have none.
    """
    own, mine = problem.settings.formula, [group for group in groups if group in formula.groups]
    if not any(map(is_somewhere, mine)):
        return formula
    rest = formula.fit.extension
    for name in (name for group in mine for name in group.names):
        rest = rest.without(name)
    there = evaluate(problem, rest, formula.fit.noise)
    others = replace(formula, fit=there, groups=tuple(one for one in formula.groups if one not in mine))
    further = [one for some in choices(mine, groups) for one in modulated(problem, others, some)]
    better = [one for one in further if score(problem, one) >= score(problem, formula) + own.margin]
    better = [one for one in better if is_sound(problem, one)]
    best = max(better, key=lambda one: score(problem, one), default=formula)
    if best is formula or unseen_between(problem, formula.fit, best.fit) < 0:
        return formula
    return replace(best, groups=(*best.groups[:-1], *best.groups[-1].parts))


def choices(left: Sequence[Group], groups: Sequence[Group]) -> list[list[Group]]:
    """The groups that are left, those with numbers, and those without; only what is somewhere."""
    numbered, plain = ([group for group in groups if bool(group.shape) is has] for has in (True, False))
    some = [[*left], *(each for each in (numbered, plain) if {*each} != {*left})]
    return [each for each in some if any(map(is_somewhere, each))]


def modulated(problem: Problem, others: Formula, groups: Sequence[Group]) -> list[Formula]:
    """The best of what these groups are, shaped by a quantity, beside the others."""
    terms = [term for group in groups for term in group.terms]
    grids = (*modulations_of(problem, terms), *shapes_instead(problem, terms))
    before = float(np.prod([group.n_tried for group in groups]))
    moving = *towards_a_speed(terms, before), *a_moving_floor(terms, before)
    tried = Tried(moving, grids, before)
    finer = [refined(problem, others.fit, one) for one in winners(problem, others.fit, tried)]
    finer.sort(key=lambda one: -excess(problem, one))
    return [extended(problem, others, one) for one in finer[: problem.settings.formula.most_modulations]]


def is_somewhere(group: Group) -> bool:
    """Whether a group acts by place, heading or time."""
    return any(term.is_placed or "yaw" in term.columns for term in group.terms)
