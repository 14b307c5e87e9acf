"""Preliminary models: what seems to be missing while the contact modes are those of the base model.

An identifier takes a missing effect for slip or skid. The modes are identified again with each preliminary
model (:mod:`.modes_and_effects`).
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.estimation.relabel import with_mode_at, without_skid
from wmr_replay.gap.model.candidates import BY_NAME, LOCAL, SKID
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.fit_candidates import Hints
from wmr_replay.gap.search.select import CONFOUNDED_FORMS, Selection
from wmr_replay.gap.search.selections import Selections
from wmr_replay.gap.search.slip_test import (
    as_losses,
    in_place_of_slipping,
    may_be_slipping,
    missed_slipping,
    unlike_slipping,
)
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log


class Labelling(NamedTuple):
    """A problem with contact modes to start from; whether what is found there may be the answer itself;
    losses at which a fit may start; and whether it is tried beside a labelling that gives models.
    """

    problem: Problem
    may_be_answer: bool = True
    hints: Hints = ()
    further: bool = False


class PreliminaryModels(NamedTuple):
    """Models to identify the modes with, the likeliest first, and a selection that may be the answer itself:
    the one that they come from, or that of the base model's modes where slipping was replaced altogether.
    """

    models: list[Extension]
    seen_in: tuple[Problem, Selection]


def preliminary_models(log: Log, first: Problem, selections: Selections) -> PreliminaryModels:
    """The preliminary models of the first labelling that has any.

    ``first`` has the modes of the base model. Labellings are tried in this order: without skidding where a
    robot is said to skid most of the time; without slipping that loses more or less traction than the
    model's; as they are; without slipping that one loss explains better; with slipping where that was missed;
    without slipping where it is said to slip much.
    """
    tried = chain(
        less_skid(log, first),
        less_slip(first, selections.extension),
        [Labelling(first)],
        one_loss(first, selections.extension),
        more_slip(first, selections),
        no_slip(first),
    )
    models: list[Extension] = []
    seen_in: tuple[Problem, Selection] | None = None
    for problem, may_be_answer, hints, further in tried:
        if models and not further:
            break
        selection = selections.of(problem, terms=problem is first, hints=hints)
        found = models_from(problem, selections.extension, selection)
        if not may_be_answer:
            found = [lasting_or_alone(model) for model in found]
        if found and seen_in is None:
            seen_in = (problem, selection) if may_be_answer else (first, selections.of(first))
            found += models_without_skid(log, problem, selections, found)
        models += found
    return PreliminaryModels(models, seen_in or (first, selections.of(first)))


def lasting_or_alone(model: Extension) -> Extension:
    """The model without losses of traction that stand beside a lasting effect: with all slipping left out,
    they are what a wrong form of that leaves.
    """
    lasting = {name: p for name, p in model.effects.items() if name not in LOCAL}
    return replace(model, effects=lasting or model.effects)


def models_without_skid(
    log: Log, problem: Problem, selections: Selections, found: list[Extension]
) -> list[Extension]:
    """The model that is seen where skidding is replaced by ideal, if another one rests on skidding alone.

    A robot whose pose is turned seems to skid all the time, with tyres of another stiffness.
    """
    binned = problem.binned
    if "cornering_stiffness" not in found[0].effects or binned.track is None:
        return []
    track = without_skid(binned.track)
    plain = Problem.of(bin_identified(log, track, problem.settings)).all_fitted()
    others = models_from(plain, selections.extension, selections.of(plain, terms=False))[:1]
    return [model for model in others if model.effects.keys() != found[0].effects.keys()]


def less_skid(log: Log, problem: Problem) -> Iterator[Labelling]:
    """Skidding replaced by ideal where it is said most of the time."""
    binned, settings = problem.binned, problem.settings
    if binned.track is not None and np.mean(binned.skids) > settings.modes.much_skid:
        rolling = bin_identified(log, without_skid(binned.track), settings, names_skid=True)
        yield Labelling(Problem.of(rolling).all_fitted())


def less_slip(problem: Problem, extension: Extension) -> Iterator[Labelling]:
    """Slipping replaced by ideal in an interval that loses clearly more or less than the model's slipping.

    The farthest ones one at a time: one may be slipping on a patch, and only the other the patch alone.
    """
    fit = fit_model(problem, extension, None, problem.settings.budget.base_diffusion)
    for k, doubt in enumerate(unlike_slipping(problem, fit)[: problem.settings.slip.most_doubts]):
        rows = np.zeros(len(problem.binned), bool)
        rows[doubt.first : doubt.last] = True
        track = with_mode_at(problem.binned, rows, ContactMode.IDEAL)
        yield Labelling(problem.relabelled(track), hints=as_losses(problem.binned, doubt), further=k > 0)


def one_loss(problem: Problem, extension: Extension) -> Iterator[Labelling]:
    """Slipping replaced by ideal where one loss in a time or place explains more than the slipping there.

    Tried beside what other labellings show: a lasting effect that is missing makes slipping look like it.
    """
    fit = fit_model(problem, extension, None, problem.settings.budget.base_diffusion)
    for rows, hints in in_place_of_slipping(problem, fit)[: problem.settings.slip.most_doubts]:
        track = with_mode_at(problem.binned, rows, ContactMode.IDEAL)
        yield Labelling(problem.relabelled(track), hints=hints, further=True)


def more_slip(problem: Problem, selections: Selections) -> Iterator[Labelling]:
    """Slipping where a loss of traction that cannot be told from it was found.

    The disturbance that makes up for slipping that an identifier missed hides every lasting effect.
    """
    slipping = missed_slipping(problem, selections.of(problem).fit)
    if slipping is not problem:
        yield Labelling(slipping)


def no_slip(problem: Problem) -> Iterator[Labelling]:
    """Much slipping replaced by ideal. What is found there is a model to identify the modes with, and no
    answer.
    """
    slips = problem.binned.slips
    if np.mean(slips) > problem.settings.modes.much_slip:
        track = with_mode_at(problem.binned, slips, ContactMode.IDEAL)
        yield Labelling(problem.relabelled(track), may_be_answer=False)


def models_from(problem: Problem, extension: Extension, selection: Selection) -> list[Extension]:
    """The significant effects of a selection as one model, and the near rivals of its first effect as others.

    Wrong modes favour wrong effects, so what explains nearly as much is considered too.
    """
    own = problem.settings.modes
    model = significant_model(problem, extension, selection)
    found = [model] if model.effects else []
    if model.effects:
        first, *others = selection.stages[0][: own.most_rivals]
        near = [c for c in others if c.score > own.rival_share * first.score > 0 and c.name not in LOCAL]
        named = [(c.name, c.fit.extension.effects[c.name]) for c in near if c.name in BY_NAME]
        found += [extension.with_effect(*one) for one in named if {one[0]} != set(model.effects)]
    return found


def significant_model(problem: Problem, extension: Extension, selection: Selection) -> Extension:
    """The significant effects of a selection that have a name.

    Left out are losses of traction that may be slipping, and an undeclared skid beside something that
    explains more.
    """
    fit = selection.fit
    named = {k: v for k, v in fit.extension.effects.items() if k in BY_NAME}
    effects = {k: v for k, v in named.items() if not may_be_slipping(problem, fit, k)}
    level = problem.settings.significance.level
    for stage in selection.stages:
        lasting = [c for c in stage if c.name in BY_NAME and c.name not in LOCAL]
        best = lasting[0] if lasting else None
        if best is None or best.failed or best.p_value > level or best.score <= 0 or best.name in effects:
            continue
        if not any({best.name, other} in CONFOUNDED_FORMS for other in effects):
            effects[best.name] = best.fit.extension.effects[best.name]
    if next(iter(effects), SKID) != SKID:
        effects.pop(SKID, None)
    return replace(extension, effects=effects)
