"""The base and the extended model on another log of the robot, of which nothing was fitted.

Both simulate the other log's torques in windows of 4 s, each from its own fitted start, under one history of
contact modes: that of the extended model. Windows with slip are simulated too; the gap in numbers leaves them
out, as it does on the log that was analysed.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wmr_replay.gap.estimation.joined_torques import with_likelier_torques
from wmr_replay.gap.estimation.modes import bin_identified, identified_modes
from wmr_replay.gap.estimation.path_error import WindowErrors, simulated_path, window_errors, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.holdout import windows_within
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import BinnedLog, bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.metrics import gap_metric
from wmr_replay.gap.result.result import GapMetric, Traces
from wmr_replay.gap.result.traces import quantities_of
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log

IN_TIME = ("load_step", "slip_interval")
"""Effects in an interval of the analysed log's own time; another log has another."""


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """The gap on another log before and after, the paths, and the effects that were not taken along."""

    position: GapMetric
    yaw: GapMetric
    traces: Traces
    left_out: tuple[str, ...] = ()


def without_times(model: Model) -> tuple[Model, tuple[str, ...]]:
    """The model without effects in an interval of time, and their names."""
    kept = tuple(effect for effect in model.effects if effect.name not in IN_TIME)
    return replace(model, effects=kept), tuple(e.name for e in model.effects if e.name in IN_TIME)


def metrics_of(
    errors: Callable[[int], tuple[WindowErrors, WindowErrors]], options: GapOptions
) -> tuple[GapMetric, GapMetric]:
    """The gaps in position and yaw; ``errors(k)`` are the held-out and the fitted windows of model ``k``."""
    both = [errors(0), errors(1)]
    return gap_metric(both, "position", "m", options), gap_metric(both, "yaw", "rad", options)


def elsewhere(log: Log, known: tuple[Effect, ...], extended: Model, options: GapOptions) -> Elsewhere:
    """The base model with its ``known`` effects and the ``extended`` one on ``log``.

    Raises InvalidSignal where the log has no torques or is too short.
    """
    model, left_out = without_times(extended)
    log = replace(log, robot=model.robot)
    models = [BaseModel(model.robot, effects, "").extension for effects in (known, model.effects)]
    log, _ = with_likelier_torques(log, models[1], options)
    binned = binned_with_modes(log, models[1], options)
    windows = windows_of(binned, np.ones(len(binned), bool))
    counted = windows_within(Problem.of(binned), np.ones(len(binned), bool))

    def errors(k: int) -> tuple[WindowErrors, WindowErrors]:
        return window_errors(binned, models[k], counted), window_errors(binned, models[k], [])

    position, yaw = metrics_of(errors, options)
    unknown = np.full((len(binned), 3), np.nan)
    traces = Traces(
        start_ns=binned.start_ns,
        t_s=binned.t_s,
        measured=binned.pose,
        base_path=simulated_path(binned, models[0], windows),
        extended_path=simulated_path(binned, models[1], windows),
        base_residual=unknown,
        extended_residual=unknown,
        held_out=np.ones(len(binned)),
        mode=binned.mode,
        quantities=quantities_of(binned),
    )
    return Elsewhere(position, yaw, traces, left_out)


def binned_with_modes(log: Log, extension: Extension, options: GapOptions) -> BinnedLog:
    """The log in bins, with the contact modes that the options ask for."""
    if options.modes == "identified":
        return bin_identified(log, identified_modes(log, extension, options.gates), options.gates)
    return bin_log(log, options.gates, log.mode if options.modes == "given" else None)
