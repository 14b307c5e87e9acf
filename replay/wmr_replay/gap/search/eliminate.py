"""Backward elimination: each effect must be needed and proven beside the others."""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.covariance import robust_covariance
from wmr_replay.gap.estimation.own_form import freedom_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.estimation.sideslip import most_compliance
from wmr_replay.gap.evidence.answer import answer_p
from wmr_replay.gap.evidence.beside_rests import beside_rests
from wmr_replay.gap.evidence.channels import seen_in_one_channel
from wmr_replay.gap.evidence.excitation import excitation_ratios
from wmr_replay.gap.evidence.holdout import path_change, prove
from wmr_replay.gap.evidence.one_place import TYRES
from wmr_replay.gap.evidence.placebo import placebo_p
from wmr_replay.gap.evidence.significance import correlation, size_columns
from wmr_replay.gap.evidence.spread import least_size
from wmr_replay.gap.model.candidates import LOCAL, SKID
from wmr_replay.gap.model.extension import STIFFEST, WEIGHTS, Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import (
    IN_PARAMETERS,
    LOADED,
    gain_is_rest,
    hidden_by_answer,
    is_rest,
    is_slight_term,
    may_be_rest,
    surely_left,
    withholds_a_rest,
)
from wmr_replay.gap.scan.turning_in_doubt import terms_in_doubt
from wmr_replay.gap.search.fit_candidates import (
    ANSWERED,
    ONE_CHANNEL,
    FittedCandidate,
    fine_costs,
    price_of,
)
from wmr_replay.gap.search.slip_test import may_be_slipping
from wmr_replay.gap.settings.search import SelectionSettings
from wmr_schemas.effects import UNNAMED_PREFIX

REST = "no more than the base model leaves"
UNPROVEN = "not proven on held-out windows"
Stages = tuple[tuple[FittedCandidate, ...], ...]


def exchange_rivals(
    problem: Problem, current: Fit, found: list[FittedCandidate], stages: Stages
) -> tuple[Fit, list[FittedCandidate]]:
    """The effects with near rivals tried in their places, beside all others.

    An effect that was found while others were still missing may have been the wrong one.
    """
    own = problem.settings.selection
    for i, effect in enumerate(found[:-1]):
        names = [f.name for f in found]
        near = stages[i][1 : 1 + own.most_rivals]
        rivals = [
            a for a in near if effect.score - a.score < own.rival and a.name not in names and not a.failed
        ]
        if rivals:
            in_place = [fitted_in_place_of(effect, rival, problem, current) for rival in rivals]
            found[i] = best_in_place(problem, effect, current, in_place)
            current = found[i].fit
    return current, found


def fitted_in_place_of(
    effect: FittedCandidate, rival: FittedCandidate, problem: Problem, current: Fit
) -> FittedCandidate:
    """The rival fitted in place of an effect of the current model."""
    rest = current.extension.without(effect.name)
    if free := freedom_of(rival.name):
        rest = rest.in_form(free, getattr(rival.fit.extension, free))
    if rival.name == "slope":
        rest = replace(rest, held_sideways=rival.fit.extension.held_sideways)
    extension = rest.with_effect(rival.name, rival.fit.extension.effects[rival.name])
    fit = fit_model(problem, extension, current.noise, problem.settings.budget.ranked_diffusion)
    return replace(rival, fit=fit)


def best_in_place(
    problem: Problem, effect: FittedCandidate, current: Fit, rivals: list[FittedCandidate]
) -> FittedCandidate:
    """The effect or the rival that explains most in fine bins, the others as its alternatives."""
    here = [replace(effect, fit=current), *rivals]
    costs = fine_costs(problem, here)
    best = int(np.argmin(costs))
    deltas = [(a.name, c - costs[best]) for a, c in zip(here, costs, strict=True) if a is not here[best]]
    return replace(
        here[best],
        alternatives=tuple(deltas),
        p_value=max(effect.p_value, here[best].p_value),
        correlation=effect.correlation,
    )


def eliminate(
    problem: Problem,
    base: Fit,
    current: Fit,
    found: list[FittedCandidate],
    options: GapOptions,
    dropped: list[FittedCandidate],
) -> tuple[Fit, list[FittedCandidate]]:
    """The effects that pass every gate beside the others.

    While some fail, the weakest of those is dropped, and the rest is tested again; ``dropped`` takes it.
    """
    current, found = with_tyres_of_payload(problem, current, found)
    while found:
        rests = [fit_without(problem, base, current, f.name) for f in found]
        found = [replace(f, gain=r.deviance - current.deviance) for f, r in zip(found, rests, strict=True)]
        tested = [
            through_gates(problem, current, f, r, found, options) for f, r in zip(found, rests, strict=True)
        ]
        failed = [f for f in tested if f.failed]
        if not failed:
            return current, tested
        weakest = min(failed, key=lambda f: f.gain)
        dropped.append(weakest)
        found = [f for f in found if f.name != weakest.name]
        current = fit_without(problem, base, current, weakest.name)
    return base, []


def through_gates(
    problem: Problem,
    current: Fit,
    effect: FittedCandidate,
    rest: Fit,
    others: list[FittedCandidate],
    options: GapOptions,
) -> FittedCandidate:
    """One of the current model's effects compared with ``rest``, the same model without it, up to the first
    gate that it fails.
    """
    if effect.gain < price_of(problem, effect.scored, current) + margin_for(problem, current, effect):
        return replace(effect, failed="needless beside the others")
    if other := other_cause(problem, current, effect, rest, others):
        return replace(effect, failed=other)
    proof = prove(problem, rest, current)
    if not proof.holds:
        return replace(effect, proof=proof, failed=UNPROVEN)
    level = problem.settings.significance.level
    if placebo_p(problem, rest, current, effect.name, options.seed) > level:
        return replace(effect, proof=proof, failed="no more than what logs with nothing missing would show")
    shown, is_tyre = shown_part(problem, current, effect.name), effect.name == TYRES
    moved_m = path_change(problem, rest, shown, options.tolerance_s, same_start=is_tyre)
    small = moved_m < options.tolerance_m
    return replace(effect, proof=proof, failed="moves the path by less than the tolerance" if small else "")


def shown_part(problem: Problem, fit: Fit, name: str) -> Fit:
    """The model with those components of an effect alone that the log shows: a pose a millimetre ahead of the
    axle, surely, and some centimetres beside it, perhaps, moves the path by what is sure.
    """
    columns = size_columns(fit, name)
    if len(columns) == 1:
        return fit
    sd = np.sqrt(np.diag(robust_covariance(problem, fit)[0])[columns])
    is_shown = np.abs(fit.values[columns]) > problem.settings.significance.component_sd * sd
    if is_shown.all() or not is_shown.any():
        return fit
    parameters = dict(fit.extension.effects[name])
    parameters |= {fit.keys[j][1]: 0.0 for j, shows in zip(columns, is_shown, strict=True) if not shows}
    return replace(fit, extension=fit.extension.with_effect(name, parameters))


def other_cause(
    problem: Problem, current: Fit, effect: FittedCandidate, rest: Fit, others: list[FittedCandidate]
) -> str:
    """What an effect may be in place of one that is missing; empty where it is none of these."""
    beside = stronger(effect, others)
    one = may_be_a_rest(problem, current, rest, effect.name, beside=beside)
    if one or may_be_rests(problem, current, effect.name, alone=not beside):
        return REST
    if is_remainder(problem, current, effect, others):
        return "a remainder of the others"
    without = current.extension.without(effect.name)
    if answer_p(problem, without, current, effect.name) > problem.settings.significance.level:
        return ANSWERED
    if seen_in_one_channel(problem, current, effect.name):
        return ONE_CHANNEL
    if may_be_slipping(problem, current, effect.name):
        return "no other than the model's own slipping"
    return ""


def stronger(effect: FittedCandidate, others: list[FittedCandidate]) -> set[str]:
    """The names of the others that explain no less than an effect does."""
    return {one.name for one in others if one.name != effect.name and one.gain >= effect.gain}


def is_creep(name: str, problem: Problem, extension: Extension) -> bool:
    """Whether an undeclared skid is the elastic sideslip of tyres that grip, which no label misses: of the
    stiffest tyres, or no more than tyres of robots show.
    """
    if name != SKID:
        return False
    most = max(1 / STIFFEST, most_compliance(problem, extension))
    return extension.effects[name]["stiffness_ratio"] * most >= 1


def same_tyres(name: str, extension: Extension, own: SelectionSettings) -> bool:
    """Whether another cornering stiffness differs by no more than one and the same tyre's does, or by more
    than any tyre's: then wheels hardly skid where they are said to.
    """
    if name != TYRES:
        return False
    ratio = extension.effects[name]["ratio"]
    return abs(ratio) < own.known_stiffness or ratio > own.most_stiffer


def may_be_a_rest(problem: Problem, current: Fit, rest: Fit, name: str, *, beside: set[str]) -> bool:
    """Whether an effect is not clearly more than what the base model leaves on its calibration log and, of a
    calibrated parameter, what a controller hides of it on this one; or a term no more than what the base
    model does not know of turning, or slight; or tyres that are the same, or creep. ``rest`` is the model
    without it; ``beside`` are effects that explain more: it does not stand beside what explains less.
    """
    own, extension = problem.settings.misfit, current.extension
    alone = extension.only({name, *beside})
    if same_tyres(name, extension, problem.settings.selection) or is_creep(name, problem, extension):
        return True
    if is_rest(name, alone, own) or withholds_a_rest(name, problem, extension, own):
        return True
    if name == "drive_gain" and gain_is_rest(extension, own):
        return True
    left = left_of(name, problem, alone, rest)
    if left > 0 and least_size(problem, current, name, own.in_sd) <= left:
        return True
    in_doubt = terms_in_doubt(extension, problem.binned, [name])
    return in_doubt or is_slight_term(name, extension, problem.binned, own)


def left_of(name: str, problem: Problem, alone: Extension, rest: Fit) -> float:
    """What the base model surely leaves of an effect and, of a calibrated parameter, a controller hides; of a
    weight put on meanwhile, what they leave of a payload.
    """
    own = problem.settings.misfit
    if name == LOADED:
        name, alone = "payload", alone.without(LOADED)
    left = surely_left(name, alone, own)
    if left <= 0 or name not in IN_PARAMETERS:
        return left
    times = own.other_drives if name == "yaw_inertia" else 1.0
    ratios = excitation_ratios(problem, rest.extension, rest.noise)
    return left + times * hidden_by_answer(ratios, name, own)


def may_be_rests(problem: Problem, current: Fit, name: str, *, alone: bool) -> bool:
    """Whether rests of a calibrated base model at their likeliest sizes explain most of an effect, and may
    explain all of it. Of one that is not ``alone``, since others explain more, more must be left than a rest.
    """
    own, extension = problem.settings.misfit, current.extension
    if not extension.misfit or name.startswith(UNNAMED_PREFIX) or not may_be_rest(name):
        return False
    left = beside_rests(problem, current, name)
    if alone:
        return left.share < own.least_beside_rests and left.least <= 0
    return left.least <= surely_left(name, extension, own)


def is_remainder(
    problem: Problem, current: Fit, effect: FittedCandidate, found: list[FittedCandidate]
) -> bool:
    """Whether an effect explains no more than the wrong form of another one leaves.

    The order in which effects are found is an accident: a gain that is found first may be what a saturation
    leaves that is found behind it.
    """
    if effect.name in WEIGHTS:
        return False
    own = problem.settings.selection
    most = max((f.gain for f in found if f.name not in (effect.name, *WEIGHTS)), default=0.0)
    if effect.gain >= own.remainder_share * most:
        return False
    return correlation(problem, current, effect.name) > own.correlated


def with_tyres_of_payload(
    problem: Problem, current: Fit, found: list[FittedCandidate]
) -> tuple[Fit, list[FittedCandidate]]:
    """The model and its effects, a cornering stiffness taken as known where a payload beside it causes it.

    A skid decays with 2 G_x/(ε m): a heavier robot looks like one with softer tyres, by 1/(1 + mass_ratio).
    """
    extension = current.extension
    tyres, load = (extension.effects.get(name) for name in (TYRES, "payload"))
    if tyres is None or load is None:
        return current, found
    by_mass = 1 / (1 + load["mass_ratio"]) - 1
    if abs(tyres["ratio"] - by_mass) > problem.settings.selection.same_stiffness * abs(by_mass):
        return current, found
    known = (*extension.known, (TYRES, dict(tyres)))
    extension = replace(extension.without(TYRES), known=known)
    current = fit_model(problem, extension, current.noise, problem.settings.budget.without_diffusion)
    return current, [f for f in found if f.name != TYRES]


def margin_for(problem: Problem, current: Fit, effect: FittedCandidate) -> float:
    """What an effect must explain beyond its price, in units of deviance; nothing for an only one. A term
    beside an effect of the library must explain as much as a formula there.
    """
    own = problem.settings.selection
    if len(current.extension.effects) == 1:
        return 0.0
    if is_term(effect.name) and not all(map(is_term, current.extension.effects)):
        return problem.settings.formula.beyond_margin
    return own.margin_identified if problem.binned.identified and effect.name in LOCAL else own.margin


def is_term(name: str) -> bool:
    """Whether an effect is a term of the dictionary."""
    return name.startswith(UNNAMED_PREFIX)


def fit_without(problem: Problem, base: Fit, current: Fit, name: str) -> Fit:
    """The model fitted again with one effect fewer."""
    rest = current.extension.without(name)
    if not rest.effects:
        return base
    return fit_model(problem, rest, base.noise, problem.settings.budget.without_diffusion)
