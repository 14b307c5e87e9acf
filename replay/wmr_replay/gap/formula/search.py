"""Beyond the library: a formula in the place of what the selection says, or beside it."""

from collections.abc import Iterable
from dataclasses import replace
from enum import Enum

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, evaluate, fit_model
from wmr_replay.gap.evidence.excitation import (
    gain_in_manoeuvres,
    torques_of,
)
from wmr_replay.gap.evidence.significance import correlation
from wmr_replay.gap.formula.answers import asked_of_answers, may_only_answer, shown_part
from wmr_replay.gap.formula.formula import Formula, unseen_between
from wmr_replay.gap.formula.gates import p_value_of
from wmr_replay.gap.formula.groups import (
    PRODUCT,
    TWINS,
    Group,
    groups_of,
    plain_groups,
    twins_of,
    without_twins,
)
from wmr_replay.gap.formula.grow import FORMULAS, grown_both_ways, pruned
from wmr_replay.gap.formula.library_again import effects_meant, library_again, why_not_named
from wmr_replay.gap.formula.modes import Start, is_likelier, may_slip_less
from wmr_replay.gap.formula.modulations import modulations_of_effects
from wmr_replay.gap.formula.named_within import with_names
from wmr_replay.gap.formula.other_modes import with_other_modes
from wmr_replay.gap.formula.part import middle_of
from wmr_replay.gap.formula.proven import Proven, library_of, proven
from wmr_replay.gap.formula.scores import excess, scored_groups
from wmr_replay.gap.formula.sides import two_sided
from wmr_replay.gap.formula.softness import with_own_softness
from wmr_replay.gap.formula.winners import winners
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.work import work_on
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import is_rest
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate, price_of
from wmr_replay.gap.search.select import Selection
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.signals import Log
from wmr_schemas.terms import COEFFICIENT, parse_term

LOAD_STEP = "load_step"


def with_formula(
    log: Log, problem: Problem, selection: Selection, extension: Extension, options: GapOptions
) -> tuple[Problem, Selection]:
    """The selection with a formula, where one explains what the selection leaves; else as it is.

    Where the library is refused, since what it would say may only answer the disturbance, a formula may
    still say what that is; not one of the efforts that answer it, unless manoeuvres show that.
    """
    if is_rest_of_base(problem, selection):
        return problem, selection
    whole = problem, selection
    problem, selection = held_out_apart(problem, replace(selection, refused=""))
    library, found = library_of(selection), None
    outside = points_outside(problem, selection)
    ways = ways_to_look(problem, selection, library, options) if outside else ()
    outside = bool(ways)
    if outside:
        found = best_formula(problem, selection, library, options, ways)
    hidden = not selection.found and may_slip_less(problem)
    if options.modes == "identified" and (outside or hidden):
        found = with_other_modes(log, problem, selection, found, extension, options)
    if found is None or (whole[1].refused and may_only_answer(found)):
        return whole
    if is_the_same(found.formula, selection):
        return stated_by(found, *whole)
    found = without_spare(found, library)
    kept = tuple(effect for effect in library if effect.name in found.formula.rest.extension.effects)
    said = with_names(found, selection_of(found, kept, selection), options)
    if library or library_of(said) or not effects_meant(found):
        return found.problem, said
    again = library_again(found, options)
    if stands(*again, found, problem, selection):
        left = not {*found.formula.names} <= twins_of(effects_meant(found))
        return with_formula(log, *again, extension, options) if left else again
    return found.problem, replace(said, not_named=why_not_named(found, again[1]))


class Way(Enum):
    """Where a formula stands."""

    BESIDE = "beside the library's effects"
    IN_PLACE = "in their place"


def ways_to_look(
    problem: Problem, selection: Selection, library: tuple[FittedCandidate, ...], options: GapOptions
) -> tuple[Way, ...]:
    """Where to look for a formula: of a long log whose library has a name, where its middle shows one, and
    there is work left for it. Where the library has none, a formula is looked for in any case.
    """
    if not library:
        return (Way.BESIDE,)
    if not work_on(problem.binned.log.pose).allows(FORMULAS):
        return ()
    part, base = middle_of(problem, selection.base)
    if part is problem:
        return tuple(Way)
    fit = evaluate(part, selection.fit.extension, selection.fit.noise)
    seen = replace(selection, base=base, fit=fit)
    found = best_formula(part, seen, library, options, tuple(Way)) if points_outside(part, seen) else None
    if found is None:
        return ()
    return (Way.BESIDE if found.formula.rest.extension.effects else Way.IN_PLACE,)


def stands(
    problem: Problem, selection: Selection, found: Proven, before: Problem, nothing: Selection
) -> bool:
    """Whether the library's effects with a formula's modes are likelier than nothing with the modes before,
    and explain as much as that formula.
    """
    if not selection.found or selection.refused:
        return False
    part, apart = held_out_apart(problem, selection)
    prices = sum(price_of(part, effect.scored, apart.fit) for effect in apart.found)
    named = Start(part, apart.fit, apart.base.extension, prices)
    if not is_likelier(named, Start(before, nothing.fit, nothing.base.extension)):
        return False
    return not explains_more(part, apart, found.formula)


def held_out_apart(problem: Problem, selection: Selection) -> tuple[Problem, Selection]:
    """The selection fitted to two thirds of the log: the other third decides how long a formula is."""
    part, budget, fits = problem.fold(0), problem.settings.budget, (selection.base, selection.fit)
    base, fit = (
        fit_model(part, one.extension, one.noise, budget.best_diffusion, budget.last_steps) for one in fits
    )
    return part, replace(selection, base=base, fit=fit)


def is_rest_of_base(problem: Problem, selection: Selection) -> bool:
    """Whether what is left may be a rest of the base model, which no formula is to describe.

    Beside what is named on a base that was calibrated on another log, everything else may be one: a mechanism
    acts on more than its effect says.
    """
    settings, stage = problem.settings, selection.stages[0] if selection.stages else ()
    if selection.base.extension.misfit and library_of(selection):
        return True
    return any(is_rest(one.name, one.fit.extension, settings.misfit) for one in stage)


def points_outside(problem: Problem, selection: Selection) -> bool:
    """Whether a disturbance is left that a formula may explain, or a constant effect seems to vary.

    A load step may be the coarse form of a drift, and several effects that of one law. Beside one effect of
    the library one pass asks whether a product or curve explains what it leaves, or a shape of its own terms.
    """
    settings, fit = problem.settings, selection.fit
    doubtful = len(selection.found) > 1 or any(
        f.name.startswith(UNNAMED_PREFIX) or f.name == LOAD_STEP for f in selection.found
    )
    left = calmed(fit.noise, settings.diffusion, settings.formula.something_left)
    if doubtful or left is not None or not selection.found:
        return doubtful or left is not None
    plain = without_twins(plain_groups(), fit.extension.effects)
    shapes = modulations_of_effects(problem, fit.extension.effects)
    found = [*scored_groups(problem, fit, plain)[:1], *winners(problem, fit, shapes)]
    return any(excess(problem, one) > settings.formula.margin for one in found)


def best_formula(
    problem: Problem,
    selection: Selection,
    library: tuple[FittedCandidate, ...],
    options: GapOptions,
    looked: tuple[Way, ...],
) -> Proven | None:
    """The formula beside the library's effects or in their place, where it is better than the selection."""
    tried = groups_of(problem.binned, problem.settings.formula)
    if library:
        selection = replace(
            selection, base=settled(problem, selection.base), fit=settled(problem, selection.fit)
        )
    ways: list[Formula] = []
    if Way.BESIDE in looked:
        rest = fit_of_library(problem, selection, library)
        ways += grown_both_ways(problem, rest, tried.beside(rest.extension.effects))
        if ways and not keeps_its_effects(ways[0], selection):
            ways += in_terms(problem, selection.base, ways[0])
    if Way.IN_PLACE in looked:
        ways += grown_both_ways(problem, selection.base, tried)
    if library:
        ways = [replace(f, fit=settled(problem, f.fit)) for f in ways]
    ways = [two_sided(problem, with_own_softness(problem, f)) for f in ways]
    ways = [shown_part(problem, selection, f) for f in ways]
    ways = [f for f in ways if explains_more(problem, selection, f)]
    ways.sort(key=lambda f: f.fit.deviance + f.price(problem) + library_price(problem, f, library))
    for formula in ways:
        found = proven(problem, selection.base, formula, tried, options)
        if found is None:
            continue
        if found.formula is formula or explains_more(problem, selection, found.formula):
            return found
    return None


def in_terms(problem: Problem, base: Fit, formula: Formula) -> list[Formula]:
    """A formula with the effects beside it written as terms of the dictionary, which they are a part of; none
    where one of them is no such term.
    """
    effects = formula.rest.extension.effects
    if not all(name in TWINS for name in effects):
        return []
    terms = [parse_term(UNNAMED_PREFIX + twin) for name in effects for twin in TWINS[name]]
    groups = (*(Group(PRODUCT, (term,)) for term in terms), *formula.groups)
    extension = base.extension
    for group in groups:
        for name in group.names:
            size = formula.fit.extension.effects.get(name, {COEFFICIENT: 0.0})
            extension = extension.with_effect(name, size)
    fit = fit_model(problem, extension, formula.fit.noise, problem.settings.budget.best_diffusion)
    return [pruned(problem, Formula(base, fit, groups))]


def settled(problem: Problem, fit: Fit) -> Fit:
    """The fit with its disturbances found from the start, where that is likelier.

    A model that follows another one begins with its disturbances, and a few iterations may leave it there:
    rivals are held against each other where both have what they need.
    """
    budget = problem.settings.budget
    again = fit_model(problem, fit.extension, None, budget.base_diffusion, budget.last_steps)
    return min(fit, again, key=lambda one: one.deviance)


def fit_of_library(problem: Problem, selection: Selection, library: tuple[FittedCandidate, ...]) -> Fit:
    """The fit of the base model with the library's effects alone."""
    if len(library) == len(selection.found):
        return selection.fit
    extension = selection.base.extension.as_in(selection.fit.extension)
    for effect in library:
        extension = extension.with_effect(effect.name, selection.fit.extension.effects[effect.name])
    return fit_model(problem, extension, selection.fit.noise) if library else selection.base


def library_price(problem: Problem, formula: Formula, library: tuple[FittedCandidate, ...]) -> float:
    """The price of the library's effects that stand beside a formula."""
    kept = formula.rest.extension.effects
    return sum(price_of(problem, effect.scored, formula.rest) for effect in library if effect.name in kept)


def explains_more(problem: Problem, selection: Selection, formula: Formula) -> bool:
    """Whether a formula is better than the selection by what the wrong form of its effects may leave.

    What was named for good reasons gives way, or gets a formula beside it, only where manoeuvres are
    likelier. The rows that were not fitted count, too: half as many, they may lose no more than half of what
    the fitted ones gain.
    """
    own = problem.settings.formula
    if is_the_same(formula, selection) or not keeps_its_effects(formula, selection):
        return False
    in_manoeuvres = gain_in_manoeuvres(selection.fit, formula.fit)
    prices = sum(price_of(problem, effect.scored, selection.fit) for effect in selection.found)
    library = library_of(selection)
    price = formula.price(problem) + library_price(problem, formula, library) - prices
    excess = selection.fit.deviance - formula.fit.deviance - price
    if not library or len(library) < len(selection.found):
        known = {torques_of(f.name) for f in selection.found}
        asked = asked_of_answers(problem, selection.fit, formula, known)
        shown = not asked or in_manoeuvres > asked
        return shown and excess > own.margin * bool(selection.found)
    unseen = unseen_between(problem, selection.fit, formula.fit)
    asked = min(max(price, 0.0), asked_of_answers(problem, selection.fit, formula))
    if unseen < min(0.0, -excess / 2) or in_manoeuvres <= asked:
        return False
    share = own.beyond_library if is_of_their_quantities(formula, selection) else 0.0
    wrong_form = share * (selection.base.deviance - selection.fit.deviance)
    if formula.rest.extension.effects:
        return excess + unseen > max(own.beyond_margin, 0.0 if is_apart(problem, formula) else wrong_form)
    is_part = {*formula.names} <= twins_of(effect.name for effect in selection.found)
    fewer = n_numbers(formula) < len(selection.fit.keys)
    simpler = LOAD_STEP in selection.fit.extension.effects or fewer or is_part
    return excess + unseen > (own.margin if simpler else max(own.beyond_margin, wrong_form))


def is_of_their_quantities(formula: Formula, selection: Selection) -> bool:
    """Whether a formula may be the right form of the selection's effects: it reads nothing else than they do,
    or one of them is no term.
    """
    effects = [effect.name for effect in selection.found]
    own = {column for name in twins_of(effects) for column in parse_term(name).columns}
    read = {column for group in formula.groups for column in group.columns}
    return read <= own or not all(name in TWINS for name in effects)


def is_the_same(formula: Formula, selection: Selection) -> bool:
    """Whether a formula only writes as terms what the library has a name for, and the selection says.

    What an effect does to one channel is not the effect, where that does something to the other one, too.
    """
    names = {*formula.names}
    twins = [twins_of([effect.name]) for effect in selection.found]
    return names <= set().union(*twins) and all(
        channels_of(names & some) in (set(), channels_of(some)) for some in twins
    )


def channels_of(names: Iterable[str]) -> set[str]:
    """The channels of terms."""
    return {parse_term(name).channel for name in names}


def without_spare(found: Proven, library: tuple[FittedCandidate, ...]) -> Proven:
    """The formula without the library's effects that explain less beside it than they cost."""
    problem, iterations = found.problem, found.problem.settings.budget.best_diffusion
    for effect in library:
        formula = found.formula
        if effect.name not in formula.rest.extension.effects:
            continue
        rest, fit = (
            fit_model(problem, one.extension.without(effect.name), one.noise, iterations)
            for one in (formula.rest, formula.fit)
        )
        if fit.deviance - formula.fit.deviance < price_of(problem, effect.scored, formula.fit):
            found = replace(found, formula=replace(formula, rest=rest, fit=fit))
    return found


def stated_by(found: Proven, problem: Problem, selection: Selection) -> tuple[Problem, Selection]:
    """The selection without effects that a formula of the others' own terms does without."""
    names = {*found.formula.names}
    needed = [effect for effect in selection.found if twins_of([effect.name]) & names]
    if len(needed) == len(selection.found):
        return problem, selection
    problem, extension = replace(found.problem, train=problem.train), found.base.extension
    for effect in needed:
        extension = extension.with_effect(effect.name, selection.fit.extension.effects[effect.name])
    fit = fit_model(problem, extension, found.formula.fit.noise)
    base = fit_model(problem, found.base.extension, found.base.noise)
    return problem, replace(
        selection, base=base, fit=fit, found=tuple(replace(effect, fit=fit) for effect in needed)
    )


def n_numbers(formula: Formula) -> int:
    """How many numbers a formula has."""
    return sum(len(group.terms) + len(group.shape) for group in formula.groups)


def keeps_its_effects(formula: Formula, selection: Selection) -> bool:
    """Whether the library's effects beside a formula keep their sizes to a factor: else they are part of a
    curve, and not themselves.
    """
    most = formula.fit.problem.settings.formula.most_change
    for name in formula.rest.extension.effects:
        alone, beside = (fit.extension.effects[name] for fit in (selection.fit, formula.fit))
        size, left = (float(np.hypot.reduce(list(values.values()))) for values in (alone, beside))
        if not size / most <= left <= size * most:
            return False
    return True


def is_apart(problem: Problem, formula: Formula) -> bool:
    """Whether no term is correlated with the library's effects beside the formula."""
    most, fit = problem.settings.selection.correlated, formula.fit
    return all(correlation(problem, fit, name) <= most for name in formula.rest.extension.effects)


def selection_of(found: Proven, library: tuple[FittedCandidate, ...], before: Selection) -> Selection:
    """The selection with the formula's terms as its last effects."""
    problem, formula = found.problem, found.formula
    p_value = p_value_of(problem, formula)
    terms = []
    for group in formula.groups:
        for name in group.names:
            values = {COEFFICIENT: formula.fit.extension.effects[name][COEFFICIENT]}
            scored = ScoredCandidate(name, values, formula.gain, group.n_tried)
            score = formula.gain - formula.price(problem)
            terms.append(
                FittedCandidate(scored, formula.fit, formula.gain, score, p_value, proof=found.proof)
            )
    kept = tuple(replace(effect, fit=formula.fit) for effect in library)
    return Selection(found.base, formula.fit, (*kept, *terms), (*before.stages, tuple(terms)))
