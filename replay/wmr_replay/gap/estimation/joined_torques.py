"""Torques between two stamps: held, or joined by lines where a log records fewer than the controller gave.

A torque that is recorded every 50 ms and held lags half of that behind one that changes all the time; a model
answers with resistances and dampings that are not there. Which of the two a log has is seen from how likely
its motion is under the base model, with the same contact modes.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import bin_identified
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.inputs import TorqueHistory, are_known
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.settings.log import TorqueSettings
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.signals import Log, TorqueTrack


def with_likelier_torques(log: Log, extension: Extension, options: GapOptions) -> tuple[Log, str]:
    """The log, its torques joined by lines where these are clearly likelier than held ones, and a note that
    says so ("" where they stay held). Torques that come often are not asked.
    """
    own = options.gates.torque
    period_s = np.inf if log.torque is None else median_period_s(log.torque)
    if log.torque is None or not own.slow_s <= period_s < np.inf:
        return log, ""
    line = joined(log.torque, own)
    lines = replace(log, torque=line)
    problem = problem_of(log, extension, options)
    torque = TorqueHistory.of(line, problem.binned.start_ns)
    other = replace(problem, binned=replace(problem.binned, torque=torque, log=lines))
    if deviance(problem, extension) - deviance(other, extension) < own.least_gain:
        return log, ""
    return lines, (
        f"the torques are recorded every {1000 * period_s:.0f} ms, and the motion fits lines between them "
        "better than torques held from stamp to stamp: they are taken as lines"
    )


def median_period_s(track: TorqueTrack) -> float:
    """Of known torques; infinite for fewer than two."""
    known = track.t_ns[are_known(track)]
    return float(np.median(np.diff(known))) / NS_PER_S if len(known) > 1 else np.inf


def joined(track: TorqueTrack, settings: TorqueSettings) -> TorqueTrack:
    """The known torques, each line between two of them in held pieces of its mean."""
    known = are_known(track)
    stamps = track.t_ns[known]
    periods = np.diff(stamps)
    whole = periods <= settings.longest_periods * np.median(periods)
    parts = settings.parts
    pieces = np.arange(parts)
    t_ns = np.append((stamps[:-1, None] + periods[:, None] * pieces // parts).ravel(), stamps[-1])

    def along(column: F64) -> F64:
        values = column[known]
        rise = np.where(whole, np.diff(values), 0.0)
        return np.append((values[:-1, None] + rise[:, None] * (pieces + 0.5) / parts).ravel(), values[-1])

    def repeated(column: F64) -> F64:
        return np.append(np.repeat(column[known][:-1], parts), column[known][-1])

    return TorqueTrack(
        t_ns,
        along(track.left_nm),
        along(track.right_nm),
        repeated(track.left_radps),
        repeated(track.right_radps),
    )


def problem_of(log: Log, extension: Extension, options: GapOptions) -> Problem:
    """The whole log with the modes that the options ask for."""
    if options.modes == "identified":
        seen = likely_modes(log, extension, options.gates)
        return Problem.of(bin_identified(log, seen, options.gates)).all_fitted()
    told = log.mode if options.modes == "given" else None
    return Problem.of(bin_log(log, options.gates, told)).all_fitted()


def deviance(problem: Problem, extension: Extension) -> float:
    """−2 log-likelihood at its own disturbance."""
    return problem.deviance(extension, fit_diffusion(problem, extension))
