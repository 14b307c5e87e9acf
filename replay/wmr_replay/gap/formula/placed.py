"""What is found, and holds in some places, times or headings alone, or there the other way about."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import evaluate
from wmr_replay.gap.formula.formula import Formula, extended, is_sound, score, simplest, unseen_between
from wmr_replay.gap.formula.groups import Group, Tried
from wmr_replay.gap.formula.passes import is_of_one_pass
from wmr_replay.gap.formula.placements import placements_of
from wmr_replay.gap.formula.scores import excess
from wmr_replay.gap.formula.shapes import refined
from wmr_replay.gap.formula.winners import winners
from wmr_schemas.terms import Term


def with_placement(problem: Problem, before: Formula, formula: Formula) -> Formula:
    """The formula with what it has beyond ``before`` times a function of the plane, the heading or the time,
    where a disturbance is left that this explains enough of. Not beside an effect of the library, whose size
    a place would share.
    """
    own = problem.settings.formula
    calm = calmed(formula.fit.noise, problem.settings.diffusion, own.something_left)
    if calm is None or formula.rest.extension.effects:
        return formula
    further = [one for some in choices(before, formula) for one in placed(problem, formula, *some, calm)]
    better = [one for one in further if score(problem, one) >= score(problem, formula) + own.placed_margin]
    better = [one for one in better if is_sound(problem, one) and not is_of_one_pass(problem, one.groups[-1])]
    better = [one for one in better if unseen_between(problem, formula.fit, one.fit) >= 0]
    if not better:
        return formula
    best = simplest(problem, better)
    return replace(best, groups=(*best.groups[:-1], *best.groups[-1].parts))


def choices(before: Formula, formula: Formula) -> Iterator[tuple[list[Group], list[Term]]]:
    """The new groups, and all of their channel, each with the terms that may hold somewhere: their own,
    without what they read of time and place.
    """
    new = [group for group in formula.groups if group not in before.groups]
    if not new:
        return
    channel = new[0].terms[0].channel
    every = [group for group in formula.groups if group.terms[0].channel == channel]
    for groups in (new, every) if len(every) > len(new) else (new,):
        terms = [term for group in groups for term in group.terms]
        moving = {factors_anywhere(term) for term in terms} - {()}
        if moving:
            yield groups, [Term(channel, factors) for factors in sorted(moving)]


def factors_anywhere(term: Term) -> tuple[str, ...]:
    """A term's factors but the constant and those that read time or place."""
    return tuple(one for one in term.factors if one != "1" and not Term(term.channel, (one,)).is_placed)


def placed(
    problem: Problem, formula: Formula, groups: Sequence[Group], terms: Sequence[Term], calm: Diffusion
) -> list[Formula]:
    """The best of what these terms are in places, times or headings, in the place of the groups; by calm
    disturbances, since large ones explain what changes slowly as well as any of these.
    """
    rest = formula.fit.extension
    for name in (name for group in groups for name in group.names):
        rest = rest.without(name)
    there = evaluate(problem, rest, calm)
    left = tuple(one for one in formula.groups if one not in groups)
    others = replace(formula, fit=evaluate(problem, rest, formula.fit.noise), groups=left)
    times = float(np.prod([group.n_tried for group in groups]))
    tried = Tried((), tuple(grid for grid in placements_of(problem, terms) if len(grid)), times)
    own = problem.settings.formula
    found = sorted(winners(problem, there, tried), key=lambda one: -excess(problem, one))
    finer = [refined(problem, there, one) for one in found[: own.most_fitted]]
    finer.sort(key=lambda one: -excess(problem, one))
    return [extended(problem, others, one) for one in finer[: own.most_modulations]]
