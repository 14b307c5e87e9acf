"""Rests that a calibration log proves: the base model holds them from the start.

Casters, bearings and tyres that creep brake a robot on every drive. Held in the base model they act on every
channel in their own form, so that nothing else makes up for them. What a calibration log shows is the robot
as it is; a finding is what another log shows beyond it.
"""

from dataclasses import replace

from wmr_replay.gap.estimation.calibrate import Calibration, calibrated
from wmr_replay.gap.estimation.refit import gauss_newton
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.scan.misfit import IN_PARAMETERS, may_be_rest
from wmr_replay.gap.search.select import forward_selection
from wmr_schemas.model_file import Effect


def with_rests(calibration: Calibration, options: GapOptions) -> Calibration:
    """The calibration with the lasting effects that its log shows beyond the parameters, which are fitted once
    more beside them. Unchanged where the log shows an effect that does not always act.
    """
    model, problem, fit = calibration.model, calibration.problem, calibration.fit
    extension = Extension(base_of(model.robot), {}, model.robot.wheel_radius_m or 1.0)
    rolling = replace(problem, binned=replace(problem.binned, names_skid=False))
    most = replace(options, max_effects=problem.settings.misfit.most_rests)
    selection = forward_selection(rolling, extension, most, terms=False)
    effects = selection.fit.extension.effects
    if not effects or not all(may_be_rest(name) for name in effects):
        return calibration
    known = tuple((name, dict(size)) for name, size in effects.items() if name not in IN_PARAMETERS)
    steps = problem.settings.budget.last_steps
    beside = gauss_newton(problem, replace(fit.extension, known=known), selection.fit.noise, steps)
    robot, sd = calibrated(calibration.start, problem, beside)
    held = tuple(Effect(name, dict(parameters)) for name, parameters in known)
    return calibration._replace(model=replace(model, robot=robot, robot_sd=sd, effects=held), fit=beside)
