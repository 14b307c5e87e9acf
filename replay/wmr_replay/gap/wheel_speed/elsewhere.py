"""The base and the extended model on another log of the robot, of which nothing was fitted: by wheel speeds.

Windows of 4 s from fitted starts; moments of slip are left out, by the extended model.
"""

import numpy as np

from wmr_replay.gap.estimation.path_error import WindowErrors
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.elsewhere import Elsewhere, metrics_of, without_times
from wmr_replay.gap.result.result import Traces
from wmr_replay.gap.wheel_speed.analyse import identified, problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.held_out import pose_noise
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_replay.gap.wheel_speed.windows import gaps_of, windows_of
from wmr_schemas.arrays import F64
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log


def elsewhere_on_wheels(
    log: Log, known: tuple[Effect, ...], extended: Model, options: GapOptions, driven_by: str
) -> Elsewhere:
    """As :func:`wmr_replay.gap.result.elsewhere.elsewhere`. Raises InvalidSignal."""
    model, left_out = without_times(extended)
    after = base_of(log.robot, model)
    before = base_of(log.robot, Model(robot=model.robot, effects=known))
    problem = problem_of([log], after, options, driven_by)
    if options.modes == "identified":
        problem = identified(problem, [log], after, options)
    windows, sd = windows_of(problem, options.gates.windows.window_s), pose_noise(problem)
    values = (before.values, after.values)

    def errors(k: int) -> tuple[WindowErrors, WindowErrors]:
        found = gaps_of(problem, windows, values[k], sd).errors
        return found, WindowErrors(*(part[:0] for part in found))

    position, yaw = metrics_of(errors, options)
    unknown = np.full((len(problem.bins.t_s), 3), np.nan)
    traces = Traces(
        start_ns=problem.record.start_ns,
        t_s=problem.bins.t_s,
        measured=problem.bins.mean(problem.record.pose).T,
        base_path=path_of(problem, values[0], options),
        extended_path=path_of(problem, values[1], options),
        base_residual=unknown,
        extended_residual=unknown,
        held_out=np.ones(len(problem.bins.t_s)),
        mode=np.zeros(len(problem.bins.t_s)),
    )
    return Elsewhere(position, yaw, traces, left_out)


def path_of(problem: Problem, values: Values, options: GapOptions) -> F64:
    """Simulated poses (n, 3) by bin, NaN outside the windows."""
    windows = windows_of(problem, options.gates.windows.window_s)
    simulated = gaps_of(problem, windows, values, pose_noise(problem)).simulated
    path = np.full((3, problem.record.pose.shape[1]), np.nan)
    path[:, windows.rows[windows.inside]] = simulated[:, windows.inside]
    return problem.bins.mean(path).T
