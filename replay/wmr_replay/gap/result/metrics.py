"""The gap in numbers, before and after, with the interval of its reduction."""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.path_error import WindowErrors, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.holdout import windows_within
from wmr_replay.gap.evidence.paired import bootstrap_interval, signed_rank_p
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import GapMetric, HeldOutGap, SlipGap, Traces, TrainGap
from wmr_schemas.arrays import F64


def gap_metric(
    errors: list[tuple[WindowErrors, WindowErrors]], what: str, unit: str, options: GapOptions
) -> GapMetric:
    """The gap in ``what`` (position or yaw) of the base and the extended model.

    ``errors`` holds, for either model, the held-out and the fitted windows.
    """
    (before, train_before), (after, train_after) = errors
    attribute = f"position_{unit}" if what == "position" else f"yaw_{unit}"
    b, a = getattr(before, attribute), getattr(after, attribute)
    floor = before.floor_m if what == "position" else before.floor_rad
    return GapMetric(
        metric=f"{what}_rms_{options.gates.windows.window_s:.0f}s",
        unit=unit,
        windows=len(b),
        train=TrainGap(rms(getattr(train_before, attribute)), rms(getattr(train_after, attribute))),
        held_out=HeldOutGap(rms(b), rms(a), rms(floor), *paired_reduction(b, a, options)),
    )


def with_slip_gaps(
    problem: Problem, traces: Traces, position: GapMetric, yaw: GapMetric
) -> tuple[GapMetric, GapMetric]:
    """The gaps with those of the windows that they leave out for slip, from the paths of the whole log: both
    models under one history of contact modes.
    """
    whole = np.ones(len(problem.binned), bool)
    kept = set(windows_within(problem, whole))
    left_out = [window for window in windows_of(problem.binned, whole) if window not in kept]
    if not left_out:
        return position, yaw
    rows = np.concatenate([np.arange(*window) for window in left_out])
    errors = [traces.measured[rows] - path[rows] for path in (traces.base_path, traces.extended_path)]
    away = SlipGap(len(left_out), *(rms(np.hypot(one[:, 0], one[:, 1])) for one in errors))
    turned = SlipGap(len(left_out), *(rms(one[:, 2]) for one in errors))
    return replace(position, in_slip=away), replace(yaw, in_slip=turned)


def rms(values: F64) -> float:
    """Root mean square; NaN of an empty array."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def paired_reduction(before: F64, after: F64, options: GapOptions) -> tuple[tuple[float, float], float]:
    """95 % interval of the reduction of the root mean square, and Wilcoxon's one-sided p.

    ``before`` and ``after`` (windows,) are pairs. Bootstrap percentiles over windows, drawn by the seed.
    Returns (0, 0) and 1 where there are too few windows or nothing changed.
    """
    own = options.gates.report
    if len(before) < own.least_windows or np.all(before == after):
        return (0.0, 0.0), 1.0

    def reduction(b: F64, a: F64) -> F64:
        return np.asarray(1 - np.sqrt(np.mean(a**2, axis=-1) / np.mean(b**2, axis=-1)))

    interval = bootstrap_interval((before, after), reduction, own.bootstrap_draws, options.seed)
    return interval, signed_rank_p(np.log(before) - np.log(after))
