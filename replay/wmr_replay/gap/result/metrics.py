"""The gap in numbers, before and after, with the interval of its reduction."""

import numpy as np

from wmr_replay.gap.estimation.path_error import WindowErrors
from wmr_replay.gap.evidence.paired import bootstrap_interval, signed_rank_p
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import GapMetric, HeldOutGap, TrainGap
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
