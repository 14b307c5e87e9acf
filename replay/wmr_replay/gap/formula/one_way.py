"""What a drive that never reverses cannot tell: whether a term turns about with the way of rolling.

Passive ground, gears and tyres only ever hold a robot back, so that what they do is odd in the speed. What
pushes ahead whichever way the robot rolls is directed by something: torques, a heading, a swing. Where a log
hardly tells the two apart, a formula says what is passive.
"""

from collections.abc import Set
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, gauss_newton
from wmr_replay.gap.formula.groups import twins_of
from wmr_replay.gap.model.dictionary import columns_of as columns_at
from wmr_replay.gap.search.select import Selection
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import COEFFICIENT, Term, columns_of, parse_term

ROLLING = "sgn(v)"
WAVES = ("sin(", "cos(")


def held_back(problem: Problem, said: Selection) -> Selection:
    """The selection with undirected terms odd in the speed, where the log tells no difference."""
    terms = {one.name: parse_term(one.name) for one in said.found if one.name.startswith(UNNAMED_PREFIX)}
    drags = undirected({*terms.values()}) | swinging_drag(problem, said.fit, {*terms.values()})
    turned = {term.name: odd(term).name for term in drags}
    names = [turned.get(name, name) for name in terms]
    if not turned or len({*names}) < len(names):
        return said
    extension = said.fit.extension
    for name, other in turned.items():
        extension = extension.without(name).with_effect(other, said.fit.extension.effects[name])
    fit = gauss_newton(problem, extension, said.fit.noise, problem.settings.budget.last_steps)
    if fit.deviance - said.fit.deviance > problem.settings.formula.as_good:
        return said
    found = (
        replace(one, fit=fit, scored=replace(one.scored, name=turned.get(one.name, one.name)))
        for one in said.found
    )
    not_named = (one for one in said.not_named if twins_of([one[0]]) & {*names})
    return replace(said, fit=fit, found=tuple(found), not_named=tuple(not_named))


def undirected(terms: Set[Term]) -> set[Term]:
    """The terms that push one way though only drags, places and times are in them.

    A constant is one beside others: alone it is a bias. A pull to one side is a drag of that side where it
    comes or goes in time; else it may be a brush's.
    """
    found = {term for term in terms if not is_odd(term) and not any(map(is_directed, term.factors))}
    ahead = {term for term in found if term.channel == "longitudinal"}
    aside = {term for term in found if term.channel == "yaw" and {*term.columns} <= {"t"}}
    return {term for some in (ahead, aside) for term in some if any(one.columns for one in some)}


def swinging_drag(problem: Problem, fit: Fit, terms: Set[Term]) -> set[Term]:
    """The terms of the time alone ahead, with their constant, where together they hardly ever push: what
    swings about a drag is one.
    """
    swings = {term for term in terms if term.channel == "longitudinal" and {*term.columns} <= {"t"}}
    if not any(term.columns for term in swings):
        return set()
    columns = columns_at(problem.binned)
    ahead = [fit.extension.effects[one.name][COEFFICIENT] * one.evaluate(columns) for one in swings]
    pushes = np.sum(ahead, axis=0) * np.sign(columns["v"])
    hardly = problem.settings.formula.hardly_pushes
    return swings if np.maximum(pushes, 0).sum() <= hardly * np.maximum(-pushes, 0).sum() else set()


def is_odd(term: Term) -> bool:
    """Whether a signed quantity directs a term: a speed, a torque, or one side of it."""
    return bool({"odd", "mixed"} & {*term.parity.values()})


def is_directed(factor: str) -> bool:
    """Whether a factor has a direction or swing of its own; a wave over the ground has none."""
    columns = {*columns_of(factor)}
    return bool(columns & {"yaw", "s"}) or (factor.startswith(WAVES) and columns == {"t"})


def odd(term: Term) -> Term:
    """The term times the sign of the speed, in its shortest form."""
    factors = [factor for factor in term.factors if factor != "1"]
    if "abs(v)" in factors:
        factors[factors.index("abs(v)")] = "v"
    elif factors.count("v") > 1:
        factors[factors.index("v", factors.index("v") + 1)] = "abs(v)"
    else:
        factors.append(ROLLING)
    return Term(term.channel, tuple(factors))
