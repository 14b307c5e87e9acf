"""What the beginning of a long log shows, as that with which a selection on the whole begins.

Two minutes name what acts throughout as ninety seconds do, and at a fifth of what ten minutes cost. On the
whole log it is fitted again, beside its near rivals, and has to pass every gate there.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.model.candidates import BY_NAME, LOCAL, SKID
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.fit_candidates import (
    FittedCandidate,
    assessed,
    compare_in_fine_bins,
    is_ruled_out,
    with_own_forms,
)
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.signals import Log

Stage = tuple[FittedCandidate, ...]


@dataclass(frozen=True, eq=False)
class Begun:
    """The stages of a selection on the beginning of a log whose first candidates act throughout, each with
    its near rivals; and the model with all that was found there.
    """

    stages: tuple[Stage, ...]
    there: Extension

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """What acts throughout, with its parameters there."""
        return {stage[0].name: dict(self.there.effects[stage[0].name]) for stage in self.stages}

    def model(self, extension: Extension) -> Extension:
        """``extension`` with what acts throughout."""
        return replace(extension.as_in(self.there), effects=self.effects)


def beginning_of(log: Log, settings: GateSettings) -> Log:
    """The log's first two minutes; times within it are those of the whole log."""
    end_ns = int(log.pose.t_ns[0]) + round(settings.begun.lasts_s * NS_PER_S)

    def cut(track: Any) -> Any:
        if track is None:
            return None
        early = track.t_ns < end_ns
        return type(track)(**{field.name: getattr(track, field.name)[early] for field in fields(track)})

    names = ("pose", "torque", "mode", "wheels", "commands", "steering")
    breaks = tuple(at for at in log.breaks_ns if at < end_ns)
    return replace(log, **{name: cut(getattr(log, name)) for name in names}, breaks_ns=breaks)


def is_whole(problem: Problem) -> bool:
    """Whether a problem is more than a part of a long log."""
    t_s = problem.binned.t_s
    return float(t_s[-1] - t_s[0]) >= problem.settings.begun.long_s - problem.settings.bins.bin_s


def begun_with(
    found: Iterable[FittedCandidate], stages: tuple[Stage, ...], there: Extension, settings: GateSettings
) -> Begun | None:
    """What was ``found`` on a log's beginning; None where nothing of it acts throughout, or anything has no
    name.
    """
    found = tuple(found)
    if any(one.name not in BY_NAME or one.name == SKID for one in found):
        return None
    own = settings.selection
    lasting: list[Stage] = []
    for one in (one for one in found if one.name not in LOCAL):
        beside = next((stage for stage in stages if one.name in [other.name for other in stage]), (one,))
        near = [
            other
            for other in beside
            if one.score - other.score < own.rival and other.name not in LOCAL and not other.failed
        ]
        rivals = [other for other in near if other.name != one.name and other.name in BY_NAME]
        lasting.append((one, *rivals[: own.most_rivals]))
    return Begun(tuple(lasting), there) if lasting else None


def fitted_on_the_whole(problem: Problem, base: Fit, begun: Begun) -> list[Stage]:
    """The stages of a log's beginning fitted on the whole of it one after the other, the best of each first;
    up to the first that explains nothing there.
    """
    current, stages = base, list[Stage]()
    for stage in begun.stages:
        new = [one for one in stage if one.name not in current.extension.effects]
        ranked = ranked_again(problem, current, new) if new else ()
        best = next((one for one in ranked if is_significant(problem, one)), None)
        if best is None:
            break
        others = tuple(one for one in ranked if one is not best)
        near = tuple((one.name, best.score - one.score) for one in others if 0 < one.score <= best.score)
        stages.append((replace(best, alternatives=near), *others))
        current = best.fit
    return stages


def is_significant(problem: Problem, one: FittedCandidate) -> bool:
    """Whether a candidate explains something for certain, and passes the gates so far."""
    return not one.failed and one.score > 0 and one.p_value <= problem.settings.significance.level


def ranked_again(problem: Problem, current: Fit, stage: Sequence[FittedCandidate]) -> Stage:
    """The candidates of the beginning beside the current model, by what they explain of the whole log, all at
    the diffusion that the first one leaves there.
    """
    noise = diffusion_beside(problem, current, stage[0])
    again = sorted((fitted_again(problem, current, one, noise) for one in stage), key=lambda one: -one.score)
    known = [one for one in again if may_be(problem, one)]
    return compare_in_fine_bins(problem, tuple(with_own_forms(problem, current, known, len(BY_NAME))))


def diffusion_beside(problem: Problem, current: Fit, one: FittedCandidate) -> Diffusion:
    """The diffusion that a candidate leaves, from that of the beginning and from the current one on: a few
    iterations may not lead from either to the other.
    """
    start, iterations = started(current, one), problem.settings.budget.base_diffusion
    fits = (fit_model(problem, start, noise, iterations) for noise in (current.noise, one.fit.noise))
    return min(fits, key=lambda fit: fit.deviance).noise


def may_be(problem: Problem, one: FittedCandidate) -> bool:
    """Whether a fitted candidate is one on the whole log, too."""
    return not is_ruled_out(problem, one.fit, one.name)


def started(current: Fit, one: FittedCandidate) -> Extension:
    """The current model with a candidate as the beginning shows it."""
    own = one.fit.extension
    return current.extension.as_in(own).with_effect(one.name, dict(own.effects[one.name]))


def fitted_again(
    problem: Problem, current: Fit, one: FittedCandidate, noise: Diffusion | None
) -> FittedCandidate:
    """A candidate of the beginning beside the current model, with what it explains of the whole log."""
    budget = problem.settings.budget
    start = started(current, one)
    fit = fit_model(problem, start, noise, budget.ranked_diffusion, budget.ranked_steps)
    scored = replace(one.scored, parameters=dict(start.effects[one.name]))
    return assessed(problem, current, scored, fit, len(BY_NAME))
