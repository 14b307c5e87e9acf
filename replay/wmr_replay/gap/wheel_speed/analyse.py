"""The workflow on wheel speeds: base model → missing effects and their proof → result."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import GapResult
from wmr_replay.gap.wheel_speed.assemble import assemble
from wmr_replay.gap.wheel_speed.base import Base, base_of
from wmr_replay.gap.wheel_speed.bins import bins_of
from wmr_replay.gap.wheel_speed.candidates import restarts_often
from wmr_replay.gap.wheel_speed.chain import chassis_and_drive
from wmr_replay.gap.wheel_speed.dictionary import with_terms
from wmr_replay.gap.wheel_speed.modes import ideal_only, slip_mask, without_slip
from wmr_replay.gap.wheel_speed.plausible import check_signs, logs_apart
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_replay.gap.wheel_speed.record import record_of
from wmr_replay.gap.wheel_speed.seen_slipping import apart_from, in_words, seen_slips, with_loss
from wmr_replay.gap.wheel_speed.select import Search, select
from wmr_replay.gap.wheel_speed.units import unit_of_blocks
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Model
from wmr_schemas.signals import Log

Progress = Callable[[str, float], None]


def analyse_wheel_speeds(
    logs: Sequence[Log],
    base: Model | None = None,
    options: GapOptions | None = None,
    progress: Progress | None = None,
    *,
    driven_by: str = "wheel_speed",
) -> GapResult:
    """The effects that ``base`` (default: the first log's nominal lengths) lacks to explain ``logs``.

    Raises InvalidSignal where wheel speeds, lengths or driving are too few.
    """
    options, tell = options or GapOptions(), progress or (lambda _stage, _share: None)
    tell("base model", 0.0)
    own = base_of(logs[0].robot, base)
    problem = problem_of(logs, own, options, driven_by)
    if options.modes == "identified":
        problem = identified(problem, logs, own, options)
    begin = chained(problem, logs, own, options)
    selection = select(problem, options.max_effects, tell, begin)
    slips, whole = seen_slips(selection), selection.problem.with_slip
    selection = with_loss(with_terms(apart_from(selection, slips), options.max_effects), slips, whole)
    tell("proving", 0.85)
    result = assemble(selection, own, options)
    return replace(result, notes=(*logs_apart(problem), *in_words(whole, slips), *result.notes))


def chained(problem: Problem, logs: Sequence[Log], base: Base, options: GapOptions) -> Search | None:
    """Where the search by commands begins that measured wheel speeds can prepare; None elsewhere, and where
    fewer effects are wanted than are usual: those of the drive come beside them.
    """
    fewer = options.max_effects < problem.settings.gates.most_effects
    if fewer or problem.record.driven_by != "command" or not restarts_often(problem.record):
        return None
    measured = problem_of(logs, base, options, "wheel_speed")
    if options.modes == "identified":
        measured = ideal_only(measured, {})
    return chassis_and_drive(problem, select(measured, options.max_effects))


def identified(problem: Problem, logs: Sequence[Log], base: Base, options: GapOptions) -> Problem:
    """The problem without the moments of slip. Where commands drive the model, those that the measured wheel
    speeds show; none where a log has no such speeds.
    """
    if problem.record.driven_by != "command":
        return ideal_only(problem, {})
    if any(log.wheels is None for log in logs):
        return problem
    measured = problem_of(logs, base, options, "wheel_speed")
    slips = measured.record.pose_s[slip_mask(measured)]
    return without_slip(problem, np.isin(problem.record.pose_s, slips))


def most_effects(options: GapOptions, asked: int | None) -> int:
    """How many effects are looked for: as asked, else as the settings say."""
    return options.gates.wheel_speed.gates.most_effects if asked is None else asked


def problem_of(logs: Sequence[Log], base: Base, options: GapOptions, driven_by: str) -> Problem:
    """The data set of the logs. Raises InvalidSignal where it is too short."""
    given = options.gates.wheel_speed
    gates = replace(given.gates, tolerance_m=options.tolerance_m, tolerance_s=options.tolerance_s)
    settings = replace(given, gates=gates)
    record = record_of(logs, settings.layout, driven_by)
    bins = bins_of(record, settings.layout)
    if not len(bins.table):
        raise InvalidSignal("wheel speed", "no stretch of the log is long enough")
    problem = Problem(record, bins, base.chassis, base.values, np.ones(len(bins.start), bool), settings)
    if driven_by != "command":
        may_slip = options.modes == "identified" and record.anchored
        problem = replace(problem, base_sd=base.values_sd, slips_to=base.slips_to if may_slip else 1.0)
    if int(unit_of_blocks(problem).max()) + 1 < settings.gates.least_units:
        seconds = float(bins.inside.sum()) * bins.step_s
        raise InvalidSignal(
            "pose", f"{seconds:.3g} s of driving with wheel speeds are too short for an analysis"
        )
    if driven_by != "command":
        check_signs(problem)
    return problem
