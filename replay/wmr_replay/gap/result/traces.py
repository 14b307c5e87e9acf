"""Paths and residuals for pictures."""

import numpy as np

from wmr_replay.gap.estimation.path_error import simulated_path, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.dynamics import D_LONG, D_YAW, V_LAT
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.result import Traces
from wmr_schemas.arrays import F64


def traces_of(problem: Problem, base: Fit, fit: Fit) -> Traces:
    """Measured and simulated paths, and what the filter makes of the difference."""
    drive = problem.drive
    windows = windows_of(drive, np.ones(len(drive), bool))
    return Traces(
        start_ns=drive.start_ns,
        t_s=drive.t_s,
        measured=drive.pose,
        base_path=simulated_path(drive, base.extension, windows, problem.variances),
        extended_path=simulated_path(drive, fit.extension, windows, problem.variances),
        base_residual=residual(problem, base.extension, base),
        extended_residual=residual(problem, fit.extension, base),
        held_out=(~problem.train).astype(np.float64),
        mode=drive.mode,
    )


def residual(problem: Problem, extension: Extension, noise_of: Fit) -> F64:
    """Filtered disturbances (n, 3): longitudinal [m/s²], lateral velocity [m/s], l·yaw_acc [m/s²], at the
    base model's diffusion for both, so that they compare.
    """
    states = problem.passed(extension, noise_of.noise, keep=True).states
    return states[:, [D_LONG, V_LAT, D_YAW]]
