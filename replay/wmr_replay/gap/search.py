"""The selection, and the contact modes that it is made with."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wmr_replay.gap.candidates import LOCAL
from wmr_replay.gap.drive import Drive, drive_of
from wmr_replay.gap.extension import Extension
from wmr_replay.gap.modes import identified_modes
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.select import Selection, select
from wmr_replay.gap.significance import LEVEL
from wmr_schemas.signals import Log, ModeTrack

MUCH_SLIP = 0.12
SWITCH_S = 0.3
"""How well an identifier knows when a mode begins or ends."""
Progress = Callable[[str, float], None]


def search(log: Log, extension: Extension, options: GapOptions, tell: Progress) -> tuple[Problem, Selection]:
    """The selection, with modes found together with the effects where the identifier is to say them."""
    if options.modes != "identified":
        problem = Problem.of(drive_of(log, log.mode if options.modes == "given" else None))
        return problem, select(problem, extension, options)
    return search_with_modes(log, extension, options, tell)


def search_with_modes(
    log: Log, extension: Extension, options: GapOptions, tell: Progress
) -> tuple[Problem, Selection]:
    """The identifier takes a missing effect for slip, so what shows with the base model's modes, proven or
    not, is a hint: with it the modes are identified anew, and the selection is made from the start. Where
    nothing shows and much is called slipping, the hint comes from slipping taken for ideal. The most likely
    answer with a proven effect stands, else the most likely.
    """
    first = identified_modes(log, extension)
    problem = Problem.of(identified_drive(log, first))
    tell("naming", 0.2)
    answers = [(problem, select(problem, extension, options))]
    hint = suggestion(extension, answers[0][1])
    if not hint.effects and np.mean(problem.drive.mode >= 2) > MUCH_SLIP:
        without = Problem.of(identified_drive(log, without_slip(first)))
        hint = suggestion(extension, select(without, extension, options, provisional=True))
    if hint.effects:
        tell("naming", 0.5)
        problem = Problem.of(identified_drive(log, identified_modes(log, hint)))
        answers.append((problem, select(problem, extension, options)))
    return min(answers, key=lambda answer: (not answer[1].found, answer[1].fit.deviance))


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


def without_slip(track: ModeTrack) -> ModeTrack:
    """The same, slipping taken for ideal: a missing effect may look like slip to an identifier."""
    return ModeTrack(track.t_ns, (track.mode % 2).astype(np.int8))
