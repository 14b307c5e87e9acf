"""Measured and simulated paths, and filtered disturbances, for plots."""

import numpy as np

from wmr_replay.gap.estimation.path_error import simulated_path, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.dynamics import D_LONG, D_YAW, V_LAT
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.result import Traces
from wmr_schemas.arrays import F64


def traces_of(problem: Problem, base: Fit, fit: Fit) -> Traces:
    """Measured and simulated paths, and the disturbances that the filter sees with either model."""
    binned = problem.binned
    windows = windows_of(binned, np.ones(len(binned), bool))
    return Traces(
        start_ns=binned.start_ns,
        t_s=binned.t_s,
        measured=binned.pose,
        base_path=simulated_path(binned, base.extension, windows),
        extended_path=simulated_path(binned, fit.extension, windows),
        base_residual=residual(problem, base.extension, base),
        extended_residual=residual(problem, fit.extension, base),
        held_out=(~problem.fold(0).train).astype(np.float64),
        mode=binned.mode,
        quantities=quantities_of(binned),
    )


def quantities_of(binned: BinnedLog) -> dict[str, F64]:
    """Speeds from the poses, smoothed, and efforts (n,), by their columns in the table of the traces."""
    columns = columns_of(binned)
    return {
        "v_mps": columns["v"],
        "v_lat_mps": columns["v_lat"],
        "yaw_rate_radps": columns["yaw_rate"],
        "effort_sum_nm": columns["effort_sum"],
        "effort_diff_nm": columns["effort_diff"],
        "effort_sum_rate_nmps": np.gradient(columns["effort_sum"], binned.t_s),
    }


def residual(problem: Problem, extension: Extension, noise_of: Fit) -> F64:
    """Filtered disturbances (n, 3): longitudinal [m/s²], lateral velocity [m/s], l·yaw_acc [m/s²].

    Both models are filtered at the diffusion of ``noise_of``, so that they compare.
    """
    states = problem.filtered(extension, noise_of.noise, keep=True).states
    return states[:, [D_LONG, V_LAT, D_YAW]]
