"""Contact modes to start from: those of the base model, and others where they are doubtful."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import fit_model
from wmr_replay.gap.estimation.relabel import with_mode_at, without_skid
from wmr_replay.gap.model.extension import Extension, weight
from wmr_replay.gap.search.fit_candidates import Hints
from wmr_replay.gap.search.selections import Selections
from wmr_replay.gap.search.slip_doubts import Doubt, as_losses, in_place_of_slipping, unlike_slipping
from wmr_replay.gap.search.slip_test import SATURATION, missed_slipping
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
    doubts = unlike_slipping(problem, fit)
    for k, doubt in enumerate(doubts[: problem.settings.slip.most_doubts]):
        rows = np.zeros(len(problem.binned), bool)
        rows[doubt.first : doubt.last] = True
        track = with_mode_at(problem.binned, rows, ContactMode.IDEAL)
        yield Labelling(problem.relabelled(track), hints=as_losses(problem.binned, doubt), further=k > 0)
    yield from same_place(problem, doubts)


def same_place(problem: Problem, doubts: list[Doubt]) -> Iterator[Labelling]:
    """All slipping replaced by ideal in the place of a doubtful interval, where the robot slips at other
    times as well: one patch may be crossed several times, and a short crossing is not doubted by itself.
    """
    binned, half = problem.binned, problem.settings.slip.half
    for doubt in doubts[: problem.settings.slip.most_doubts]:
        place = as_losses(binned, doubt)[1:]
        rows = binned.slips & (weight(*place[0], binned) > half)
        if rows[: doubt.first].any() or rows[doubt.last :].any():
            rows[doubt.first : doubt.last] = True
            track = with_mode_at(binned, rows, ContactMode.IDEAL)
            yield Labelling(problem.relabelled(track), hints=place, further=True)
            return


def one_loss(problem: Problem, extension: Extension) -> Iterator[Labelling]:
    """Slipping replaced by ideal where one loss in a time or place explains more than the slipping there.

    Tried beside what other labellings show: a lasting effect that is missing makes slipping look like it.
    """
    fit = fit_model(problem, extension, None, problem.settings.budget.base_diffusion)
    for rows, hints in in_place_of_slipping(problem, fit)[: problem.settings.slip.most_doubts]:
        track = with_mode_at(problem.binned, rows, ContactMode.IDEAL)
        yield Labelling(problem.relabelled(track), hints=hints, further=True)


def one_limit(problem: Problem, extension: Extension) -> Iterator[Labelling]:
    """Slipping replaced by ideal where it is said of the largest torques alone: a robot that is driven beyond
    what its motors give seems to lose traction.
    """
    binned = problem.binned
    if not np.any(binned.slips) or np.all(binned.slips):
        return
    largest = np.max(np.abs(extension.mean_torques(binned)), axis=0)
    least = float(np.min(largest[binned.slips]))
    if np.mean(largest[~binned.slips] > least) < problem.settings.slip.hardest:
        rolling = with_mode_at(binned, binned.slips, ContactMode.IDEAL)
        limit = ((SATURATION, {"limit_nm": least}),)
        yield Labelling(problem.relabelled(rolling), hints=limit, further=True)


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
    slips, own = problem.binned.slips, problem.settings.modes
    if own.much_slip < np.mean(slips) <= own.doubted_slip:
        yield without_slip(problem)


def doubted_slip(problem: Problem) -> Iterator[Labelling]:
    """Slipping replaced by ideal where it is said so much that it may be the effect itself.

    A drag, a yaw damping or a load is called slipping wherever it acts. The rest of it that the model's
    slipping leaves looks like another effect, or a small one, so that something is found beside it, too.
    """
    if np.mean(problem.binned.slips) > problem.settings.modes.doubted_slip:
        yield without_slip(problem)


def without_slip(problem: Problem) -> Labelling:
    """All slipping replaced by ideal."""
    track = with_mode_at(problem.binned, problem.binned.slips, ContactMode.IDEAL)
    return Labelling(problem.relabelled(track), may_be_answer=False)
