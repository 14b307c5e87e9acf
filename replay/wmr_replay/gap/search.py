"""The selection, and the contact modes that it is made with."""

from collections.abc import Callable
from dataclasses import replace
from itertools import chain, pairwise

import numpy as np

from wmr_replay.gap.candidates import LOCAL
from wmr_replay.gap.drive import Drive, drive_of
from wmr_replay.gap.extension import Extension
from wmr_replay.gap.modes import identified_modes
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.relabel import like_slipping, unlike_slipping, without_rows, without_skid
from wmr_replay.gap.select import Selection, established, forward, select
from wmr_replay.gap.significance import LEVEL
from wmr_schemas.signals import Log, ModeTrack

MUCH_SKID = 0.5
SKID = "undeclared_skid"
RIVAL_SHARE = 0.5
SWITCH_S = 0.3
"""How well an identifier knows when a mode begins or ends."""
Progress = Callable[[str, float], None]
Answer = tuple[Problem, Selection]


def search(log: Log, extension: Extension, options: GapOptions, tell: Progress) -> tuple[Problem, Selection]:
    """The selection, with modes found together with the effects where the identifier is to say them."""
    if options.modes != "identified":
        problem = Problem.of(drive_of(log, log.mode if options.modes == "given" else None))
        return problem, select(problem, extension, options)
    return search_with_modes(log, extension, options, tell)


def search_with_modes(
    log: Log, extension: Extension, options: GapOptions, tell: Progress
) -> tuple[Problem, Selection]:
    """The identifier takes a missing effect for slip or skid, so what is significant with the base model's
    modes is a hint: with it the modes are identified anew, and the selection is made from the start.
    Slipping that leaves more traction than the model's, and skidding most of the time, are tried as ideal.
    The most likely answer with a proven effect stands, else the most likely.
    """
    tell("naming", 0.1)
    answers = [answer_with(extension, log, extension, options)]
    given = hints(log, extension, options, answers[0])
    for hint in given:
        tell("naming", 0.3)
        answers.append(answer_with(hint, log, extension, options))
    tell("naming", 0.5)
    hint = hint_of_slipping(*min(answers, key=likelihood), extension, options)
    if set(hint.effects) not in [set(), *(set(other.effects) for other in given)]:
        answers.append(answer_with(hint, log, extension, options))
    tell("naming", 0.7)
    answers.sort(key=likelihood)
    settled = ((problem, established(problem, selection, options)) for problem, selection in answers)
    best = next(settled)
    return next((answer for answer in chain([best], settled) if answer[1].found), best)


def answer_with(hint: Extension, log: Log, extension: Extension, options: GapOptions) -> Answer:
    """What is significant with the modes that the identifier sees with the model ``hint``."""
    track = identified_modes(log, hint)
    track = without_skid(track) if SKID in hint.effects else track
    problem = Problem.of(identified_drive(log, track))
    return problem, forward(problem, extension, options)


def likelihood(answer: Answer) -> float:
    """Less is more likely."""
    return answer[1].fit.deviance


def hints(log: Log, extension: Extension, options: GapOptions, answer: Answer) -> list[Extension]:
    """What seems to be missing, to identify the modes with. A robot that skids most of the time has another
    reason for it, of which the two likeliest are tried.
    """
    drive, found = answer[0].drive, [suggestion(extension, answer[1])]
    if drive.track is not None and np.mean(drive.mode % 2 == 1) > MUCH_SKID:
        other = provisional(log, without_skid(drive.track), extension, options)
        found += [suggestion(extension, other), *rivals(extension, other)]
    distinct = {tuple(hint.effects): hint for hint in reversed(found) if hint.effects}
    return list(reversed(distinct.values()))


def hint_of_slipping(
    problem: Problem, selection: Selection, extension: Extension, options: GapOptions
) -> Extension:
    """What is missing where slipping that leaves more traction than the model's is taken for ideal, but for a
    loss of traction that may be slipping all the same.
    """
    doubtful = unlike_slipping(problem, selection.fit)
    if not np.any(doubtful):
        return extension
    problem = problem.labelled(without_rows(problem.drive, doubtful))
    fit = forward(problem, extension, options, terms=False).fit
    effects = {k: v for k, v in fit.extension.effects.items() if not like_slipping(problem, fit, k)}
    return replace(extension, effects=effects)


def provisional(log: Log, track: ModeTrack, extension: Extension, options: GapOptions) -> Selection:
    """What is significant with other modes."""
    return forward(Problem.of(identified_drive(log, track)), extension, options, terms=False)


def rivals(extension: Extension, selection: Selection) -> list[Extension]:
    """The second of the first stage, where it explains nearly as much as the first."""
    first = [tried for tried in selection.stages[0] if tried.lead.name not in LOCAL][:2]
    return [
        extension.with_effect(second.lead.name, second.fit.extension.effects[second.lead.name])
        for best, second in pairwise(first)
        if second.score > RIVAL_SHARE * best.score > 0
    ]


def suggestion(extension: Extension, selection: Selection) -> Extension:
    """What is significant in a selection and holds throughout; what acts in an interval or a place is for the
    identifier to say.
    """
    effects = {k: v for k, v in selection.fit.extension.effects.items() if k not in LOCAL}
    for stage in selection.stages:
        lasting = [tried for tried in stage if tried.lead.name not in LOCAL]
        best = lasting[0] if lasting else None
        if best is not None and best.p_value <= LEVEL and best.score > 0 and best.lead.name not in effects:
            effects[best.lead.name] = best.fit.extension.effects[best.lead.name]
    return replace(extension, effects=effects)


def identified_drive(log: Log, track: ModeTrack) -> Drive:
    """The drive by modes that an identifier said, which knows their changes to ``SWITCH_S`` only."""
    return drive_of(log, track, margin_s=SWITCH_S)
