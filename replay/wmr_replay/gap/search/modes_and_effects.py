"""The missing effects together with the contact modes that they are found with."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import chain, islice
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.diffusion import no_more_than_calm
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import cost_of, fit_model
from wmr_replay.gap.estimation.relabel import without_skid
from wmr_replay.gap.estimation.sideslip import with_sideslip
from wmr_replay.gap.estimation.slip_disturbance import with_slip_disturbance
from wmr_replay.gap.evidence.answer import LATE
from wmr_replay.gap.evidence.one_place import TYRES
from wmr_replay.gap.model.binned_log import bin_log, lasts_long
from wmr_replay.gap.model.candidates import BY_NAME, LOCAL, SKID
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.work import Work, begin_work, n_bins, work_on
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.begun import Begun, beginning_of, begun_with
from wmr_replay.gap.search.fit_candidates import FittedCandidate, price_of
from wmr_replay.gap.search.labellings import Labelling, less_slip
from wmr_replay.gap.search.preliminary import (
    PreliminaryModels,
    one_effect,
    part_of_interest,
    preliminary_models,
)
from wmr_replay.gap.search.rests import is_behind_a_rest
from wmr_replay.gap.search.select import Selection, confirm, select
from wmr_replay.gap.search.selections import Selections
from wmr_replay.gap.search.slip_test import missed_slipping
from wmr_replay.gap.search.two_as_one import stands_for
from wmr_replay.gap.search.whatever_modes import Deviance, all_rolling, unlabelled_deviance
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.signals import Log

OTHER_MODELS = "rival models"
"""What a long log's search leaves out first."""

Progress = Callable[[str, float], None]
"""Takes the stage and the share of the work that is done, 0 to 1."""


class Solution(NamedTuple):
    """A selection, made with the modes that the identifier sees with the model ``preliminary``."""

    problem: Problem
    selection: Selection
    preliminary: Extension

    @property
    def cost(self) -> float:
        """The cost of the modes and the fitted model, with the price of its effects."""
        fit = self.selection.fit
        prices = sum(price_of(self.problem, effect.scored, fit) for effect in self.selection.found)
        return cost_of(fit) + prices

    @property
    def is_skidding(self) -> bool:
        """Whether what is found is skidding that was replaced by ideal."""
        return SKID in [effect.name for effect in self.selection.found]

    @property
    def holds(self) -> bool:
        """Whether something is found; skidding replaced by ideal must be found as an undeclared skid."""
        found = [effect.name for effect in self.selection.found]
        return bool(found) and (SKID not in self.preliminary.effects or SKID in found)


def find_effects(
    log: Log, extension: Extension, options: GapOptions, tell: Progress
) -> tuple[Problem, Selection]:
    """The selection, and the problem that it was made on.

    With modes identified, modes and effects are found together. Raises InvalidSignal for a short log.
    """
    if options.modes == "identified":
        return find_modes_and_effects(log, extension, options, tell)
    track = log.mode if options.modes == "given" else None
    problem = Problem.of(bin_log(log, options.gates, track))
    extension = with_sideslip(problem, extension)
    options = replace(options, gates=with_slip_disturbance(problem, extension))
    problem = Problem.of(bin_log(log, options.gates, track))
    return problem, select(problem, extension, options)


def find_modes_and_effects(
    log: Log, extension: Extension, options: GapOptions, tell: Progress
) -> tuple[Problem, Selection]:
    """The most likely solution whose effects pass the gates.

    Preliminary models come from the base model's modes. With each, the modes are identified again and the
    selection is made from the start. What is less likely than the base model's modes with nothing missing is
    no solution: slip and skid explain more. Where none holds, the answer is that of the base model's modes,
    or why the log cannot carry a verdict. A long log is answered as its beginning is, where that holds.
    """
    begun = shown_at_first(log, extension, options)
    track = likely_modes(log, extension, options.gates)
    first = Problem.of(bin_identified(log, track, options.gates)).all_fitted()
    extension = with_sideslip(first, extension)
    options = replace(options, gates=with_slip_disturbance(first, extension))
    first = Problem.of(bin_identified(log, first.binned.track or track, options.gates)).all_fitted()
    selections = Selections(extension, options)
    first = selections.known(first)
    tell("naming", 0.2)
    if begun is not None and (answer := answer_as_begun(log, first, begun, selections)) is not None:
        return answer.problem, answer.selection
    preliminary = preliminary_models(log, first, selections)
    tell("naming", 0.4)
    solutions: list[Solution] = []
    behind = FarBehind(first, selections)
    work = work_on(log.pose)
    for model in preliminary.models:
        if solutions and not work.allows(OTHER_MODELS):
            break
        best = min(solutions, key=lambda one: one.cost, default=None)
        if best is None or not behind.is_far(model, best.selection.fit.extension):
            solutions += solve_with(model, log, selections, np.inf if best is None else best.cost)
    nothing = cost_of(selections.base(first))
    likely = by_cost(solutions, nothing)
    if preliminary.models and preliminary.seen_in.problem is not first:
        likely = with_seen(solutions, preliminary, nothing, selections, work)
    tell("naming", 0.7)
    confirmed = []
    for solution in chain(likely, plain_solution(first, selections)):
        selection = confirm(solution.problem, solution.selection, options)
        confirmed.append(solution._replace(selection=selection))
        if confirmed[-1].holds:
            break
    confirmed += without_dropped(confirmed[-1], selections)
    refused = (solution for solution in confirmed if solution.selection.refused)
    best = confirmed[-1] if confirmed[-1].holds else next(refused, confirmed[-1])
    if best.is_skidding:  # a mode, and no effect
        return first, confirm(first, selections.of(first), options)
    return best.problem, best.selection


def shown_at_first(log: Log, extension: Extension, options: GapOptions) -> Begun | None:
    """What the beginning of a long log shows to be missing throughout, if anything. A recording may begin
    without torques, or with hardly a pose.
    """
    if extension.misfit or not lasts_long(log.pose, options.gates):
        return None
    early = beginning_of(log, options.gates)
    begin_work(early.pose, options.gates.work.most_at_first * n_bins(early.pose, options.gates))
    try:
        _, shown = find_modes_and_effects(early, extension, options, lambda _stage, _share: None)
    except InvalidSignal:
        return None
    return begun_with(shown.found, shown.stages, shown.fit.extension, options.gates)


def answer_as_begun(log: Log, first: Problem, begun: Begun, selections: Selections) -> Solution | None:
    """The solution of a long log that begins with what its beginning shows, where that holds.

    Of two effects that explain the whole about equally well, the modes are identified with either.
    """
    so_begun = Selections(selections.extension, selections.options, begun)
    so_begun.known(first)
    model = begun.model(selections.extension)
    solution = solve_with(model, log, so_begun, np.inf)[0]
    rival = near_rival(solution, model)
    if rival is not None:
        other = one_effect(selections.extension, rival)
        solution = min([solution, *solve_with(other, log, so_begun, solution.cost)], key=lambda one: one.cost)
    if solution.cost >= cost_of(selections.base(first)):
        return None
    selection = confirm(solution.problem, solution.selection, selections.options)
    solution = solution._replace(selection=selection)
    return solution if solution.holds else None


def near_rival(solution: Solution, model: Extension) -> FittedCandidate | None:
    """The best of the candidates that explain about as much as the first effect of a solution and are not in
    its preliminary ``model``; None without one.
    """
    hopeless = solution.problem.settings.modes.hopeless
    stage = solution.selection.stages[0] if solution.selection.found else ()
    others = (one for one in stage if one.name in BY_NAME and one.name not in (*model.effects, *LOCAL))
    return next((one for one in others if stage[0].score - one.score < hopeless), None)


class FarBehind:
    """Whether one model is far less likely than another one, whatever the modes are.

    To ask an identifier costs far more than a likelihood that sums over the modes. Disturbances are calm, so
    that they do not explain what a model lacks.
    """

    def __init__(self, first: Problem, selections: Selections) -> None:
        self._first, self._selections = first, selections

    @cached_property
    def _deviance(self) -> Deviance:
        base, settings = self._selections.base(self._first), self._first.settings
        return unlabelled_deviance(
            all_rolling(self._first), no_more_than_calm(base.noise, settings.diffusion)
        )

    def is_far(self, model: Extension, other: Extension) -> bool:
        """Whether ``model`` is far behind the ``other``; none that tries skidding is, and none of the same
        effects, whose sizes are found again.
        """
        if SKID in model.effects or model.effects.keys() == other.effects.keys():
            return False
        own, best = (float(self._deviance(one).sum()) for one in (model, other))
        return own > best + self._first.settings.modes.out_of_reach


def by_cost(solutions: Iterable[Solution], nothing: float) -> Iterator[Solution]:
    """The solutions that cost less than ``nothing``, that of no missing effect, the likeliest first."""
    return iter(sorted((s for s in solutions if s.cost < nothing), key=lambda s: s.cost))


def with_seen(
    solutions: list[Solution],
    preliminary: PreliminaryModels,
    nothing: float,
    selections: Selections,
    work: Work,
) -> Iterator[Solution]:
    """:func:`by_cost`, with the selection that the preliminary models come from among them.

    It is made again with its losses as slipping, and of a long log on the whole of it, where nothing that is
    clearly likelier holds, if there is ``work`` left for it.
    """
    least = cost_as_seen(preliminary) - selections.options.gates.modes.far_behind
    yield from by_cost((s for s in solutions if s.cost < least), nothing)
    others = [s for s in solutions if s.cost >= least]
    if others and not work.allows(OTHER_MODELS):
        yield from by_cost(others, nothing)
        return
    seen = with_missed_slipping(made_on_the_whole(preliminary, selections), selections)
    yield from by_cost([*others, seen], nothing)


def cost_as_seen(preliminary: PreliminaryModels) -> float:
    """The cost of the selection that the preliminary models come from; about that, where a part of a long log
    was looked at.
    """
    problem, seen = preliminary.seen_in.problem, preliminary.seen
    if len(seen.fit.problem.binned) < len(problem.binned):
        return cost_alone(problem, seen.fit.extension)
    return Solution(problem, seen, preliminary.models[0]).cost


def made_on_the_whole(preliminary: PreliminaryModels, selections: Selections) -> Solution:
    """The selection that the preliminary models come from, on the whole log."""
    problem, _, hints, _ = preliminary.seen_in
    selection = selections.of(problem, terms=False, hints=hints)
    return Solution(problem, selection, preliminary.models[0])


def plain_solution(first: Problem, selections: Selections) -> Iterator[Solution]:
    """That of the base model's modes, made where it is asked for: a likelier one that holds needs it not."""
    yield Solution(first, selections.of(first), selections.extension)


def without_dropped(solution: Solution, selections: Selections) -> list[Solution]:
    """A solution that holds where the effects that are :func:`hiding` others are no candidates, and that are
    not these in two others.
    """
    spent = hiding(solution.selection)
    if not spent:
        return []
    selection = confirm(solution.problem, selections.of(solution.problem, without=spent), selections.options)
    again = solution._replace(selection=selection)
    found = again.holds and is_lasting(selection) and not is_behind_a_rest(selection, solution.selection)
    same = stands_for([effect.name for effect in selection.found], spent)
    return [again] if found and not same else []


def hiding(said: Selection) -> tuple[str, ...]:
    """The effects of a selection that names none which did not pass the gates, where something else was
    significant, too: they may have hidden it. A lag and a delay are one in this.
    """
    names = [effect.name for effect in said.dropped]
    spent = tuple(dict.fromkeys([*names, *(LATE if {*names} & {*LATE} else ())]))
    level = said.fit.problem.settings.significance.level
    others = [one for one in said.stages[0] if one.name not in spent] if spent else []
    hid = any(one.p_value <= level and one.score > 0 and not one.failed for one in others)
    return spent if hid and not said.found else ()


def is_lasting(selection: Selection) -> bool:
    """Whether something is found, and no loss of traction, nor the tyres': with a disturbance that nothing
    explains, those explain some of it.
    """
    names = {effect.name for effect in selection.found}
    return bool(names) and not names & {*LOCAL, SKID, TYRES}


def solve_with(model: Extension, log: Log, selections: Selections, least: float) -> list[Solution]:
    """The selection with the modes that the identifier sees with a preliminary model.

    None where that model with its own modes costs clearly more than ``least``, another solution.
    """
    gates, skids = selections.options.gates, SKID in model.effects
    track = likely_modes(log, model, gates)
    track = without_skid(track) if skids else track
    problem = Problem.of(bin_identified(log, track, gates, names_skid=skids)).all_fitted()
    problem = selections.known(problem)
    if not skids and least < np.inf and cost_alone(problem, model) > least + gates.modes.hopeless:
        return []
    hints = tuple((name, p) for name, p in model.effects.items() if name in LOCAL)
    solution = Solution(problem, selections.of(problem, hints=hints), model)
    return [with_missed_slipping(solution, selections)]


def cost_alone(problem: Problem, model: Extension) -> float:
    """The cost of the modes and a preliminary model, with the price of its parameters."""
    fit = fit_model(problem, model, None, problem.settings.budget.base_diffusion)
    return cost_of(fit) + len(fit.keys) * float(np.log(3 * problem.train.sum()))


def with_missed_slipping(solution: Solution, selections: Selections) -> Solution:
    """Relabel as slipping the losses of traction that cannot be told from it, and select again.

    Where an interval that is slipping then loses something else than slipping does, the loss was looked for
    in a wrong time or place: it is tried where that interval is.
    """
    problem = missed_slipping(solution.problem, solution.selection.fit)
    if problem is solution.problem:
        return with_settled_losses(solution)
    doubted = less_slip(problem, selections.extension)
    for doubt in islice(doubted, problem.settings.slip.most_doubts):
        if not work_on(problem.binned.log.pose).allows(OTHER_MODELS):
            break
        other, hints = doubt.problem, doubt.hints
        if not is_shown_nearby(doubt, problem, selections):
            continue
        again = selections.of(other, hints=hints)
        if again.found and missed_slipping(other, again.fit) is other:
            return with_settled_losses(solution._replace(problem=other, selection=again))
    return solution._replace(problem=problem, selection=selections.of(problem))


def is_shown_nearby(doubt: Labelling, problem: Problem, selections: Selections) -> bool:
    """Whether the part of a long log about a doubtful interval shows a loss of traction, which a selection on
    the whole is asked for; of a short log nobody knows before.
    """
    part = part_of_interest(doubt, problem)
    if part is doubt.problem:
        return True
    selection = selections.of(part, terms=False, hints=doubt.hints)
    loses = any(one.name in LOCAL for one in selection.found)
    return loses and missed_slipping(part, selection.fit) is part


def with_settled_losses(solution: Solution) -> Solution:
    """The solution with its disturbances fitted to the end, where it holds a loss of traction.

    Without that loss they are large, and a few iterations from there leave them so.
    """
    problem, selection = solution.problem, solution.selection
    if not any(name in LOCAL for name in selection.fit.extension.effects):
        return solution
    iterations = problem.settings.budget.base_diffusion
    fit = fit_model(problem, selection.fit.extension, selection.fit.noise, iterations)
    return solution._replace(selection=replace(selection, fit=fit))
