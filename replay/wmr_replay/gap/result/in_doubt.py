"""Why nothing found does not mean nothing missing: what a log shows clearly, and is no finding."""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.holdout import path_change
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.candidates import declaration_of
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import LOADED, may_be_rest, negligible, size_of
from wmr_replay.gap.search.eliminate import REST, UNPROVEN
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.rests import left_before, left_now
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.effects import UNNAMED_PREFIX

WITHIN_THE_BASE = (
    "{effect} would explain part of it, but on a drive such as this one the base model may leave as much: "
    "calibrate it on one"
)
NO_NEARER = (
    "{effect} predicts better what was held out, but the simulated path comes no nearer for it: something "
    "larger is missing beside it, or in its place"
)
LOUDER = (
    "something disturbs the robot {channel} {times:.0f} times as much as on the calibration log of the base "
    "model, {density:.2g} (m/s²)/√Hz, and no effect explains it"
)
CHANNELS = ("ahead", "in turning")


def in_doubt(problem: Problem, selection: Selection, model: BaseModel, options: GapOptions) -> str:
    """What the log shows clearly, and why it is no finding; empty where it shows nothing of the kind.

    An effect that is larger than the calibration log left it, and no larger than the base model's doubts on
    another drive: the one that explains most. Else one that predicts held-out blocks far better while
    the gap of held-out windows does not shrink. Else a disturbance that is many times what the base model
    leaves on its calibration log.
    """
    if within := within_the_base(problem, selection, model, options):
        return within
    clear = (one for one in selection.dropped if predicts_clearly(one, problem.settings))
    unproven = max(clear, key=lambda one: one.gain, default=None)
    if unproven:
        return NO_NEARER.format(effect=in_words(unproven))
    return disturbed(selection, model, problem.settings)


def within_the_base(problem: Problem, selection: Selection, model: BaseModel, options: GapOptions) -> str:
    """The effect that explains most of those that the base model may leave; empty without one."""
    most = explaining_most(problem, selection, model, options)
    return WITHIN_THE_BASE.format(effect=in_words(most)) if most else ""


def disturbed(selection: Selection, model: BaseModel, settings: GateSettings) -> str:
    """A disturbance that is many times that of the calibration log, in words; empty without one."""
    before, now = left_before(model.noise), left_now(selection)
    if not model.misfit or before is None:
        return ""
    times = now / np.maximum(before, settings.misfit.least_disturbance_mps2_rthz)
    channel = int(np.argmax(times))
    if times[channel] < settings.misfit.times_the_disturbance:
        return ""
    return LOUDER.format(channel=CHANNELS[channel], times=times[channel], density=now[channel])


def explaining_most(
    problem: Problem, selection: Selection, model: BaseModel, options: GapOptions
) -> FittedCandidate | None:
    """Of the rests that are new and move the path by the tolerance, the one that explains most; None without
    one.
    """
    tried = (*selection.rests, *(one for one in selection.dropped if one.failed == REST))
    new = (one for one in tried if is_new(one, model, problem.settings))
    moving = (one for one in new if moved_m(problem, one, options) >= options.tolerance_m)
    return max(moving, key=lambda one: one.score, default=None)


def is_new(one: FittedCandidate, model: BaseModel, settings: GateSettings) -> bool:
    """Whether an effect that a base model may leave, or a load put on meanwhile, is more than the calibration
    log left of it, and more than negligible.
    """
    if one.name.startswith(UNNAMED_PREFIX) or not (one.name == LOADED or may_be_rest(one.name)):
        return False
    size, extension = size_of(one.name, one.fit.extension.effects[one.name]), one.fit.extension
    left = model.misfit.get("payload" if one.name == LOADED else one.name, 0.0)
    return size > max(left, negligible(one.name, extension, settings.misfit))


def predicts_clearly(one: FittedCandidate, settings: GateSettings) -> bool:
    """Whether an effect of the library that is not proven predicts better beyond doubt."""
    own = settings.hold_out
    if one.failed != UNPROVEN or one.proof is None or one.name.startswith(UNNAMED_PREFIX):
        return False
    return one.proof.p_value < own.clear and one.gain > own.clear_gain


def moved_m(problem: Problem, one: FittedCandidate, options: GapOptions) -> float:
    """How far the effect moves the path, m."""
    without = replace(one.fit, extension=one.fit.extension.without(one.name))
    return path_change(problem, without, one.fit, options.tolerance_s)


def in_words(one: FittedCandidate) -> str:
    """The effect with its sizes; a parameter that need not be, where it is."""
    form = declaration_of(one.name)
    sizes = one.fit.extension.effects[one.name].items() - form.absent.items()
    said = (f"{key} {size:.2g} {form.units[key]}".removesuffix(" 1") for key, size in sorted(sizes))
    return f"{one.name} ({', '.join(said)})"
