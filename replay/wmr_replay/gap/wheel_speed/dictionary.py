"""What only a term of the dictionary describes: terms that are tried where effects leave something.

A term is proposed by the record without its moments of slip, and by the record with them, since an unknown
effect that is large is taken for slip. The moments of slip are then identified again with the term known,
and the term has to pass the gates of every effect there, and a placebo.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.wheel_speed.candidates import PLACES, absent, candidates_of, parameters_of
from wmr_replay.gap.wheel_speed.declared import DECLARED
from wmr_replay.gap.wheel_speed.estimate import Fit, View, at, fit, minus_two_log, refit
from wmr_replay.gap.wheel_speed.evidence import p_value
from wmr_replay.gap.wheel_speed.modes import ideal_only
from wmr_replay.gap.wheel_speed.placebo import placebo_p
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem
from wmr_replay.gap.wheel_speed.scan import Score, by_slope
from wmr_replay.gap.wheel_speed.select import (
    Search,
    Selection,
    Tried,
    base_fit,
    eliminated,
    gate,
    price,
    without,
)
from wmr_replay.gap.wheel_speed.whereabouts import speeds_of
from wmr_schemas.slip_terms import SlipTerm
from wmr_schemas.terms import COEFFICIENT

PRODUCTS: dict[str, tuple[str, ...]] = {
    "v_long": (
        *("abs(v)", "v*abs(v)", "v*v*v", "abs(yaw_rate)", "v*yaw_rate", "v*yaw_rate*yaw_rate"),
        *("v*abs(v)*abs(yaw_rate)", "abs(a)", "abs(v)*a", "v*abs(a)", "v*t", "v*cos(yaw)", "v*sin(yaw)"),
    ),
    "v_lat": (
        *("abs(v)", "v*abs(v)", "abs(yaw_rate)", "yaw_rate*abs(yaw_rate)", "v*abs(yaw_rate)"),
        *("abs(v)*yaw_rate", "v*v*yaw_rate", "v*abs(v)*yaw_rate", "v*yaw_rate*abs(yaw_rate)", "a"),
        *("v*t", "yaw_rate*t", "v*cos(yaw)", "v*sin(yaw)"),
    ),
    "yaw_rate": (
        *("abs(v)", "v*abs(v)", "abs(yaw_rate)", "yaw_rate*abs(yaw_rate)", "yaw_rate*yaw_rate*yaw_rate"),
        *("v*yaw_rate", "abs(v)*yaw_rate", "v*v*yaw_rate", "v*abs(yaw_rate)", "a", "v*t", "yaw_rate*t"),
        *("v*cos(yaw)", "v*sin(yaw)"),
    ),
}
TERMS = tuple(SlipTerm(channel, tuple(p.split("*"))) for channel, ps in PRODUCTS.items() for p in ps)
NEED_WORLD = ("t", "cos(yaw)", "sin(yaw)")
"""Factors that mean something only where all stretches are one drive in one world."""


def terms_of(problem: Problem) -> tuple[str, ...]:
    """Names of the terms that a record could show; none where commands drive the model, whose drive hides the
    wheels.
    """
    if problem.record.driven_by == "command":
        return ()
    anchored = problem.record.anchored
    return tuple(term.name for term in TERMS if anchored or not set(term.factors) & set(NEED_WORLD))


def with_terms(selection: Selection, most: int) -> Selection:
    """A selection with the terms that the record proves; effects that they make needless go."""
    if not terms_of(selection.problem):
        return selection
    for _ in range(min(selection.problem.settings.terms.most, most - len(selection.found))):
        further, tried = next_term(selection)
        selection = replace(further or selection, tried=tried)
        if further is None:
            break
    return selection


class Proposal(NamedTuple):
    """A term beside the effects found, on the record without the slip that remains with it, at the noise
    without it; ``cost`` is −2 log likelihood of the record with its slip.
    """

    name: str
    problem: Problem
    before: Fit
    after: Fit
    cost: float

    @property
    def price(self) -> float:
        """What its parameters must gain."""
        return price(self.problem, len(self.after.parameters))

    @property
    def gain(self) -> float:
        """Drop of the deviance."""
        return self.before.minus_two_log - self.after.minus_two_log


def next_term(selection: Selection) -> tuple[Selection | None, tuple[Tried, ...]]:
    """The selection with the likeliest term that passes every gate, None where none does; and all tried."""
    tried, stage = selection.tried, len(selection.found)
    for one in sorted(proposals(selection), key=lambda proposal: proposal.cost + proposal.price):
        p, cost = p_of(one.problem, one.after, one.name), price(one.problem, 1)
        failed = failing(one, p)
        further = None if failed else proved(selection, one)
        if further is None:
            failed = failed or "remainder"
        tried = (*tried, Tried(stage, one.name, one.gain, one.gain - cost, p, failed))
        if further is not None:
            return further, tried
    return None, tried


def proposals(selection: Selection) -> Iterator[Proposal]:
    """The best terms without and with the moments of slip, beside the effects found and in the place of each,
    fitted where the slip is known with them.
    """
    problem, current = selection.problem, selection.fit
    tried = {frozenset(current.values)}
    whole = problem.with_slip
    for here in (problem, whole) if problem.whole is not None else (problem,):
        own = at(here, current.parameters, current.values, current.noises)
        lasting = [named.name for named in selection.found if named.name not in PLACES]
        for lesser in (own, *(without(here, own, name) for name in lasting)):
            for score in best_terms(here, lesser):
                values = {**lesser.values, score.name: dict(score.start)}
                rough = refit(here, (*lesser.parameters, *parameters_of(score.name)), values, own.noises)
                if frozenset(rough.values) in tried or rough.minus_two_log > own.minus_two_log:
                    continue
                tried.add(frozenset(rough.values))
                if p_of(here, rough, score.name) <= problem.settings.gates.level:
                    yield proposal(problem, current, rough, score.name)


def proposal(problem: Problem, current: Fit, rough: Fit, name: str) -> Proposal:
    """A term as it stands where the moments of slip are identified with it."""
    seen = problem if problem.whole is None else ideal_only(problem, rough.values)
    after = refit(seen, rough.parameters, rough.values, current.noises)
    before = refit(seen, current.parameters, current.values, current.noises)
    return Proposal(name, seen, before, after, minus_two_log(problem.with_slip, after.values, current.noises))


def best_terms(problem: Problem, current: Fit) -> tuple[Score, ...]:
    """The terms of each channel with the largest gains above their price, by slope."""
    view = View.of(problem, current.noises)
    errors = view.errors(current.values)
    white = view.rows(errors, view.columns(current.values, current.parameters))
    names = [name for name in terms_of(problem) if name not in current.values]
    scores = [by_slope(view, white, errors, current.values, DECLARED[name]) for name in names]
    promising = [score for score in scores if score.gain > price(problem, len(score.start))]
    best = list[Score]()
    for channel in PRODUCTS:
        mine = sorted((s for s in promising if f":{channel}:" in s.name), key=lambda s: -s.gain)
        best += mine[: problem.settings.terms.fitted_in_full]
    return tuple(best)


def p_of(problem: Problem, fitted: Fit, name: str) -> float:
    """A term's p, corrected for the library and the dictionary."""
    return p_value(fitted, name, len(candidates_of(problem.record)) + len(terms_of(problem)))


def failing(one: Proposal, p: float) -> str:
    """The gate that a term does not pass; empty where it passes all."""
    if one.gain < one.problem.settings.terms.least_better:
        return "significance"
    terms = one.problem.settings.terms
    if share_of_motion(one) < (terms.least_share_calibrated if one.problem.base_sd else terms.least_share):
        return "tolerance"
    if failed := gate(one.problem, one.before, one.after, one.name, p):
        return failed
    if not beyond_calibration(one):
        return "calibration"
    return "placebo" if is_chance(one) else ""


def beyond_calibration(one: Proposal) -> bool:
    """Whether a term explains more than a base model that is calibrated on this log instead: one log's
    calibration is never quite another's.
    """
    problem = one.problem
    names = [name for name in problem.base_sd if name in problem.base and name not in one.after.values]
    if not names:
        return True
    released = tuple(parameter for name in names for parameter in parameters_of(name))

    def calibrated(found: Fit) -> Fit:
        values = {**found.values, **{name: absent(name) for name in names}}
        return refit(problem, (*found.parameters, *released), values, found.noises)

    gain = calibrated(one.before).minus_two_log - calibrated(one.after).minus_two_log
    return gain >= max(problem.settings.terms.least_better, price(problem, 1))


def share_of_motion(one: Proposal) -> float:
    """Root mean square of what a term adds, over that of the speed; in yaw, of the yaw rate. Both without the
    moments of slip, in which speeds are those of wheels that spin.
    """
    own, added = speeds_of(one.problem, one.before.values), speeds_of(one.problem, one.after.values)
    lesser = {name: value for name, value in one.after.values.items() if name != one.name}
    change = added - speeds_of(one.problem, lesser)
    rolling = one.problem.bins.block_of >= 0
    rms = np.sqrt((np.stack([change, own])[..., rolling] ** 2).mean(axis=2))
    if one.name.split(":")[1] == "yaw_rate":
        return float(rms[0, 2] / max(rms[1, 2], 1e-9))
    return float(np.hypot(rms[0, 0], rms[0, 1]) / max(rms[1, 0], 1e-9))


def is_chance(one: Proposal) -> bool:
    """Whether the dictionary explains as much of placebo records."""
    own = one.problem.settings
    rest = {name: value for name, value in one.after.values.items() if name != one.name}
    which = tuple(Parameter(name, COEFFICIENT) for name in terms_of(one.problem) if name not in rest)
    view = View.of(one.problem, one.after.noises)
    columns = view.columns(one.after.values, which)
    draws = own.terms.draws
    return placebo_p(one.problem, one.before, one.after, columns, one.gain, draws) > own.gates.level


def proved(selection: Selection, one: Proposal) -> Selection | None:
    """The selection with the term, less the effects that it makes needless; None where the term is but the
    remainder of effects that stay, or no better than those that go.
    """
    own, problem = one.problem.settings.terms, one.problem
    before = fit(problem, one.before.parameters, one.before.values, one.before.noises)
    after = fit(problem, one.after.parameters, one.after.values, before.noises)
    names = tuple(named.name for named in selection.found)
    beside = tuple(name for name in names if name in after.values)
    rivals = {named.name: named.alternatives for named in selection.found}
    search = Search(problem, after, candidates_of(problem.record), [], (*beside, one.name), rivals)
    current, kept = eliminated(search)
    base = base_fit(problem)
    better = before.minus_two_log - current.minus_two_log
    explained = base.minus_two_log - before.minus_two_log
    stays = {named.name for named in kept}
    needless = [name for name in names if name not in stays]
    least = own.least_better if needless else own.least_remainder * explained
    if one.name not in stays or better < least:
        return None
    return Selection(problem, base, current, kept, selection.tried, selection.left)
