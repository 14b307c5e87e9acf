"""The workflow: base model → find the missing effects and prove them → result with the extended model."""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.calibrate import calibrate_on_log, sticking, swivelling
from wmr_replay.gap.estimation.joined_torques import with_likelier_torques
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.swing_disturbance import calm_share, with_known_swings
from wmr_replay.gap.evidence.excitation import excitation_ratios
from wmr_replay.gap.evidence.late_left import late_left
from wmr_replay.gap.formula.one_way import held_back
from wmr_replay.gap.formula.search import with_formula
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import bin_log, lasts_long
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.work import Work, begin_work, n_bins
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.assemble import assemble
from wmr_replay.gap.result.result import GapResult
from wmr_replay.gap.scan.dry_turning import open_by_form
from wmr_replay.gap.scan.gains_in_doubt import with_gains_in_doubt
from wmr_replay.gap.scan.misfit import misfit_of, with_parameters
from wmr_replay.gap.scan.other_forms import with_other_forms
from wmr_replay.gap.scan.turning_in_doubt import with_turning_in_doubt
from wmr_replay.gap.search.modes_and_effects import Progress, find_effects
from wmr_replay.gap.search.rests import (
    describes_rests,
    is_behind_a_rest,
    leaving_more,
    likelier,
    with_rests,
    without_formula,
)
from wmr_replay.gap.search.seen_slipping import slipping_left, with_seen_slipping
from wmr_replay.gap.search.select import Selection
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.model_file import Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log

SELF_CALIBRATED = ("payload", "drive_gain", "yaw_inertia")


def analyse(
    log: Log, base: Model | None = None, options: GapOptions | None = None, progress: Progress | None = None
) -> GapResult:
    """The effects that ``base`` (default: the log's own nominal parameters) lacks to explain ``log``.

    Contact modes are the identifier's, ideal, or those of ``log.mode``, as ``options.modes`` says; the log's
    mode is read in the last case only. ``progress`` takes the stage and the share that is done. Raises
    InvalidSignal where the log has no torques or is too short.
    """
    options, tell = options or GapOptions(), progress or (lambda _stage, _share: None)
    tell("base model", 0.0)
    log, model, note = with_base_model(log, base, options)
    tell("naming", 0.1)
    log, work = replace(log, robot=model.robot), limited_work(log, options.gates)
    options = replace(options, gates=with_known_swings(options.gates, model.noise))
    extension = with_other_drive(model.extension, log, options.gates)
    problem, selection = find_effects(log, extension, options, tell)
    options = replace(options, gates=problem.settings)
    if (slipping := with_seen_slipping(problem, selection)) is not None:
        problem, selection = slipping
    else:
        problem, selection = with_or_without_formula(log, problem, selection, extension, model, options)
    tell("proving", 0.8)
    result = assemble(problem, selection, model, options)
    return replace(result, notes=(*result.notes, *filter(None, (note, what_was_left_out(work)))))


def with_or_without_formula(
    log: Log,
    problem: Problem,
    selection: Selection,
    extension: Extension,
    model: BaseModel,
    options: GapOptions,
) -> tuple[Problem, Selection]:
    """The selection with a formula, where one describes more than what the base model leaves on its own
    calibration log.
    """
    calibrated, named = bool(model.misfit), bool(selection.found)
    leaving = leaving_more(selection, model.noise, options.gates.misfit)
    if calibrated and not leaving:
        return problem, without_formula(selection)
    part, said = with_formula(log, problem, selection, extension, options)
    said = held_back(part, said)
    in_its_place = not named and is_behind_a_rest(said, selection)
    if calibrated and (in_its_place or describes_rests(said, leaving)):
        return problem, without_formula(selection)
    return part, said


def limited_work(log: Log, gates: GateSettings) -> Work:
    """The work on a log from here on: limited where the log is long, so that an answer comes in time."""
    long = lasts_long(log.pose, gates)
    return begin_work(log.pose, gates.work.most * n_bins(log.pose, gates) if long else np.inf)


def what_was_left_out(work: Work) -> str:
    """The note on a search that ended early; empty where it did not."""
    if not work.left_out:
        return ""
    return (
        f"the log is long, and its search ended early: {', '.join(work.left_out)} were not tried; "
        "a part of it (--start, --end) is searched to the end"
    )


def with_other_drive(extension: Extension, log: Log, gates: GateSettings) -> Extension:
    """The base model, its misfit widened by what the calibration leaves open on the drive of this log;
    unchanged where it was not calibrated on a log.
    """
    if not extension.misfit:
        return extension
    extension, binned = with_other_forms(extension, log.pose, gates.misfit), bin_log(log, gates)
    return with_turning_in_doubt(with_gains_in_doubt(extension, binned), binned)


def with_base_model(log: Log, base: Model | None, options: GapOptions) -> tuple[Log, BaseModel, str]:
    """The log with its torques as they act between two stamps, its base model, and a note on the torques."""
    model = base_model(log, base, options)
    seen, note = with_likelier_torques(replace(log, robot=model.robot), model.extension, options)
    if not note:
        return log, model, ""
    log = replace(log, torque=seen.torque)
    return log, base_model(log, base, options), note


def base_model(log: Log, base: Model | None, options: GapOptions) -> BaseModel:
    """The base model: of the model file, else of the log's metadata, else calibrated on the log.

    A calibrated one takes a payload, a drive gain and a yaw inertia into its parameters, so that these cannot
    be named. Raises InvalidSignal where a calibration fails.
    """
    own = log.robot.known()
    if base is not None:
        robot = RobotParameters.from_values(own | base.robot.known(), "model")
        if robot.alpha is not None and robot.half_track_m is not None:
            return BaseModel(robot, base.effects, "model file", misfit=base.misfit, noise=base.noise)
        log = replace(log, robot=robot)
    elif log.robot.alpha is not None and log.robot.half_track_m is not None:
        return BaseModel(log.robot, (), "metadata record")
    fitted = calibrate_on_log(log, options).model
    effects = base.effects if base is not None else ()
    return BaseModel(fitted.robot, effects, "calibrated on the log", SELF_CALIBRATED, noise=fitted.noise)


def calibrate(log: Log, robot: RobotParameters, options: GapOptions | None = None) -> Model:
    """A base model calibrated on ``log``, with the rests that the log proves, and the size of those that it
    leaves open.

    See :func:`wmr_replay.gap.estimation.calibrate.calibrate`, :mod:`wmr_replay.gap.search.rests`,
    :mod:`wmr_replay.gap.scan.misfit` and :mod:`wmr_replay.gap.evidence.late_left`. Raises InvalidSignal where
    the torques do not move the robot, or without ``half_track_m``.
    """
    options = options or GapOptions()
    log = replace(log, robot=robot)
    begin_work(log.pose, np.inf)
    found = calibrate_on_log(log, options)
    robot = found.model.robot
    lines, note = with_likelier_torques(replace(log, robot=robot), found.holding, options)
    if note:
        found = calibrate_on_log(replace(log, torque=lines.torque), options)
    seen = replace(log, torque=lines.torque)
    starts = found, sticking(found, seen, options), swivelling(found, seen, options)
    model, problem, fit, _ = likelier(
        [with_rests(one, replace(options, gates=one.problem.settings)) for one in starts if one]
    )
    ahead, turning = excitation_ratios(problem, fit.extension, fit.noise)
    calm = np.sqrt(calm_share(problem, fit.extension))
    own = problem.settings.misfit
    misfit = with_parameters(misfit_of(problem, fit), model, (calm * ahead, calm * turning), own)
    by_form = open_by_form(BaseModel(model.robot, model.effects, "").extension, problem.binned, own.dry_form)
    misfit["yaw_inertia"] = max(misfit.get("yaw_inertia", 0.0), by_form)
    return replace(model, misfit=misfit | late_left(problem, fit) | slipping_left(problem, fit))
