"""Preliminary models: what seems to be missing while the contact modes are those of the base model.

An identifier takes a missing effect for slip or skid. The modes are identified again with each preliminary
model (:mod:`.modes_and_effects`).
"""

from collections.abc import KeysView
from dataclasses import replace
from itertools import chain, takewhile
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.diffusion import calmed
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem, identity_of
from wmr_replay.gap.estimation.relabel import without_skid
from wmr_replay.gap.model.candidates import BY_NAME, CONFOUNDED_FORMS, LOCAL, SKID, candidate_of
from wmr_replay.gap.model.extension import Extension, weight
from wmr_replay.gap.scan.score import penalised_gain
from wmr_replay.gap.search.fit_candidates import FittedCandidate, rank_at, roughly, with_candidate
from wmr_replay.gap.search.labellings import (
    Labelling,
    doubted_slip,
    less_skid,
    less_slip,
    more_slip,
    no_slip,
    one_limit,
    one_loss,
)
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.search.selections import Selections
from wmr_replay.gap.search.slip_test import close_to, may_be_slipping
from wmr_replay.gap.search.starts import best_start
from wmr_replay.gap.search.whatever_modes import is_lasting, likeliest_models
from wmr_schemas.signals import Log


class PreliminaryModels(NamedTuple):
    """Models to identify the modes with, the likeliest first, and a labelling that may hold the answer: the
    one that they come from, or that of the base model's modes where slipping was replaced altogether.
    ``seen`` is the selection with it, of a long log on a part alone.
    """

    models: list[Extension]
    seen_in: Labelling
    seen: Selection


def preliminary_models(log: Log, first: Problem, selections: Selections) -> PreliminaryModels:
    """The preliminary models of the first labelling that has any.

    ``first`` has the modes of the base model. Labellings are tried in this order: without skidding where a
    robot is said to skid most of the time; without slipping that loses more or less traction than the
    model's; as they are; without slipping that one loss explains better; with slipping where that was missed;
    without slipping where it is said to slip much. Where it is said to slip so much that slipping is doubted,
    the last one is tried in any case. What is likeliest whatever the modes comes last.
    """
    tried = chain(
        less_skid(log, first),
        less_slip(first, selections.extension),
        [Labelling(first)],
        one_loss(first, selections.extension),
        one_limit(first, selections.extension),
        more_slip(first, selections),
        no_slip(first),
    )
    models: list[Extension] = []
    seen_in, seen = None, None
    until_found = takewhile(lambda one: one.further or not models, tried)
    for one in chain(until_found, doubted_slip(first)):
        problem = one.problem if one.problem is first else part_of_interest(one, first)
        selection = selections.of(problem, terms=problem is first, hints=one.hints)
        found = models_from(problem, selections.extension, selection)
        if not one.may_be_answer:
            found = [lasting_or_alone(model) for model in found]
        if found and seen_in is None:
            seen_in, seen = (one, selection) if one.may_be_answer else (Labelling(first), None)
            found += models_without_skid(log, problem, selections, found)
        models += found
    for further in (likeliest_models(first, selections.base(first)), in_calm(first, selections)):
        models += [one for one in further if one.effects.keys() not in named(models)]
    models = distinct(models, first.settings.modes.alike)
    return PreliminaryModels(models, seen_in or Labelling(first), seen or selections.of(first))


def part_of_interest(labelling: Labelling, first: Problem) -> Problem:
    """The labelling's problem; of a long log, the part about the middle one of the rows where it differs from
    ``first``.
    """
    problem, rows = labelling.problem, first.settings.modes.part_rows
    n = len(problem.binned)
    if n < 2 * rows:
        return problem
    changed = np.flatnonzero(problem.binned.mode != first.binned.mode)
    middle = int(changed[len(changed) // 2]) if len(changed) else n // 2
    start = min(max(middle - rows // 2, 0), n - rows)
    return problem.part(slice(start, start + rows))


def distinct(models: list[Extension], share: float) -> list[Extension]:
    """The models without those that are :func:`alike` an earlier one: the identifier sees the same modes."""
    kept: list[Extension] = []
    for model in models:
        if not any(alike(model, one, share) for one in kept):
            kept.append(model)
    return kept


def alike(one: Extension, other: Extension, share: float) -> bool:
    """Whether two models have the same lasting effects, all their sizes the same to a ``share``."""
    if one.effects.keys() != other.effects.keys() or not all(map(is_lasting, map(candidate_of, one.effects))):
        return False
    if identity_of(replace(one, effects={})) != identity_of(replace(other, effects={})):
        return False
    pairs = [(a[key], other.effects[name][key]) for name, a in one.effects.items() for key in a]
    return all(abs(a - b) <= share * max(abs(a), abs(b)) for a, b in pairs)


def named(models: list[Extension]) -> list[KeysView[str]]:
    """The names of the effects of each model."""
    return [model.effects.keys() for model in models]


def in_calm(problem: Problem, selections: Selections) -> list[Extension]:
    """The model with what explains most where the disturbances are held calm, if that is a lasting effect and
    the base model's disturbance ahead or in turning is far larger.

    A large effect gives wrong modes all over the log, and a disturbance that makes up for both of them
    explains the log better than any effect with those modes.
    """
    own = problem.settings
    base = selections.base(problem)
    noise = calmed(base.noise, own.diffusion, own.modes.suspicious_disturbance)
    if noise is None:
        return []
    best = rank_at(problem, base, noise, terms=False)[0]
    if best.name in LOCAL or best.name == SKID or penalised_gain(best, own.scan) <= 0:
        return []
    best = best_start(problem, base, best)
    return [roughly(problem, with_candidate(base, best), noise, best.name).extension]


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
    start = int(np.searchsorted(plain.binned.t_s, binned.t_s[0]))
    if len(binned) < len(plain.binned):
        plain = plain.part(slice(start, start + len(binned)))
    others = models_from(plain, selections.extension, selections.of(plain, terms=False))[:1]
    return [model for model in others if model.effects.keys() != found[0].effects.keys()]


def models_from(problem: Problem, extension: Extension, selection: Selection) -> list[Extension]:
    """The significant effects of a selection as one model, and the near rivals of its first effect as others.

    Wrong modes favour wrong effects, so what explains nearly as much is considered too.
    """
    own = problem.settings.modes
    model = significant_model(problem, extension, selection)
    found = [model] if model.effects else []
    found += either_loss(problem, extension, selection)
    if model.effects:
        first, *others = selection.stages[0][: own.most_rivals]
        near = [c for c in others if c.score > own.rival_share * first.score > 0 and c.name not in LOCAL]
        alone = [one_effect(extension, c) for c in near if c.name in BY_NAME]
        found += [one for one in alone if set(one.effects) != set(model.effects)]
    return found


def one_effect(extension: Extension, candidate: FittedCandidate) -> Extension:
    """The model with a fitted candidate alone."""
    there = candidate.fit.extension
    return extension.as_in(there).with_effect(candidate.name, there.effects[candidate.name])


def either_loss(problem: Problem, extension: Extension, selection: Selection) -> list[Extension]:
    """Of two losses of traction that meet in time, each alone, where nothing else is found: where one is,
    wheels slip more easily, and the other one may be that.
    """
    effects, binned = selection.fit.extension.effects, problem.binned
    if set(effects) != set(LOCAL):
        return []
    first, second = (weight(*one, binned) > problem.settings.slip.half for one in effects.items())
    if not np.any(close_to(first, binned) & second):
        return []
    return [extension.with_effect(*one) for one in effects.items()]


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
    return replace(extension, effects=effects).as_in(fit.extension)
