"""What remains after the effects: the gap over the floor of noise, and the stretches that stand out."""

import numpy as np

from wmr_replay.gap.result.result import GapMetric, Remains, StandsOut, Traces
from wmr_replay.gap.settings.result import ShownSettings
from wmr_schemas.arrays import F64


def remains_of(
    position: GapMetric, yaw: GapMetric, traces: Traces, own: ShownSettings | None = None
) -> Remains:
    """Ratios of the held-out gaps after to noise, and the blocks in which the extended model errs most."""
    return Remains(
        position_over_floor=over_floor(position),
        yaw_over_floor=over_floor(yaw),
        blocks=blocks(traces, own or ShownSettings()),
    )


def over_floor(metric: GapMetric) -> float:
    """The gap after over what noise alone leaves; NaN without a window."""
    held_out = metric.held_out
    return held_out.after / held_out.floor if held_out.floor > 0 else float("nan")


def blocks(traces: Traces, own: ShownSettings) -> tuple[StandsOut, ...]:
    """The blocks that stand out, the largest first."""
    error_m = np.hypot(*(traces.measured - traces.extended_path)[:, :2].T)
    number = (traces.t_s // own.block_s).astype(np.int64)
    found: list[tuple[int, float]] = []
    for k in np.unique(number[np.isfinite(error_m)]):
        mine: F64 = error_m[(number == k) & np.isfinite(error_m)]
        found.append((int(k), float(np.sqrt(np.mean(mine**2)))))
    if not found:
        return ()
    median = float(np.median([size for _, size in found]))
    large = sorted((one for one in found if one[1] > own.stands_out * median), key=lambda one: -one[1])
    return tuple(
        StandsOut(k * own.block_s, (k + 1) * own.block_s, size, size / median)
        for k, size in large[: own.most_blocks]
    )
