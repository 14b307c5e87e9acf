"""Beyond the library: a formula in the place of what the selection says, or beside it."""

from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit, fit_model, gauss_newton
from wmr_replay.gap.estimation.relabel import with_mode_at
from wmr_replay.gap.evidence.holdout import Proof
from wmr_replay.gap.evidence.significance import correlation
from wmr_replay.gap.formula.gates import p_value_of, why_not
from wmr_replay.gap.formula.groups import groups_of, without_twins
from wmr_replay.gap.formula.grow import Formula, grow
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import is_rest
from wmr_replay.gap.scan.score import ScoredCandidate
from wmr_replay.gap.search.fit_candidates import FittedCandidate, price_of
from wmr_replay.gap.search.modes_and_effects import cost_of
from wmr_replay.gap.search.select import Selection
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log
from wmr_schemas.terms import COEFFICIENT

LOAD_STEP = "load_step"


@dataclass(frozen=True, eq=False)
class Proven:
    """A formula that passes the gates on a problem."""

    problem: Problem
    base: Fit
    formula: Formula
    proof: Proof

    @property
    def cost(self) -> float:
        """The cost of modes, model and terms."""
        return cost_of(self.problem, self.formula.fit) + self.formula.price(self.problem)


def with_formula(
    log: Log, problem: Problem, selection: Selection, extension: Extension, options: GapOptions
) -> tuple[Problem, Selection]:
    """The selection with a formula, where one explains what the selection leaves; else as it is."""
    if selection.refused or not points_outside(problem, selection):
        return problem, selection
    whole = problem, selection
    problem, selection = held_out_apart(*whole)
    library = library_of(selection)
    found = best_formula(problem, selection, library, options)
    if options.modes == "identified":
        if found is not None:
            found = with_own_modes(log, found, extension, options)
        else:
            found = without_slip(log, problem, selection, extension, options)
    if found is None:
        return whole
    kept = library if found.formula.rest.extension.effects else ()
    return found.problem, selection_of(found, kept, selection)


def held_out_apart(problem: Problem, selection: Selection) -> tuple[Problem, Selection]:
    """The selection fitted to two thirds of the log: the other third decides how long a formula is."""
    part, steps = problem.fold(0), problem.settings.hold_out.refit_steps
    fits = selection.base, selection.fit
    base, fit = (gauss_newton(part, one.extension, one.noise, steps) for one in fits)
    return part, replace(selection, base=base, fit=fit)


def library_of(selection: Selection) -> tuple[FittedCandidate, ...]:
    """The effects of the library in a selection."""
    return tuple(f for f in selection.found if not f.name.startswith(UNNAMED_PREFIX))


def points_outside(problem: Problem, selection: Selection) -> bool:
    """Whether a disturbance is left that a formula may explain, and no rest of the base model.

    A load step may be the coarse form of a drift. Beside what is named on a base that was calibrated on
    another log, everything else may be a rest: a mechanism acts on more than its effect says.
    """
    settings, stage = problem.settings, selection.stages[0] if selection.stages else ()
    if selection.base.extension.misfit and library_of(selection):
        return False
    if any(is_rest(one.name, one.fit.extension, settings.misfit) for one in stage):
        return False
    doubtful = any(f.name.startswith(UNNAMED_PREFIX) or f.name == LOAD_STEP for f in selection.found)
    left = calmed(selection.fit.noise, settings.diffusion, settings.formula.something_left)
    return doubtful or left is not None


def best_formula(
    problem: Problem, selection: Selection, library: tuple[FittedCandidate, ...], options: GapOptions
) -> Proven | None:
    """The formula beside the library's effects or in their place, where it is better than the selection."""
    groups = groups_of(problem.binned, problem.settings.formula)
    rest = fit_of_library(problem, selection, library)
    ways = [grow(problem, rest, without_twins(groups, rest.extension.effects))]
    if library:
        ways.append(grow(problem, selection.base, groups))
    ways = [f for f in ways if f.groups and explains_more(problem, selection, f)]
    ways.sort(key=lambda f: f.fit.deviance + f.price(problem) + library_price(problem, f, library))
    for formula in ways:
        failed, proof = why_not(problem, formula, groups, options)
        if not failed and proof is not None:
            return Proven(problem, selection.base, formula, proof)
    return None


def fit_of_library(problem: Problem, selection: Selection, library: tuple[FittedCandidate, ...]) -> Fit:
    """The fit of the base model with the library's effects alone."""
    if len(library) == len(selection.found):
        return selection.fit
    extension = selection.base.extension
    for effect in library:
        extension = extension.with_effect(effect.name, selection.fit.extension.effects[effect.name])
    return fit_model(problem, extension, selection.fit.noise) if library else selection.base


def library_price(problem: Problem, formula: Formula, library: tuple[FittedCandidate, ...]) -> float:
    """The price of the library's effects that stand beside a formula."""
    kept = formula.rest.extension.effects
    return sum(price_of(problem, effect.scored, formula.rest) for effect in library if effect.name in kept)


def explains_more(problem: Problem, selection: Selection, formula: Formula) -> bool:
    """Whether a formula is better than the selection by what the wrong form of its effects may leave."""
    own = problem.settings.formula
    prices = sum(price_of(problem, effect.scored, selection.fit) for effect in selection.found)
    library = library_of(selection)
    mine = formula.fit.deviance + formula.price(problem) + library_price(problem, formula, library)
    excess = selection.fit.deviance + prices - mine
    if not library or len(library) < len(selection.found):
        return excess > own.margin * bool(selection.found)
    share = own.beyond_library
    if LOAD_STEP in selection.fit.extension.effects and not formula.rest.extension.effects:
        return excess > own.margin
    if formula.rest.extension.effects and is_apart(problem, formula):
        share = 0.0
    return excess > max(own.beyond_margin, share * (selection.base.deviance - selection.fit.deviance))


def is_apart(problem: Problem, formula: Formula) -> bool:
    """Whether no term is correlated with the library's effects beside the formula."""
    most, fit = problem.settings.selection.correlated, formula.fit
    return all(correlation(problem, fit, name) <= most for name in formula.rest.extension.effects)


def with_own_modes(log: Log, found: Proven, extension: Extension, options: GapOptions) -> Proven:
    """The formula found again with the modes that the identifier sees with it, where those are likelier."""
    again = seen_with(log, found.formula, extension, options)
    return again if again is not None and again.cost < found.cost else found


def without_slip(
    log: Log, problem: Problem, selection: Selection, extension: Extension, options: GapOptions
) -> Proven | None:
    """A formula that explains what an identifier calls slipping, where that is likelier than the selection.

    It is grown where all slipping counts as rolling, and then found again with the modes that the identifier
    sees with it.
    """
    slips = problem.binned.slips
    if np.mean(slips) <= problem.settings.modes.much_slip:
        return None
    rolling = problem.relabelled(with_mode_at(problem.binned, slips, ContactMode.IDEAL))
    base = fit_model(rolling, extension, None, rolling.settings.budget.base_diffusion)
    rough = grow(rolling, base, groups_of(rolling.binned, rolling.settings.formula))
    if not rough.groups:
        return None
    found = seen_with(log, rough, extension, options)
    prices = sum(price_of(problem, effect.scored, selection.fit) for effect in selection.found)
    return found if found is not None and found.cost < cost_of(problem, selection.fit) + prices else None


def seen_with(log: Log, formula: Formula, extension: Extension, options: GapOptions) -> Proven | None:
    """A proven formula with the modes that the identifier sees with ``formula``, grown from the start."""
    track = likely_modes(log, formula.fit.extension, options.gates)
    problem = Problem.of(bin_identified(log, track, options.gates))
    base = rest = fit_model(problem, extension, None, problem.settings.budget.base_diffusion)
    if formula.rest.extension.effects:
        rest = fit_model(problem, formula.rest.extension, formula.rest.noise)
    groups = groups_of(problem.binned, problem.settings.formula)
    again = grow(problem, rest, without_twins(groups, rest.extension.effects))
    if not again.groups:
        return None
    failed, proof = why_not(problem, again, groups, options)
    return Proven(problem, base, again, proof) if not failed and proof is not None else None


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
