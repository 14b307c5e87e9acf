"""What passes by in time, and catches a robot from its side more than from ahead."""

from collections.abc import Iterator, Sequence

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.formula.families import WAVES
from wmr_replay.gap.formula.formula import Formula, extended, is_sound, score, unseen_between
from wmr_replay.gap.formula.groups import CURVE, Group
from wmr_replay.gap.formula.scores import scored_groups
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.placed_factors import wave_text
from wmr_schemas.terms import CHANNELS, Term


def with_heading(problem: Problem, formula: Formula) -> Formula:
    """The formula with what it says of the time alone times a wave over the heading, too, where that explains
    enough more.
    """
    own = problem.settings.formula
    for channel in CHANNELS:
        terms = [term for group in formula.groups for term in group.terms if term.channel == channel]
        groups = tuple(times_heading([term for term in terms if {*term.columns} == {"t"}], own))
        for scored in scored_groups(problem, formula.fit, groups)[:1]:
            longer = extended(problem, formula, scored)
            more = score(problem, longer) >= score(problem, formula) + own.margin
            if more and is_sound(problem, longer) and unseen_between(problem, formula.fit, longer.fit) >= 0:
                formula = longer
    return formula


def times_heading(terms: Sequence[Term], own: FormulaSettings) -> Iterator[Group]:
    """The terms, all of them times the waves over the heading of as many periods a turn."""
    for turns in own.turns if terms else ():
        waves = [wave_text(function, turns, "yaw") for function in WAVES]
        products = tuple(Term(one.channel, (*one.factors, wave)) for one in terms for wave in waves)
        yield Group(CURVE, products, n_tried=len(own.turns))
