"""The selection, and the contact modes that it is made with."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.attempts import fitted
from wmr_replay.gap.candidates import LOCAL
from wmr_replay.gap.drive import Drive, drive_of
from wmr_replay.gap.extension import Extension
from wmr_replay.gap.modes import identified_modes
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.relabel import like_slipping, unlike_slipping, without_rows, without_skid
from wmr_replay.gap.select import AKIN, Selection, established, forward, select
from wmr_replay.gap.significance import LEVEL
from wmr_schemas.signals import Log, ModeTrack

MUCH_SKID = 0.5
SKID = "undeclared_skid"
RIVAL_SHARE, MOST_RIVALS = 1 / 3, 3
KIN = (*AKIN, {"heading_misalignment", "yaw_drift"})
"""Effects that the modes which an identifier sees with one of them may hide from the other."""
SWITCH_S = 0.3
"""How well an identifier knows when a mode begins or ends."""
Progress = Callable[[str, float], None]


class Answer(NamedTuple):
    """What is found with the modes that the identifier sees with a hint."""

    problem: Problem
    selection: Selection
    hint: Extension

    @property
    def deviance(self) -> float:
        """Less is more likely."""
        return self.selection.fit.deviance

    @property
    def holds(self) -> bool:
        """Whether something is found; skidding taken for ideal must be, as the undeclared skid that it is."""
        found = [tried.lead.name for tried in self.selection.found]
        return bool(found) and (SKID not in self.hint.effects or SKID in found)


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
    modes is a hint: with it the modes are identified anew, and the selection is made from the start. The most
    likely answer with a proven effect stands; without one, what the base model's modes give, or why not.
    """
    first = Problem.of(identified_drive(log, identified_modes(log, extension)))
    tell("naming", 0.2)
    given = hints(log, first, extension, options)
    tell("naming", 0.4)
    answers = sorted((answer_with(hint, log, extension, options) for hint in given), key=lambda a: a.deviance)
    tell("naming", 0.7)
    plain = (Answer(problem, forward(problem, extension, options), extension) for problem in [first])
    settled = []
    for answer in chain(answers, plain):
        settled.append(answer._replace(selection=established(*answer[:2], options)))
        if settled[-1].holds:
            break
    refused = (answer for answer in settled if answer.selection.refused)
    best = settled[-1] if settled[-1].holds else next(refused, settled[-1])
    return best.problem, best.selection


def answer_with(hint: Extension, log: Log, extension: Extension, options: GapOptions) -> Answer:
    """What is significant with the modes that the identifier sees with the model ``hint``."""
    track = identified_modes(log, hint)
    track = without_skid(track) if SKID in hint.effects else track
    problem = Problem.of(identified_drive(log, track))
    return Answer(problem, forward(problem, extension, options), hint)


def hints(log: Log, first: Problem, extension: Extension, options: GapOptions) -> list[Extension]:
    """What seems to be missing, to identify the modes with: by modes without skidding where a robot is said
    to skid most of the time, else without slipping that leaves more traction than the model's, else as they
    are.
    Modes that are seen with a hint speak for it, so near rivals are hints as well.
    """
    tries = chain(less_skid(log, first), less_slip(first, extension), [first])
    suggested = (suggestions(p, extension, forward(p, extension, options, terms=False)) for p in tries)
    found = next(filter(None, suggested), [])
    distinct = {tuple(hint.effects): hint for hint in reversed(found)}
    return list(reversed(distinct.values()))


def less_skid(log: Log, problem: Problem) -> Iterator[Problem]:
    """Skidding most of the time taken for ideal."""
    drive = problem.drive
    if drive.track is not None and np.mean(drive.mode % 2 == 1) > MUCH_SKID:
        yield Problem.of(identified_drive(log, without_skid(drive.track)))


def less_slip(problem: Problem, extension: Extension) -> Iterator[Problem]:
    """Slipping that leaves more traction than the model's taken for ideal."""
    doubtful = unlike_slipping(problem, fitted(problem, extension, None, 8))
    if np.any(doubtful):
        yield problem.labelled(without_rows(problem.drive, doubtful))


def suggestions(problem: Problem, extension: Extension, selection: Selection) -> list[Extension]:
    """What is significant in a selection; the same with an effect's next of kin in its place; and, for what
    an undeclared skid would explain, its rivals: each where it explains nearly as much.
    """
    hint = suggestion(problem, extension, selection)
    found = [hint] if hint.effects else []
    for stage in selection.stages if found else ():
        best, others = stage[0].lead.name if stage else "", stage[1:MOST_RIVALS]
        near = [t for t in others if t.score > RIVAL_SHARE * stage[0].score > 0 and t.lead.name not in LOCAL]
        for rival in near if best in hint.effects else ():
            name = rival.lead.name
            if {best, name} in KIN:
                found.append(hint.without(best).with_effect(name, rival.fit.extension.effects[name]))
            elif best == SKID:
                found.append(extension.with_effect(name, rival.fit.extension.effects[name]))
    return found


def suggestion(problem: Problem, extension: Extension, selection: Selection) -> Extension:
    """What is significant in a selection, but for losses of traction that may be slipping."""
    fit = selection.fit
    effects = {k: v for k, v in fit.extension.effects.items() if not like_slipping(problem, fit, k)}
    for stage in selection.stages:
        lasting = [tried for tried in stage if tried.lead.name not in LOCAL]
        best = lasting[0] if lasting else None
        if best is None or best.p_value > LEVEL or best.score <= 0 or best.lead.name in effects:
            continue
        if not any({best.lead.name, other} in AKIN for other in effects):
            effects[best.lead.name] = best.fit.extension.effects[best.lead.name]
    return replace(extension, effects=effects)


def identified_drive(log: Log, track: ModeTrack) -> Drive:
    """The drive by modes that an identifier said, which knows their changes to ``SWITCH_S`` only."""
    return drive_of(log, track, margin_s=SWITCH_S)
