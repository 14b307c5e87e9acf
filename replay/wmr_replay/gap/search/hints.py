"""What seems to be missing, while the contact modes are still those of the base model."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.modes import identified_drive
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.significance import LEVEL
from wmr_replay.gap.model.candidates import LOCAL, is_named
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.attempts import fitted
from wmr_replay.gap.search.relabel import like_slipping, unlike_slipping, with_rows, without_skid
from wmr_replay.gap.search.select import AKIN, Selection, forward
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log

MUCH_SKID, MUCH_SLIP = 0.5, 0.12
SKID = "undeclared_skid"
RIVAL_SHARE, MOST_RIVALS = 1 / 3, 3


class Hints(NamedTuple):
    """Models to identify the modes with, the likeliest first, and where they were seen."""

    models: list[Extension]
    seen_in: tuple[Problem, Selection]


def hints(
    log: Log, first: Problem, plain: Callable[[], Selection], extension: Extension, options: GapOptions
) -> Hints:
    """What seems to be missing: by modes without skidding where a robot is said to skid most of the time,
    else without slipping that leaves more traction than the model's, else as they are. Modes without skidding
    speak for an undeclared one, so its near rivals are hints as well. ``plain`` gives what is significant
    with the modes as they are.
    """
    likely = chain(less_skid(log, first), less_slip(first, extension), [first])
    for problem, local in chain(((problem, True) for problem in likely), no_slip(first)):
        selection = plain() if problem is first else forward(problem, extension, options, terms=False)
        found = suggestions(problem, extension, selection, local=local)
        if found:
            return Hints(found, (problem, selection))
    return Hints([], (problem, selection))


def less_skid(log: Log, problem: Problem) -> Iterator[Problem]:
    """Skidding most of the time taken for ideal."""
    drive = problem.drive
    if drive.track is not None and np.mean(drive.mode % 2 == 1) > MUCH_SKID:
        yield Problem.of(identified_drive(log, without_skid(drive.track)))


def less_slip(problem: Problem, extension: Extension) -> Iterator[Problem]:
    """Slipping that leaves more traction than the model's taken for ideal."""
    doubtful = unlike_slipping(problem, fitted(problem, extension, None, 8))
    if np.any(doubtful):
        yield problem.labelled(with_rows(problem.drive, doubtful, ContactMode.IDEAL))


def no_slip(problem: Problem) -> Iterator[tuple[Problem, bool]]:
    """Much slipping taken for ideal: there, a loss of traction in a time or place may be slipping."""
    slips = problem.drive.mode >= 2
    if np.mean(slips) > MUCH_SLIP:
        yield problem.labelled(with_rows(problem.drive, slips, ContactMode.IDEAL)), False


def suggestions(
    problem: Problem, extension: Extension, selection: Selection, *, local: bool = True
) -> list[Extension]:
    """What is significant in a selection, and what explains nearly as much as an undeclared skid; ``local``
    says whether a loss of traction in a time or place can be told from slipping.
    """
    hint = suggestion(problem, extension, selection, local=local)
    found = [hint] if hint.effects else []
    if SKID in hint.effects:
        first, *others = selection.stages[0][:MOST_RIVALS]
        near = [t for t in others if t.score > RIVAL_SHARE * first.score > 0 and t.lead.name not in LOCAL]
        names = [(t.lead.name, t.fit.extension.effects[t.lead.name]) for t in near]
        found += [extension.with_effect(*named) for named in names]
    return found


def suggestion(problem: Problem, extension: Extension, selection: Selection, *, local: bool) -> Extension:
    """What is significant in a selection and has a name, but for losses of traction that may be slipping,
    and an undeclared skid beside something that explains more.
    """
    fit = selection.fit
    found = fit.extension.effects.items()
    named = {k: v for k, v in found if is_named(k) and (local or k not in LOCAL)}
    effects = {k: v for k, v in named.items() if not like_slipping(problem, fit, k)}
    for stage in selection.stages:
        lasting = [tried for tried in stage if is_named(tried.lead.name) and tried.lead.name not in LOCAL]
        best = lasting[0] if lasting else None
        if best is None or best.p_value > LEVEL or best.score <= 0 or best.lead.name in effects:
            continue
        if not any({best.lead.name, other} in AKIN for other in effects):
            effects[best.lead.name] = best.fit.extension.effects[best.lead.name]
    if next(iter(effects), SKID) != SKID:
        effects.pop(SKID, None)
    return replace(extension, effects=effects)
