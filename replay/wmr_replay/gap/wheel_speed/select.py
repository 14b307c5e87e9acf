"""Forward selection and backward elimination of effects, with the reason why each other one is not named."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from wmr_replay.gap.model.confounds import confound_class
from wmr_replay.gap.wheel_speed.beside_calibration import is_of_calibration
from wmr_replay.gap.wheel_speed.candidates import (
    PLACES,
    absent,
    at_its_bound,
    candidates_of,
    hardly_lower,
    parameters_of,
    within_a_step,
)
from wmr_replay.gap.wheel_speed.estimate import Fit, Noises, at, fit, fit_noises, refit
from wmr_replay.gap.wheel_speed.evidence import (
    hardly_turns,
    holds_on_held_out,
    matters,
    moves_path,
    p_value,
    steady_loss,
    within_calibration,
)
from wmr_replay.gap.wheel_speed.modes import ideal_only
from wmr_replay.gap.wheel_speed.places import MOST_CELLS, likeliest
from wmr_replay.gap.wheel_speed.predict import DECLARED, Problem
from wmr_replay.gap.wheel_speed.scan import Score, scan
from wmr_replay.gap.wheel_speed.usual_slip import stands_out
from wmr_schemas.effects import EffectDeclaration
from wmr_schemas.effects.declaration import DrivenBy

NEAR_BIC = 10.0
"""BIC difference below which two effects explain a record nearly as well: "very strong" evidence begins here
(Kass and Raftery 1995).
"""
SAME_BIC = 25.0
"""The same for effects that differ by a parameter alone, of which the simpler is preferred."""
LISTED_BIC = 60.0
"""Alternatives that are worse by more are not listed."""
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
    """The problem as it stands in the end, the base model's fit, the fit with what was found, the effects in
    the order found, all tried, and the scores of the last scan.
    """

    problem: Problem
    base: Fit
    fit: Fit
    found: tuple[Named, ...]
    tried: tuple[Tried, ...]
    left: tuple[Score, ...]


def fitted_with(
    problem: Problem, current: Fit, name: str, start: Mapping[str, float], *, noise_too: bool = True
) -> Fit:
    """``current`` with one more effect, from a start; without ``noise_too`` at the noise of ``current``.

    It takes the place of an effect of its own class, which no motion tells from it.
    """
    same = same_in_any_motion(problem, name)
    kept = {key: value for key, value in current.values.items() if key not in same}
    values = {**kept, name: absent(name) | dict(start)}
    parameters = (*(one for one in current.parameters if one.effect not in same), *parameters_of(name))
    if not noise_too:
        return refit(problem, parameters, values, current.noises)
    return fit(problem, parameters, values, current.noises)


def without(problem: Problem, current: Fit, name: str) -> Fit:
    """``current`` refitted without one effect, at the same noise."""
    values = {key: value for key, value in current.values.items() if key != name}
    parameters = tuple(one for one in current.parameters if one.effect != name)
    return refit(problem, parameters, values, current.noises)


def without_slip(problem: Problem, current: Fit) -> Fit:
    """``current`` seen through white noise and a random walk alone."""
    noises = tuple(one.without_slip for one in current.noises)
    return at(problem, current.parameters, current.values, noises)  # type: ignore[arg-type]


def base_fit(problem: Problem, noises: Noises | None = None) -> Fit:
    """The base model without any further effect."""
    return at(problem, (), {}, fit_noises(problem, {}, noises))


def price(problem: Problem, n_parameters: int) -> float:
    """What parameters must gain: BIC over the bins that are fitted."""
    n = int((problem.bins.inside & problem.fitted[np.maximum(problem.bins.table, 0)]).sum())
    return n_parameters * math.log(max(3 * n, 2))


def select(
    problem: Problem, most: int, progress: Progress | None = None, begin: "Search | None" = None
) -> Selection:
    """The effects that the record proves, one after the other: those that last, then those in a time or a
    place, which slip may hide. ``begin`` is where others were found before; up to ``most`` more are sought.
    """
    search = begin or Search(problem, base_fit(problem), candidates_of(problem.record), [])
    begun = len(search.found)
    for stage in range(begun, begun + most):
        if progress is not None:
            progress("naming", 0.1 + 0.7 * (stage - begun) / most)
        following = search.next_lasting(stage) or search.next_place(stage)
        if following is None:
            break
        search = following
    current, kept = eliminated(search)
    problem = search.problem
    left = scan(problem, current, tuple(c for c in search.candidates if c.name not in PLACES))
    base = base_fit(problem) if search.found else search.current
    return Selection(problem, base, current, kept, tuple(search.tried), left)


@dataclass(frozen=True, eq=False)
class Search:
    """The state of a selection."""

    problem: Problem
    current: Fit
    candidates: tuple[EffectDeclaration, ...]
    tried: list[Tried]
    found: tuple[str, ...] = ()
    rivals: Mapping[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    """Of effects in a time or a place: the others that passed, by how much less likely they are."""

    def next_lasting(self, stage: int) -> "Search | None":
        """With the likeliest effect that acts all the time and passes every gate; None where none does.

        The noise of a model that lacks an effect may take up what it does all the time, as a slip that lasts,
        and hide it. So effects are ranked a second time by noise without such a slip.
        """
        lasting, before = tuple(c for c in self.candidates if c.name not in PLACES), len(self.tried)
        if found := self.first_passing(stage, scan(self.problem, self.current, lasting)):
            return found
        done = {one.name for one in self.tried[before:]}
        others = tuple(c for c in lasting if c.name not in done)
        return self.first_passing(stage, scan(self.problem, without_slip(self.problem, self.current), others))

    def first_passing(self, stage: int, scores: tuple[Score, ...]) -> "Search | None":
        """With the likeliest of the best scored effects that pass every gate; None where none does.

        What is but the calibration's own deviation takes no place among the candidates fitted in full.
        """
        problem, current = self.problem, self.current
        promising = [s for s in scores if s.gain > price(problem, len(s.start))]
        best = max((s.gain for s in promising), default=0.0)
        near = [s for s in promising if s.gain > problem.settings.gates.near * best]
        slow = problem.record.driven_by == "command"
        places = problem.settings.gates.fitted_in_full
        while near and places:
            chosen, near = near[:places], near[places:]
            places = 0
            fits = [(s, fitted_with(problem, current, s.name, s.start, noise_too=not slow)) for s in chosen]
            for score, ranked in simplest_first(problem, fits):
                start = ranked.values[score.name]
                one = fitted_with(problem, current, score.name, start) if slow else ranked
                failed = self.failing(stage, problem, current, one, score.name)
                if not failed:
                    return replace(self, current=one, found=self.with_name(score.name))
                places += failed == "calibration"
        return None

    def with_name(self, name: str) -> tuple[str, ...]:
        """The names found and another one, which takes the place of one of its class."""
        same = same_in_any_motion(self.problem, name)
        found = tuple(name if one in same else one for one in self.found)
        return found if name in found else (*found, name)

    def next_place(self, stage: int) -> "Search | None":
        """With the loss of traction in a time or a place that passes every gate, slip identified again."""
        whole, own = self.problem.with_slip, self.current
        current = at(whole, own.parameters, own.values, own.noises)
        passing = []
        for name in (c.name for c in self.candidates if c.name in PLACES and c.name not in own.values):
            place = likeliest(self.problem, own, name)
            if place is None:
                self.tried.append(Tried(stage, name, 0.0, 0.0, 1.0, "contact mode"))
                continue
            values = {**current.values, name: place}
            one = refit(whole, (*current.parameters, *parameters_of(name)), values, current.noises)
            if not self.failing(stage, whole, current, one, name):
                passing.append((one.minus_two_log, name, one))
        if not passing:
            return None
        least, name, one = min(passing, key=lambda entry: entry[0])
        close = tuple((other, cost - least) for cost, other, _ in passing if other != name)
        problem = ideal_only(self.problem, {name: one.values[name]}) if self.problem.whole else self.problem
        refitted = fit(problem, one.parameters, one.values, one.noises)
        found, rivals = (*self.found, name), {**self.rivals, name: close}
        return replace(self, problem=problem, current=refitted, found=found, rivals=rivals)

    def failing(self, stage: int, problem: Problem, before: Fit, after: Fit, name: str) -> str:
        """The gate that an effect does not pass, which is noted; empty where it passes all."""
        cost = price(problem, len(parameters_of(name)))
        gain = before.minus_two_log - after.minus_two_log
        p = p_value(after, name, len(self.candidates) * places_scanned(name))
        least = max(cost, problem.settings.gates.least_place_gain if name in PLACES else 0.0)
        failed = "significance" if gain < least else gate(problem, before, after, name, p)
        self.tried.append(Tried(stage, name, gain, gain - cost, p, failed))
        return failed


def simplest_first(problem: Problem, fits: list[tuple[Score, Fit]]) -> list[tuple[Score, Fit]]:
    """Candidates by BIC, the best first, but one as good as the best before it that is simpler, or as simple
    and earlier in the catalogue: lengths before slip. Within a class that is the same in any motion, more
    counts as good.
    """

    def cost(pair: tuple[Score, Fit]) -> float:
        return pair[1].minus_two_log + price(problem, len(pair[0].start))

    ranked = sorted(fits, key=cost)
    if not ranked:
        return []
    same = same_in_any_motion(problem, ranked[0][0].name)
    order = [one.name for one in candidates_of(problem.record)]

    def beyond(pair: tuple[Score, Fit]) -> float:
        return cost(pair) - cost(ranked[0]) - (SAME_BIC if pair[0].name in same else NEAR_BIC)

    near = [pair for pair in ranked if beyond(pair) < 0]
    first = min(near, key=lambda pair: (len(pair[0].start), order.index(pair[0].name)))
    return [first, *(pair for pair in ranked if pair is not first)]


def same_in_any_motion(problem: Problem, name: str) -> tuple[str, ...]:
    """The confound class of an effect alone, itself first."""
    driven_by: DrivenBy = "command" if problem.record.driven_by == "command" else "wheel_speed"
    return confound_class((name,), name, driven_by=driven_by)


def gate(problem: Problem, before: Fit, after: Fit, name: str, p: float) -> str:
    """The gate that an effect does not pass; empty where it passes all."""
    if is_of_calibration(problem, after, name) or hardly_turns(problem, name):
        return "calibration"
    if p > problem.settings.gates.level:
        return "significance"
    own, same = problem.settings.gates, same_in_any_motion(problem, name)
    slight = hardly_lower(problem.base, after.values, name, own.least_lowered)
    slight = slight or within_a_step(problem.record, after.values, name) or at_its_bound(after.values, name)
    if slight or not matters(after, name, same, own.least_relevant):
        return "tolerance"
    if not moves_path(problem, before.values, after.values):
        return "tolerance"
    if name in PLACES and not is_no_mode(problem, before, after, name):
        return "contact mode"
    return "" if holds_on_held_out(problem, before, after, name)[0] else "held-out gap"


def is_no_mode(problem: Problem, before: Fit, after: Fit, name: str) -> bool:
    """Whether a loss in a time or a place is more than a wheel that spins."""
    return steady_loss(problem, before, after, name) and stands_out(problem, before, after, name)


def places_scanned(name: str) -> int:
    """Times or places at which an effect was tried, for the correction of its p."""
    return MOST_CELLS**2 // 2 if name in PLACES else 1


def eliminated(search: Search) -> tuple[Fit, tuple[Named, ...]]:
    """The model less the effects that the others explain, and those that stay."""
    problem, current, names = search.problem, search.current, list(search.found)
    n_scanned, lesser = len(search.candidates), dict[str, Fit]()

    def p_of(name: str) -> float:
        return p_value(current, name, n_scanned * places_scanned(name))

    while names:
        lesser = {name: without(problem, current, name) for name in names}
        gains = {name: lesser[name].minus_two_log - current.minus_two_log for name in names}
        failing = [
            (gains[name], name)
            for name in names
            if is_needless(problem, current, name, gains[name], p_of(name))
        ]
        if not failing:
            break
        gain, weakest = min(failing)
        search.tried.append(Tried(len(search.found), weakest, gain, 0.0, p_of(weakest), "needed"))
        names.remove(weakest)
        current = fit(problem, lesser[weakest].parameters, lesser[weakest].values, current.noises)
    kept = [
        Named(
            name,
            p_of(name),
            search.rivals[name] if name in PLACES else alternatives(problem, current, lesser[name], name),
        )
        for name in names
    ]
    return current, tuple(kept)


def is_needless(problem: Problem, current: Fit, name: str, gain: float, p: float) -> bool:
    """Whether the others explain an effect, or with them a loss of traction is too small to be one."""
    own = problem.settings.gates
    if name in PLACES:
        return current.values[name]["loss"] < own.least_loss
    return p > own.level or gain < price(problem, len(parameters_of(name)))


def nearly_as_good(scores: tuple[Score, ...], name: str, near: float) -> list[Score]:
    """The other scores of at least the share ``near`` of that of ``name``.

    A score misjudges the gain of a large effect, and a rival's as well: they are compared to one another.
    """
    own = max((score.gain for score in scores if score.name == name), default=0.0)
    return [score for score in scores if score.name != name and score.gain > near * own]


def alternatives(problem: Problem, full: Fit, lesser: Fit, name: str) -> tuple[tuple[str, float], ...]:
    """Other candidates in the place of an effect that explain nearly as much, by their loss of BIC."""
    pool = tuple(
        c
        for c in candidates_of(problem.record)
        if c.name not in (*same_in_any_motion(problem, name), *full.values, *PLACES)
    )
    own = lesser.minus_two_log - full.minus_two_log - price(problem, len(parameters_of(name)))
    found = []
    scores = scan(problem, lesser, (*pool, DECLARED[name]))
    for score in nearly_as_good(scores, name, problem.settings.gates.near):
        extra = price(problem, len(score.start))
        values = {**lesser.values, score.name: absent(score.name) | score.start}
        rival = refit(problem, (*lesser.parameters, *parameters_of(score.name)), values, full.noises)
        if p_value(rival, score.name, len(pool)) > problem.settings.gates.level:
            continue
        if within_calibration(problem.base_sd, rival, score.name, problem.settings.gates):
            continue
        delta = own - (lesser.minus_two_log - rival.minus_two_log - extra)
        if delta < LISTED_BIC:
            found.append((score.name, max(float(delta), 0.0)))
    return tuple(sorted(found, key=lambda pair: pair[1])[:3])
