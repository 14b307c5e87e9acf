"""Forward selection and backward elimination of effects, with the reason why each other one is not named."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.model.confounds import confound_class
from wmr_replay.gap.wheel_speed.candidates import PLACES, absent, candidates_of, parameters_of
from wmr_replay.gap.wheel_speed.estimate import Fit, Noises, at, fit, fit_noises, refit
from wmr_replay.gap.wheel_speed.evidence import holds_on_held_out, p_value, steady_loss
from wmr_replay.gap.wheel_speed.places import MOST_CELLS
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_replay.gap.wheel_speed.scan import Score, scan
from wmr_schemas.effects.declaration import DrivenBy

NEAR_BIC = 10.0
"""BIC difference below which two effects explain a record nearly as well: "very strong" evidence begins here
(Kass and Raftery 1995).
"""
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Tried:
    """A candidate that was fitted in full."""

    stage: int
    name: str
    gain: float
    score: float
    p_value: float
    failed: str = ""


@dataclass(frozen=True)
class Named:
    """An effect that passes, with its p, and rivals by how much worse their likelihood is (BIC)."""

    name: str
    p_value: float
    alternatives: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Selection:
    """The base model's fit, the fit with what was found, the effects in the order found, all tried, and the
    scores of the last scan.
    """

    base: Fit
    fit: Fit
    found: tuple[Named, ...]
    tried: tuple[Tried, ...]
    left: tuple[Score, ...]


def fitted_with(problem: Problem, current: Fit, name: str, start: dict[str, float]) -> Fit:
    """``current`` with one more effect, from a start."""
    values = {**current.values, name: absent(name) | start}
    return fit(problem, (*current.parameters, *parameters_of(name)), values, current.noises)


def without(problem: Problem, current: Fit, name: str) -> Fit:
    """``current`` refitted without one effect, at the same noise."""
    values = {key: value for key, value in current.values.items() if key != name}
    parameters = tuple(one for one in current.parameters if one.effect != name)
    return refit(problem, parameters, values, current.noises)


def base_fit(problem: Problem, noises: Noises | None = None) -> Fit:
    """The base model without any further effect."""
    return at(problem, (), {}, fit_noises(problem, {}, noises))


def price(problem: Problem, n_parameters: int) -> float:
    """What parameters must gain: BIC over the bins that are fitted."""
    n = int((problem.bins.inside & problem.fitted[np.maximum(problem.bins.table, 0)]).sum())
    return n_parameters * math.log(max(3 * n, 2))


def select(problem: Problem, most: int, progress: Progress | None = None) -> Selection:
    """The effects that the record proves, one after the other."""
    base = base_fit(problem)
    current, found, tried = base, [], []
    candidates = candidates_of(problem.record)
    scores: tuple[Score, ...] = ()
    for stage in range(most + 1):
        scores = scan(problem, current, candidates)
        if stage == most:
            break
        if progress is not None:
            progress("naming", 0.1 + 0.7 * stage / most)
        taken = next_effect(problem, current, scores, len(candidates), stage, tried)
        if taken is None:
            break
        current = taken
        found.append(taken.parameters[-1].effect)
    current, kept = eliminated(problem, current, found, len(candidates), tried)
    return Selection(base, current, kept, tuple(tried), scores)


def next_effect(  # noqa: PLR0917 – the state of a selection
    problem: Problem,
    current: Fit,
    scores: tuple[Score, ...],
    n_scanned: int,
    stage: int,
    tried: list[Tried],
) -> Fit | None:
    """The fit with the likeliest candidate that passes every gate; None where none does."""
    promising = [s for s in scores if s.gain > price(problem, len(s.start))]
    best = max((s.gain for s in promising), default=0.0)
    near = [s for s in promising if s.gain > problem.settings.gates.near * best]
    chosen = near[: problem.settings.gates.fitted_in_full]
    fits = [(s, fitted_with(problem, current, s.name, s.start)) for s in chosen]
    fits = simplest_first(problem, fits)
    taken = None
    for score, one in fits:
        gain = current.minus_two_log - one.minus_two_log
        p, failed = p_value(one, score.name, n_scanned * places_scanned(score.name)), ""
        if gain < price(problem, len(score.start)):
            failed = "significance"
        elif taken is None:
            failed = gate(problem, current, one, score.name, p)
        tried.append(
            Tried(stage, score.name, gain, gain - price(problem, len(score.start)), p, failed)
        )
        if not failed and taken is None:
            taken = one
    return taken


def simplest_first(problem: Problem, fits: list[tuple[Score, Fit]]) -> list[tuple[Score, Fit]]:
    """Candidates by BIC, the best first; of a class that is the same in any motion, the one with the fewest
    parameters where the others are hardly better.
    """

    def cost(pair: tuple[Score, Fit]) -> float:
        return pair[1].minus_two_log + price(problem, len(pair[0].start))

    ranked = sorted(fits, key=cost)
    if ranked:
        same = same_in_any_motion(problem, ranked[0][0].name)
        near = [pair for pair in ranked if pair[0].name in same and cost(pair) < cost(ranked[0]) + NEAR_BIC]
        ranked.sort(key=lambda pair: (pair is not min(near, key=lambda p: len(p[0].start)), cost(pair)))
    return ranked


def same_in_any_motion(problem: Problem, name: str) -> tuple[str, ...]:
    """The confound class of an effect alone, itself first."""
    driven_by: DrivenBy = "command" if problem.record.driven_by == "command" else "wheel_speed"
    return confound_class((name,), name, driven_by=driven_by)


def gate(problem: Problem, before: Fit, after: Fit, name: str, p: float) -> str:
    """The gate that an effect does not pass; empty where it passes all."""
    if p > problem.settings.gates.level:
        return "significance"
    if name in PLACES and not steady_loss(problem, after, name):
        return "contact mode"
    return "" if holds_on_held_out(problem, before, after, name)[0] else "held-out gap"


def places_scanned(name: str) -> int:
    """Times or places at which an effect was tried, for the correction of its p."""
    return MOST_CELLS**2 // 2 if name in PLACES else 1


def eliminated(
    problem: Problem, current: Fit, found: list[str], n_scanned: int, tried: list[Tried]
) -> tuple[Fit, tuple[Named, ...]]:
    """The model less the effects that the others explain, and those that stay."""
    names, kept, lesser = list(found), [], {}
    while names:
        lesser = {name: without(problem, current, name) for name in names}
        failing = [
            (lesser[name].minus_two_log - current.minus_two_log, name)
            for name in names
            if p_value(current, name, n_scanned * places_scanned(name)) > problem.settings.gates.level
            or lesser[name].minus_two_log - current.minus_two_log < price(problem, len(parameters_of(name)))
        ]
        if not failing:
            break
        gain, weakest = min(failing)
        p = p_value(current, weakest, n_scanned * places_scanned(weakest))
        tried.append(Tried(len(found), weakest, gain, 0.0, p, "needed"))
        names.remove(weakest)
        current = fit(problem, lesser[weakest].parameters, lesser[weakest].values, current.noises)
    for name in names:
        others = alternatives(problem, current, lesser[name], name)
        kept.append(Named(name, p_value(current, name, n_scanned * places_scanned(name)), others))
    return current, tuple(kept)


def alternatives(problem: Problem, full: Fit, lesser: Fit, name: str) -> tuple[tuple[str, float], ...]:
    """Other candidates in the place of an effect that explain nearly as much, by their loss of BIC."""
    pool = tuple(
        c
        for c in candidates_of(problem.record)
        if c.name not in (*same_in_any_motion(problem, name), *full.values)
    )
    own = lesser.minus_two_log - full.minus_two_log - price(problem, len(parameters_of(name)))
    found = []
    for score in scan(problem, lesser, pool):
        extra = price(problem, len(score.start))
        if score.gain - extra < own - 60.0 or score.gain <= 0:
            continue
        values = {**lesser.values, score.name: absent(score.name) | score.start}
        rival = refit(problem, (*lesser.parameters, *parameters_of(score.name)), values, full.noises)
        tries = len(pool) * places_scanned(score.name)
        if p_value(rival, score.name, tries) > problem.settings.gates.level:
            continue
        if score.name in PLACES and not steady_loss(problem, rival, score.name):
            continue
        delta = own - (lesser.minus_two_log - rival.minus_two_log - extra)
        found.append((score.name, max(float(delta), 0.0)))
    return tuple(sorted(found, key=lambda pair: pair[1])[:3])


def merged(problem: Problem, values: dict[str, dict[str, float]]) -> Problem:
    """The problem whose base model has further effects."""
    return replace(problem, base={**problem.base, **values})
