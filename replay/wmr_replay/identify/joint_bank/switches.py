"""Switches between kinds of contact: as in the wheel-speed bank, and a slip ends where it is small."""

import math

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, copy
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS
from wmr_replay.identify.joint_bank.states import LOST, N_KINDS
from wmr_replay.identify.joint_bank.traction import log_normal_ratio
from wmr_replay.identify.wheel_bank.states import (
    IDEAL,
    S_DIFF,
    S_SUM,
    SKIDDING_SLIPPING,
    SLIPPING,
)
from wmr_replay.identify.wheel_bank.switches import switch
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

SPLIT_LOG_WEIGHT, KIND_PRIOR = PRIORS.split_log_weight, PRIORS.kind_prior
LOST_PRIOR = JOINT_PRIORS.lost_prior
STOP_VARIANCE = JOINT_PRIORS.stop_sd_mps**2
USUAL_VARIANCE = JOINT_PRIORS.start_slip_sd_mps**2
SQRT_12 = math.sqrt(12.0)


@lean
def slips_away(mode: int) -> bool:
    """Whether wheels run away in this kind of contact."""
    return mode in (SLIPPING, SKIDDING_SLIPPING)


@lean
def as_mode(mode: int) -> int:
    """The kind of contact of the wheel-speed bank whose slips are alike."""
    return IDEAL if mode == LOST else mode


@lean
def end_slip(mean: F64, covariance: F64, work: F64) -> float:
    """A slip that ends is small: both slips are 0 within ``STOP_VARIANCE``. The log of how much more probable
    that is here than of any slip, 0 where nothing is known of it.
    """
    total, n = 0.0, mean.shape[0]
    for state in (S_SUM, S_DIFF):
        variance = covariance[state, state] + STOP_VARIANCE
        value = mean[state]
        total += log_normal_ratio(value, variance, max(USUAL_VARIANCE, variance))
        for i in range(n):
            work[i] = covariance[i, state]
        for i in range(n):
            share = work[i] / variance
            mean[i] -= share * value
            for j in range(i, n):
                covariance[i, j] -= share * work[j]
                covariance[j, i] = covariance[i, j]
    return total


@lean
def share_of_kind(hypotheses: HypothesisSet, h: int, mode: int) -> float:
    """How probable it is that a slip is of this kind: (n_k + 1)/(n + 2) by those that the hypothesis has seen."""
    away, lost = hypotheses.slips[h, 0] + KIND_PRIOR, hypotheses.slips[h, 1] + LOST_PRIOR
    if mode == LOST:
        return lost / (away + lost)
    return away / (away + lost) if slips_away(mode) else 1.0


@lean
def split(
    hypotheses: HypothesisSet, interval_s: float, rate: float, calm: F64, work: F64
) -> None:
    """Each probable hypothesis has switched, or not, within the last ``interval_s``: one child for each other
    kind. ``calm`` (levels,) are the variances of elastic slip.
    """
    switched = 1.0 - math.exp(-rate * interval_s)
    when_sd, each = interval_s / SQRT_12, math.log(switched / 3.0)
    for parent in range(hypotheses.size[0]):
        if hypotheses.log_weight[parent] < SPLIT_LOG_WEIGHT:
            continue
        before = hypotheses.mode[parent]
        for mode in range(N_KINDS):
            child = hypotheses.size[0]
            if child == hypotheses.mode.shape[0] or mode == before:
                continue
            copy(hypotheses, parent, child)
            hypotheses.mode[child] = mode
            hypotheses.log_weight[child] += each + math.log(share_of_kind(hypotheses, parent, mode))
            hypotheses.size[0] += 1
            mean, covariance = hypotheses.mean[child], hypotheses.covariance[child]
            level = calm[hypotheses.level[child]]
            if slips_away(before) and not slips_away(mode):
                hypotheses.log_weight[child] += end_slip(mean, covariance, work)
            if slips_away(mode) and not slips_away(before):
                hypotheses.slips[child, 0] += 1.0
            if mode == LOST:
                hypotheses.slips[child, 1] += 1.0
            switch(mean, covariance, as_mode(before), as_mode(mode), when_sd, level)
        hypotheses.log_weight[parent] += math.log1p(-switched)
