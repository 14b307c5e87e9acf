"""Where model and measurement disagree, and the traces for plots."""

from collections.abc import Mapping

import numpy as np

from wmr_replay.gap.result.locate import bins_of, intervals_of, quantiles, regions_of
from wmr_replay.gap.result.result import Regime, Traces, Where
from wmr_replay.gap.settings.result import LocateSettings
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import Fit, View
from wmr_replay.gap.wheel_speed.predict import Problem, summed
from wmr_replay.gap.wheel_speed.rolling import motion
from wmr_replay.gap.wheel_speed.windows import Windows, gaps_of
from wmr_schemas.arrays import F64

RESIDUAL_S = 1.0
"""Time over which a slip velocity is taken for the traces."""


def locate(problem: Problem, base: Fit, extended: Fit, settings: LocateSettings) -> Where:
    """Channels, intervals, places and regimes of the base model's excess at the extended model's noise."""
    view = View.of(problem, extended.noises)
    errors = problem.bins.flat(np.clip(view.errors(base.values), -view.reject, view.reject))
    known = np.isfinite(errors[0])
    errors, t_s = errors[:, known], problem.bins.t_s[known]
    pose = problem.bins.mean(problem.record.pose)[:, known].T
    excess = (errors**2).sum(axis=0) - len(errors)
    channels = ("longitudinal", "lateral", "yaw")
    ratios = [b.density / max(e.density, 1e-12) for b, e in zip(base.noises, extended.noises, strict=True)]
    return Where(
        channels=dict(zip(channels, map(float, ratios), strict=True)),
        intervals=intervals_of(t_s, excess, settings),
        regions=regions_of(pose, excess, settings) if problem.record.anchored else (),
        regime=regimes(problem, errors, known, settings),
    )


def regimes(
    problem: Problem, errors: F64, known: F64, settings: LocateSettings
) -> Mapping[str, tuple[Regime, ...]]:
    """Mean squares of whitened errors (3, n) by speed and yaw rate of the base model."""
    speeds = np.abs(speeds_of(problem, {})[:, known])
    step_s = np.full(errors.shape[1], problem.bins.step_s)
    return {
        name: bins_of(values, quantiles(values, settings.quantile_bins), errors.T, step_s)
        for name, values in (("speed_mps", speeds[0]), ("yaw_rate_radps", speeds[2]))
        if np.ptp(values) > 0
    }


def speeds_of(problem: Problem, values: Values) -> F64:
    """Body velocities (3, n) by bin: ahead, left, yaw rate."""
    record = problem.record
    moved = np.stack(motion(record, problem.chassis, summed(problem.base, values), problem.smooth_rows))
    rows = np.clip(np.floor(record.at).astype(np.int64), 0, moved.shape[1] - 1)
    return problem.bins.mean(moved[:, rows])


def slip_velocities(problem: Problem, values: Values) -> F64:
    """What the model leaves unexplained, (n, 3): m/s ahead and left, rad/s; over a second, NaN at ends."""
    errors = problem.bins.flat(problem.errors(values))
    lag = max(1, round(RESIDUAL_S / problem.bins.step_s / 2))
    out = np.full_like(errors, np.nan)
    out[:, lag:-lag] = (errors[:, 2 * lag :] - errors[:, : -2 * lag]) / (2 * lag * problem.bins.step_s)
    block = problem.bins.block_of
    same = np.zeros(len(block), bool)
    same[lag:-lag] = (block[2 * lag :] == block[: -2 * lag]) & (block[lag:-lag] >= 0)
    return np.where(same, out, np.nan).T


def traces_of(
    problem: Problem, windows: Windows, base: Fit, extended: Fit, pose_sd: tuple[float, float], held_out: F64
) -> Traces:
    """Measured and simulated poses by bin, and the slip velocities that either model leaves."""
    bins, record = problem.bins, problem.record
    speeds = speeds_of(problem, extended.values)
    return Traces(
        start_ns=record.start_ns,
        t_s=bins.t_s,
        measured=bins.mean(record.pose).T,
        base_path=path_by_bin(problem, windows, base, pose_sd),
        extended_path=path_by_bin(problem, windows, extended, pose_sd),
        base_residual=slip_velocities(problem, base.values),
        extended_residual=slip_velocities(problem, extended.values),
        held_out=held_out,
        mode=np.zeros(len(bins.t_s)),
        quantities={"v_mps": speeds[0], "v_lat_mps": speeds[1], "yaw_rate_radps": speeds[2]},
    )


def path_by_bin(problem: Problem, windows: Windows, fit: Fit, pose_sd: tuple[float, float]) -> F64:
    """Simulated poses (n, 3), NaN outside the windows."""
    gaps = gaps_of(problem, windows, fit.values, pose_sd)
    path = np.full((3, problem.record.pose.shape[1]), np.nan)
    path[:, windows.rows[windows.inside]] = gaps.simulated[:, windows.inside]
    return problem.bins.mean(path).T
