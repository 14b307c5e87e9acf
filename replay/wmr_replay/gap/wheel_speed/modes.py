"""Moments in which wheels slip or the robot skids: contact modes, which are no missing effects.

Rates of the unrolled path's errors over two bins are regressed robustly on everything that acts all the time,
so that no lasting effect is taken for slip. What then stands far out of the rest is slip, where it also
exceeds what counts as slip at all.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.wheel_speed.bins import bins_of
from wmr_replay.gap.wheel_speed.candidates import CALIBRATED, absent, parameters_of
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import inverse
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, replaced, summed
from wmr_schemas.arrays import F64, Bool

LASTING = (*CALIBRATED, "lateral_slip", "turning_slip", "slip_ratio", "heading_misalignment")
"""Effects that act all the time, together."""
MAD = 0.6745
"""Median of a standard normal's absolute value."""


def slip_mask(problem: Problem) -> Bool:
    """Poses (N,) of bins in which wheels slip or the robot skids."""
    return widened(problem, slipping(problem))


def slipping(problem: Problem) -> Bool:
    """Bins (n,) in which wheels slip or the robot skids."""
    own = problem.settings.modes
    start: Values = {name: absent(name) for name in LASTING}
    which = tuple(one for name in LASTING for one in parameters_of(name))
    weights = np.ones(len(problem.bins.start))
    rate = rates(problem, start)
    for _ in range(own.rounds):
        sd = spread(rate)
        columns = np.stack([column_rates(problem, start, one) for one in which], axis=-1)
        start = moved(start, which, regress(rate / sd, columns / sd[..., None], weights))
        rate = rates(problem, start)
        weights = 1 / (1 + np.nan_to_num((rate / spread(rate)) ** 2, nan=np.inf).max(axis=0) / own.soft**2)
    return beyond(problem, start, rate)


def rates(problem: Problem, values: Values) -> F64:
    """Rates (3, n) of the error about each bin: m/s ahead and left, rad/s; NaN at the ends of blocks."""
    return differences(problem, problem.measured - problem.predicted(values))


def column_rates(problem: Problem, values: Values, which: Parameter) -> F64:
    """The same of the prediction's slope by a parameter."""
    at, step = values[which.effect][which.key], which.step
    low, high = which.bounds
    up, down = min(at + step, high), max(at - step, low)
    change = problem.predicted(replaced(values, which, up)) - problem.predicted(replaced(values, which, down))
    return differences(problem, change / (up - down))


def differences(problem: Problem, path: F64) -> F64:
    """Central differences (3, n) within blocks over two bins."""
    bins = problem.bins
    out = np.full_like(path, np.nan)
    out[:, 1:-1] = (path[:, 2:] - path[:, :-2]) / (2 * bins.step_s)
    block = bins.block_of
    same = np.zeros(len(block), bool)
    same[1:-1] = (block[2:] == block[:-2]) & (block[1:-1] >= 0)
    return np.where(same, out, np.nan)


def spread(rate: F64) -> F64:
    """Robust standard deviation (3, 1) of rates."""
    known = rate[:, np.isfinite(rate[0])]
    sd = np.median(np.abs(known), axis=1, keepdims=True) / MAD if known.size else np.ones((3, 1))
    return np.maximum(sd, 1e-6)


def regress(errors: F64, columns: F64, weights: F64) -> F64:
    """Weighted least squares (p,) of errors (3, n) on columns (3, n, p)."""
    known = np.isfinite(errors[0]) & np.isfinite(columns).all(axis=(0, 2))
    root = np.sqrt(weights[known])
    A = (root[:, None] * columns[:, known]).reshape(-1, columns.shape[-1])
    b = (root * errors[:, known]).ravel()
    return np.asarray(inverse(A.T @ A) @ (A.T @ b))


def moved(values: Values, which: tuple[Parameter, ...], step: F64) -> Values:
    """Values after a step, within bounds."""
    for one, change in zip(which, step, strict=True):
        low, high = one.bounds
        values = replaced(values, one, float(np.clip(values[one.effect][one.key] + change, low, high)))
    return values


def beyond(problem: Problem, values: Values, rate: F64) -> Bool:
    """Bins (n,) whose slip counts: above the contract's bounds, and above what is usual on this record."""
    own, sd = problem.settings.modes, spread(rate)[:, 0]
    speed = np.abs(differences(problem, problem.predicted(values))[0])
    turn = problem.chassis.half_track_m * (1 + values["effective_track"]["ratio"])
    wheels = np.maximum(np.abs(rate[0] + turn * rate[2]), np.abs(rate[0] - turn * rate[2]))
    usual = own.far_out * np.hypot(sd[0], turn * sd[2])
    slips = wheels > np.maximum(np.maximum(own.slip_mps, own.slip_share * speed), usual)
    skids = np.abs(rate[1]) > max(own.skid_mps, own.far_out * sd[1])
    return np.asarray(slips | skids)


def widened(problem: Problem, slips: Bool) -> Bool:
    """Poses (N,) of the bins that slip, and of those beside them."""
    near = slips.copy()
    for _ in range(problem.settings.modes.widen_bins):
        near = near | np.concatenate([near[1:], [False]]) | np.concatenate([[False], near[:-1]])
    return np.repeat(near, problem.bins.count)


def without_slip(problem: Problem, mask: Bool) -> Problem:
    """The problem whose blocks end where the robot slips; unchanged where most of it would go."""
    if mask.mean() > problem.settings.modes.most_masked:
        return problem
    bins = bins_of(problem.record, problem.settings.layout, mask)
    return replace(problem, bins=bins, whole=problem.bins)


def ideal_only(problem: Problem, known: Values) -> Problem:
    """The problem without the moments of slip that remain where some effects are known; as it is where
    commands drive the model, whose errors are those of the drive.
    """
    if problem.record.driven_by == "command":
        return problem
    whole = problem.with_slip
    return without_slip(whole, slip_mask(replace(whole, base=summed(whole.base, known))))
