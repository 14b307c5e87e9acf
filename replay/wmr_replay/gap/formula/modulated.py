"""What is found, shaped by one quantity more: furrows that guide a robot only as it rolls.

A place, a heading or a time says where something acts. How it fades with a speed or an effort is looked for
at once: else further terms make up for it.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import evaluate
from wmr_replay.gap.evidence.excitation import ANSWERS
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.formula import Formula, extended, is_sound, score, unseen_between
from wmr_replay.gap.formula.grids import Grid, grid_of, shapes_of
from wmr_replay.gap.formula.groups import Group, Tried, twins_of
from wmr_replay.gap.formula.scores import excess
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.model.dictionary import columns_of
from wmr_schemas.shape_factors import SHAPED
from wmr_schemas.terms import CHANNELS, Term, parse_term


def with_modulation(problem: Problem, formula: Formula, groups: Iterable[Group]) -> Formula:
    """The formula with those of these groups that it still has shaped by one quantity more, where that
    explains enough more.
    """
    own, mine = problem.settings.formula, [group for group in groups if group in formula.groups]
    if not any(map(is_somewhere, mine)):
        return formula
    rest = formula.fit.extension
    for name in (name for group in mine for name in group.names):
        rest = rest.without(name)
    there = evaluate(problem, rest, formula.fit.noise)
    grids = tuple(modulations_of(problem, [term for group in mine for term in group.terms]))
    tried = Tried((), grids, float(np.prod([group.n_tried for group in mine])))
    finer = [refined(problem, there, one) for one in winners(problem, there, tried)]
    finer.sort(key=lambda one: -excess(problem, one))
    others = replace(formula, fit=there, groups=tuple(one for one in formula.groups if one not in mine))
    further = [extended(problem, others, one) for one in finer[: own.most_modulations]]
    best = max(further, key=lambda one: score(problem, one), default=formula)
    better = score(problem, best) >= score(problem, formula) + own.margin and is_sound(problem, best)
    return best if better and unseen_between(problem, formula.fit, best.fit) >= 0 else formula


def is_somewhere(group: Group) -> bool:
    """Whether a group acts by place, heading or time."""
    return any(term.is_placed or "yaw" in term.columns for term in group.terms)


def modulations_of(problem: Problem, terms: Sequence[Term], *, own: bool = False) -> Iterator[Grid]:
    """Terms of one channel, all of them times one shape of a quantity; with ``own``, of those that they read
    as well. No shape is of the efforts that answer what is found.
    """
    settings, columns = problem.settings.formula, columns_of(problem.binned)
    shares = *settings.scale_shares, ("rise", settings.rise_shares)
    read = {column for term in terms for column in term.columns}
    carriers = tuple(tuple(factor for factor in term.factors if factor != "1") for term in terms)
    for z in SHAPED:
        if z != ANSWERS[terms[0].channel] and (own or z not in read):
            family = Family("", terms[0].channel, z, carriers)
            shapes = shapes_of(columns[z], shares, settings)
            yield grid_of(*((replace(family, kind=kind), numbers) for kind, numbers in shapes))


def modulations_of_effects(problem: Problem, effects: Iterable[str]) -> Tried:
    """The terms that effects are, each channel's shaped by a quantity."""
    terms = [parse_term(name) for name in twins_of(effects)]
    own = [[term for term in terms if term.channel == channel] for channel in CHANNELS]
    return Tried((), tuple(grid for some in own if some for grid in modulations_of(problem, some, own=True)))
