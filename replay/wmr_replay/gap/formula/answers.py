"""What of a formula may only answer the disturbance: efforts that no manoeuvre shows.

A controller sees a disturbance better than the poses do, and answers it by efforts that move nothing. What
is made of them must be seen in manoeuvres (:mod:`wmr_replay.gap.evidence.excitation`).
"""

from collections.abc import Sequence, Set

from scipy.special import chdtri

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.excitation import (
    gain_in_manoeuvres,
    gains_in_manoeuvres,
    manoeuvres,
    torques_of,
)
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.formula.grow import without
from wmr_replay.gap.formula.proven import Proven
from wmr_replay.gap.formula.scores import log_n
from wmr_replay.gap.search.select import Selection


def may_only_answer(found: Proven) -> bool:
    """Whether a formula of the efforts that answer the disturbance explains less than is asked of it in
    manoeuvres.
    """
    asked = asked_of_answers(found.problem, found.base, found.formula)
    return asked > 0 and gain_in_manoeuvres(found.base, found.formula.fit) <= asked


def shown_part(problem: Problem, selection: Selection, formula: Formula) -> Formula:
    """The formula without the groups that may answer a channel's disturbance, where that channel's manoeuvres
    do not show them and others stand beside them: these are no reason to lose the others.
    """
    shown = {torques_of(effect.name) for effect in selection.found}
    gains, spare = gains_in_manoeuvres(selection.fit, formula.fit), list[Group]()
    for channel in sorted({c for group in formula.groups for c in group.answers - shown}):
        answers = [group for group in formula.groups if channel in group.answers]
        asked = asked_of(problem, selection.fit, formula, answers)
        spare += answers if gains.get(channel, 0.0) <= asked else []
    if len(spare) == len(formula.groups):
        return formula
    for group in spare:
        formula = without(problem, formula, group)
    return formula


def asked_of_answers(problem: Problem, before: Fit, formula: Formula, shown: Set[str] = frozenset()) -> float:
    """What manoeuvres must gain by the groups that may answer the disturbance, but of efforts of channels
    that are ``shown``: what a named effect shows there, its better form need not show again.
    """
    return asked_of(problem, before, formula, [one for one in formula.groups if one.answers - shown])


def asked_of(problem: Problem, before: Fit, formula: Formula, answers: Sequence[Group]) -> float:
    """What manoeuvres must gain by some groups of a formula: their price, or where few rows are manoeuvres
    what is significant of as many coefficients, and half as much a row as all rows do. An answer gains
    nothing there.
    """
    if not answers:
        return 0.0
    price = sum(group.price(log_n(problem)) for group in answers)
    n_terms = sum(len(group.terms) for group in answers)
    significant = float(chdtri(n_terms, problem.settings.excitation.level))
    channels = {channel for group in answers for channel in group.answers}
    rows = max((int(manoeuvres(problem, before, c).sum()) for c in channels), default=0)
    gained, share = before.deviance - formula.fit.deviance, rows / int(problem.train.sum())
    return min(price, max(significant, problem.settings.formula.shown_share * gained * share))
