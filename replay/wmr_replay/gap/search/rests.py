"""Rests that a calibration log proves: the base model holds them from the start.

Casters, bearings and tyres that creep brake a robot on every drive. Held in the base model they act on every
channel in their own form, so that nothing else makes up for them. What a calibration log shows is the robot
as it is; a finding is what another log shows beyond it.
"""

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace
from itertools import takewhile

import numpy as np

from wmr_replay.gap.estimation.calibrate import (
    Calibration,
    beside_parameters,
    calibrated,
    fit_parameters,
    to_calibrate,
)
from wmr_replay.gap.estimation.diffusion import fit_diffusion, noise_model
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import gauss_newton
from wmr_replay.gap.model.base import BaseModel, base_of
from wmr_replay.gap.model.extension import Extension, Parameters
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import (
    IN_PARAMETERS,
    OF_THE_DRIVES,
    may_be_rest,
    negligible,
    size_of,
    turning_is_unknown,
)
from wmr_replay.gap.search.eliminate import REST
from wmr_replay.gap.search.select import Selection, forward_selection
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.arrays import F64
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.model_file import Effect, Model, NoiseModel
from wmr_schemas.terms import TermChannel, parse_term

FORMULA_CHANNELS: tuple[TermChannel, ...] = ("longitudinal", "yaw")
OF_THE_PLACE = ("slope",)
"""Effects of where a log was taken, and not of the robot: fitted beside what is held, and left out."""


def with_rests(calibration: Calibration, options: GapOptions) -> Calibration:
    """The calibration with the lasting effects that its log shows beyond the parameters: the likelier of a
    few and of more. What is found behind an effect that does not always act is left out.
    """
    settings = calibration.problem.settings
    settings = replace(settings, scan=replace(settings.scan, held_too=True))
    binned = replace(calibration.problem.binned, names_skid=False, settings=settings)
    rolling = replace(calibration.problem, binned=binned)
    found = all_rests(rolling, calibration.holding, options)
    return likelier([holding_found(calibration, selection) for selection in found])


def all_rests(problem: Problem, extension: Extension, options: GapOptions) -> list[Selection]:
    """The rests that the log shows, terms of the dictionary among the first few where none of the library is
    significant. Where the library had one each time, it may have more, which is the second selection.
    """
    own = problem.settings.misfit
    few, many = (replace(options, max_effects=most) for most in (own.most_rests, own.most_of_library))
    selection = forward_selection(problem, extension, few, terms=True)
    names = [one.name for one in selection.found]
    if len(names) < own.most_rests or any(name.startswith(UNNAMED_PREFIX) for name in names):
        return [selection]
    return [selection, forward_selection(problem, extension, many, terms=False)]


def holding_found(calibration: Calibration, selection: Selection) -> Calibration:
    """The calibration with what a selection found, all of it fitted together, and again from the parameters
    that this finds: what an arm of the centre of mass does depends on the inertia.
    """
    model, problem = calibration.model, calibration.problem
    shown = selection.fit.extension.only(lasting(selection)).effects
    effects = joined(calibration.holding.known, shown)
    if not effects:
        return calibration
    rests = {name: dict(size) for name, size in effects.items() if name not in IN_PARAMETERS}
    noise, robot = selection.fit.noise, model.robot
    for _ in range(problem.settings.calibration.rounds):
        start, alone = robot, to_calibrate(problem, robot).as_in(selection.fit.extension)
        noise, whole = fit_parameters(problem, replace(alone, effects={**alone.effects, **rests}), noise)
        robot, _ = calibrated(start, problem, whole)
        rests = beside_parameters(whole.extension)
    holding = replace(to_calibrate(problem, robot), known=tuple(rests.items())).as_in(whole.extension)
    beside = gauss_newton(problem, holding, noise, problem.settings.budget.last_steps)
    changed, sd = calibrated(robot, problem, beside)
    own = {name: size for name, size in rests.items() if may_be_held(name) and any(size.values())}
    held = beside.extension.with_forms(tuple(Effect(name, size) for name, size in own.items()))
    known = noise_model(problem.binned, beside.noise)
    model = replace(model, robot=changed, robot_sd=sd, noise=known, effects=held)
    return calibration._replace(model=model, fit=beside, start=robot)


def lasting(selection: Selection) -> list[str]:
    """The effects found, in order, up to the first one that does not always act: behind a slip, or tyres that
    skid, nothing is taken from the log.
    """
    names = (one.name for one in selection.found)
    return list(takewhile(lambda name: may_be_held(name) or name in OF_THE_PLACE, names))


def likelier(calibrations: Sequence[Calibration]) -> Calibration:
    """The calibration whose model makes the log likeliest, in the contact modes of the last one, the
    parameters paid for.
    """
    problem = calibrations[-1].problem

    def cost(one: Calibration) -> float:
        model = BaseModel(one.model.robot, one.model.effects, "").extension
        noise = fit_diffusion(problem, model, iterations=problem.settings.calibration.iterations)
        n_parameters = sum(len(parameters) for _, parameters in model.known)
        return problem.deviance(model, noise) + problem.settings.scan.parameter_cost * n_parameters

    return min(calibrations, key=cost) if len(calibrations) > 1 else calibrations[0]


def joined(known: Iterable[tuple[str, Parameters]], found: Mapping[str, Parameters]) -> dict[str, Parameters]:
    """What was held already and what was found beyond it; the sizes of one name add up."""
    sizes = dict(known)
    for name, size in found.items():
        before = sizes.get(name, {})
        sizes[name] = {key: value + before.get(key, 0.0) for key, value in size.items()}
    return sizes


def leaving_more(selection: Selection, noise: NoiseModel, own: MisfitSettings) -> frozenset[TermChannel]:
    """The channels on which the base model leaves more on this log than ``noise``: what it leaves on its own
    calibration log, what casters do while they swing included. Every one where that is not known; none where
    both together leave no more, since what casters and pads leave ahead on one drive, they leave in turning
    on another; never in turning where the calibration log does not show how the torques turn the robot, and
    on none where it hardly does: what else turns it brakes it, too.

    What makes the disturbance on the calibration log, such as a caster that swings round, has a form: another
    one on each drive. A formula of it is no finding.
    """
    misfit = selection.base.extension.misfit
    if misfit.get("yaw_inertia", 0.0) > own.no_formula_share:
        return frozenset()
    may_leave = set(FORMULA_CHANNELS) - ({"yaw"} if turning_is_unknown(misfit, own) else set())
    before, after = left_before(noise), left_now(selection)
    if before is None:
        return frozenset(may_leave)
    if np.hypot(*after) <= own.same_disturbance * np.hypot(*before):
        return frozenset()
    more = after > own.same_disturbance * before
    return frozenset(one for one, is_more in zip(FORMULA_CHANNELS, more, strict=True) if is_more) & may_leave


def left_before(noise: NoiseModel) -> F64 | None:
    """Densities of the disturbances ahead and in turning that a base model leaves on its calibration log, and
    casters while they swing (2,), in (m/s²)/√Hz; None where they are not known.
    """
    left = noise.disturbance_longitudinal_mps2_rthz, noise.disturbance_yaw_mps2_rthz
    if None in left:
        return None
    swings = noise.swing_longitudinal_mps2_rthz or 0.0, noise.swing_yaw_mps2_rthz or 0.0
    return np.hypot(np.array(left, np.float64), swings)


def left_now(selection: Selection) -> F64:
    """The same of what it leaves on the log (2,)."""
    now = selection.base.noise
    return np.hypot(now.densities_mps2_rthz, now.swings_mps2_rthz)


def without_formula(selection: Selection) -> Selection:
    """The selection, or that of the base model where it found nothing but a formula."""
    if any(not effect.name.startswith(UNNAMED_PREFIX) for effect in selection.found):
        return selection
    return replace(selection, fit=selection.base, found=())


def describes_rests(selection: Selection, leaving: Set[TermChannel]) -> bool:
    """Whether the selection found nothing but a formula, and not on channels alone that are ``leaving`` more
    than the calibration log does.
    """
    names = [effect.name for effect in selection.found]
    if not names or not all(name.startswith(UNNAMED_PREFIX) for name in names):
        return False
    return not leaving >= {parse_term(name).channel for name in names}


def is_behind_a_rest(found: Selection, before: Selection) -> bool:
    """Whether an effect that was dropped ``before``, since the base model may leave as much, explains far
    more than what is found without it: a part of one cause in another form.
    """
    rests = [one.score for one in before.dropped if one.failed == REST]
    if not rests or not found.found:
        return False
    share = found.fit.problem.settings.selection.share_of_rest
    return found.found[0].score < share * max(rests)


def may_be_held(name: str) -> bool:
    """Whether an effect or a term of the dictionary belongs to the robot and always acts."""
    if name.startswith(UNNAMED_PREFIX):
        return parse_term(name).channel != "lateral"
    return name in OF_THE_DRIVES or (may_be_rest(name) and name not in OF_THE_PLACE)


def that_matter(model: Model, settings: MisfitSettings) -> tuple[str, ...]:
    """The effects of a calibrated model that matter in practice."""
    extension = Extension(base_of(model.robot), {}, model.robot.wheel_radius_m or 1.0)
    held = ((effect.name, size_of(effect.name, effect.parameters)) for effect in model.effects)
    return tuple(name for name, size in held if size >= negligible(name, extension, settings))
