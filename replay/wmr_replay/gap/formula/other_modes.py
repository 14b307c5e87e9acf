"""Formulas found together with the contact modes that are seen with them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from wmr_replay.gap.estimation.diffusion import no_more_than_calm
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.evidence.excitation import gain_in_manoeuvres
from wmr_replay.gap.formula.groups import Tried, groups_of, plain_groups
from wmr_replay.gap.formula.grow import grow, grown_both_ways, pruned
from wmr_replay.gap.formula.modes import (
    Start,
    curve_starts,
    is_calm,
    is_likelier,
    likeliest,
    may_slip_less,
    once_more,
    rolling_starts,
    sees_the_same,
    whole_cost,
)
from wmr_replay.gap.formula.part import is_long, middle_of
from wmr_replay.gap.formula.proven import Proven, library_of, proven
from wmr_replay.gap.formula.unlabelled import unlabelled_starts
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.fit_candidates import price_of
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.slip_doubts import slips_as_modelled
from wmr_replay.gap.search.whatever_modes import all_rolling, unlabelled_deviance
from wmr_schemas.signals import Log


def with_other_modes(
    log: Log,
    problem: Problem,
    selection: Selection,
    found: Proven | None,
    extension: Extension,
    options: GapOptions,
) -> Proven | None:
    """The formula found again with modes that are seen with a formula, where those are likelier.

    An identifier takes an acceleration that its model lacks for slipping. So every curve that explains
    something is a model to identify with; the likeliest one is grown from the start.
    """
    if found is not None and is_long(problem):
        return with_its_modes(log, problem, found, options)
    seen = seen_with_curves(log, problem, selection, found, options)
    best = likeliest(seen)
    if best is None:
        return found
    best = that_takes_place(best, problem, selection) if found is None else grown_from(best)
    if best is None:
        return found
    for again in proven_with(log, best, extension, options):
        if found is not None and is_likelier(again.model, found.model):
            return again
        if found is None and takes_place(again.model, problem, selection):
            return again
    return found


def with_its_modes(log: Log, problem: Problem, found: Proven, options: GapOptions) -> Proven:
    """What is found on a long log with the modes that are seen with it, where that is likelier.

    On short logs every curve is a model to identify with; the longer a log, the more sees to it that what is
    found first is what is there, and the more each of them costs.
    """
    seen = once_more(log, found.model, options)
    if sees_the_same(seen.problem, problem):
        return found
    rest = fit_model(seen.problem, found.formula.rest.extension, seen.fit.noise)
    base = fit_model(seen.problem, found.base.extension, seen.fit.noise)
    formula = pruned(seen.problem, replace(found.formula, rest=rest, fit=seen.fit))
    again = proven(
        seen.problem, base, formula, groups_of(seen.problem.binned, problem.settings.formula), options
    )
    return again if again is not None and is_likelier(again.model, found.model) else found


def seen_with_curves(
    log: Log, problem: Problem, selection: Selection, found: Proven | None, options: GapOptions
) -> list[Start]:
    """What is found, and groups, with the modes that are seen with each; empty where there is
    nothing to look for: modes that stay the same, or slipping that follows the model.
    """
    seen = [] if found is None else [once_more(log, found.model, options)]
    if found is not None and is_calm(found.model) and sees_the_same(seen[0].problem, problem):
        return []
    part, base = middle_of(problem, selection.base)
    starts = unlabelled_starts(part, base)
    if found is None and library_of(selection):
        price = named(problem, selection).price
        beside = unlabelled_starts(*middle_of(problem, selection.fit))
        starts += [replace(one, price=one.price + price) for one in beside]
    if not starts and found is None and slips_as_modelled(problem, selection.base):
        return []
    if not starts:
        starts = curve_starts(part, base)
        if found is None and may_slip_less(problem):
            starts += rolling_starts(part, base)
    if found is None and selection.found:
        starts = not_hopeless(starts, problem, selection)
    return seen + [once_more(log, start, options) for start in starts]


def not_hopeless(starts: Sequence[Start], problem: Problem, selection: Selection) -> list[Start]:
    """The starts that may be as likely as the selection's effects, whatever the modes are.

    An identifier that is asked with each of them costs far more than a likelihood that sums over the modes.
    Disturbances are calm, so that they do not explain what a model lacks.
    """
    settings = problem.settings
    noise = no_more_than_calm(selection.base.noise, settings.diffusion)
    deviance = unlabelled_deviance(all_rolling(problem), noise)
    most = deviance(selection.fit.extension).sum() + named(problem, selection).price + settings.modes.hopeless
    return [one for one in starts if not deviance(one.fit.extension).sum() + one.price > most]


def takes_place(start: Start, problem: Problem, selection: Selection) -> bool:
    """Whether a formula with its modes is likelier than the selection on ``problem``, and explains more than
    the selection's effects with the formula's modes, too; where these are all of the library, by what their
    wrong form may leave.
    """
    before = named(problem, selection)
    if not is_likelier(start, before):
        return False
    if not selection.found:
        return True
    other = fit_model(start.problem, selection.fit.extension, selection.fit.noise)
    price, own = start.price - before.price, problem.settings.formula
    excess = other.deviance - start.fit.deviance - price
    if len(library_of(selection)) < len(selection.found):
        return excess > 0
    if gain_in_manoeuvres(other, start.fit) <= max(price, 0.0):
        return False
    base = fit_model(start.problem, selection.base.extension, selection.base.noise)
    return excess > max(own.margin, own.beyond_library * (base.deviance - other.deviance))


def grown_from(start: Start) -> Start:
    """The start with the products and curves that explain most with its modes, where that is likelier."""
    if is_calm(start):
        return start
    problem, budget = start.problem, start.problem.settings.budget
    rest = fit_model(problem, start.rest, None, budget.base_diffusion)
    formula = grow(problem, rest, Tried(plain_groups()).beside(rest.extension.effects))
    grown = replace(start, fit=formula.fit, price=formula.price(problem))
    return min(start, grown, key=whole_cost) if formula.groups else start


def that_takes_place(start: Start, problem: Problem, selection: Selection) -> Start | None:
    """A start that takes the selection's place, or where it is nearly as likely, a formula grown with its
    modes that does; none where there is no such formula.
    """
    if takes_place(start, problem, selection):
        return grown_from(start)
    if whole_cost(start) > whole_cost(named(problem, selection)) + problem.settings.modes.hopeless:
        return None
    there, budget = start.problem, problem.settings.budget
    rest = fit_model(there, start.rest, None, budget.base_diffusion)
    beside = named(problem, selection).price if rest.extension.effects else 0.0
    tried = groups_of(there.binned, problem.settings.formula).beside(rest.extension.effects)
    grown = (
        replace(start, fit=formula.fit, price=beside + formula.price(there))
        for formula in grown_both_ways(there, rest, tried)
    )
    return next((one for one in grown if takes_place(one, problem, selection)), None)


def named(problem: Problem, selection: Selection) -> Start:
    """The selection as a model with its modes."""
    prices = sum(price_of(problem, effect.scored, selection.fit) for effect in selection.found)
    return Start(problem, selection.fit, selection.base.extension, prices)


def proven_with(log: Log, start: Start, extension: Extension, options: GapOptions) -> Iterator[Proven]:
    """The proven formulas with the modes that are seen with ``start``, or its own where those are likelier,
    grown from the start.
    """
    problem = min(once_more(log, start, options), start, key=whole_cost).problem
    base = rest = fit_model(problem, extension, None, problem.settings.budget.base_diffusion)
    if start.rest.effects:
        rest = fit_model(problem, start.rest, start.fit.noise)
    tried = groups_of(problem.binned, problem.settings.formula)
    ways = grown_both_ways(problem, rest, tried.beside(rest.extension.effects))
    proofs = (proven(problem, base, formula, tried, options) for formula in ways)
    return (found for found in proofs if found is not None)
