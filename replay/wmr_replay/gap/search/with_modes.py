"""The selection, and the contact modes that it is made with."""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.binned_log import drive_of
from wmr_replay.gap.estimation.modes import identified_drive, identified_modes
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.hints import SKID, Hints, hints
from wmr_replay.gap.search.relabel import no_other_than_slipping, with_rows, without_skid
from wmr_replay.gap.search.select import Selection, established, forward, select
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log

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
    plain = cache(lambda: forward(first, extension, options))
    tell("naming", 0.2)
    given = hints(log, first, plain, extension, options)
    tell("naming", 0.4)
    answers = [answer_with(hint, log, extension, options) for hint in given.models]
    answers.sort(key=lambda answer: answer.deviance)
    tell("naming", 0.7)
    settled = []
    for answer in chain(answers, without_hint(given, first, plain, extension, options)):
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
    answer = Answer(problem, forward(problem, extension, options), hint)
    return slipping_called_so(answer, extension, options)


def without_hint(
    given: Hints, first: Problem, plain: Callable[[], Selection], extension: Extension, options: GapOptions
) -> Iterator[Answer]:
    """Where a loss of traction is a hint and the identifier will not see it, the answer that the hint comes
    from; and what is significant with the base model's modes.
    """
    if any(name in LOCAL for hint in given.models for name in hint.effects):
        yield slipping_called_so(Answer(*given.seen_in, given.models[0]), extension, options)
    yield Answer(first, plain(), extension)


def slipping_called_so(answer: Answer, extension: Extension, options: GapOptions) -> Answer:
    """The answer anew, where it takes slipping that the identifier missed for a loss of traction."""
    missed = no_other_than_slipping(answer.problem, answer.selection.fit)
    if not np.any(missed):
        return answer
    problem = answer.problem.labelled(with_rows(answer.problem.drive, missed, ContactMode.SLIPPING))
    return Answer(problem, forward(problem, extension, options), answer.hint)
