"""Switches between modes: as in the wheel-speed bank, and a slip ends where it is small."""

import math

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, copy
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS
from wmr_replay.identify.joint_bank.traction import log_normal
from wmr_replay.identify.wheel_bank.states import IDEAL, S_DIFF, S_SUM, SKIDDING_SLIPPING, SLIPPING
from wmr_replay.identify.wheel_bank.switches import eagerness, remember_slips, switch
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

SPLIT_LOG_WEIGHT = PRIORS.split_log_weight
STOP_VARIANCE = JOINT_PRIORS.stop_sd_mps**2
USUAL_VARIANCE = JOINT_PRIORS.start_slip_sd_mps**2
SQRT_12 = math.sqrt(12.0)


@lean
def slips(mode: int) -> bool:
    """Whether wheels slip in this mode."""
    return mode in (SLIPPING, SKIDDING_SLIPPING)


@lean
def end_slip(mean: F64, covariance: F64, work: F64) -> float:
    """A slip that ends is small: both slips are 0 within ``STOP_VARIANCE``. The log of how much more probable
    that is here than of any slip, 0 where nothing is known of it. ``work`` (s,) is scratch.
    """
    total, n = 0.0, mean.shape[0]
    for state in (S_SUM, S_DIFF):
        variance = covariance[state, state] + STOP_VARIANCE
        value = mean[state]
        total += log_normal(value, variance) - log_normal(0.0, max(USUAL_VARIANCE, variance))
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
def split(
    hypotheses: HypothesisSet, n_modes: int, interval_s: float, rates: F64, calm: F64, work: F64
) -> None:
    """Each probable hypothesis has switched, or not, within the last ``interval_s``: one child for each other
    mode. ``rates`` (4, 4) a second are those from mode to mode, ``calm`` (levels,) the variances of elastic
    slip.
    """
    when_sd = interval_s / SQRT_12
    remember_slips(hypotheses, interval_s)
    for parent in range(hypotheses.size[0]):
        if hypotheses.log_weight[parent] < SPLIT_LOG_WEIGHT:
            continue
        before, leaving = hypotheses.mode[parent], 0.0
        eager = eagerness(hypotheses.slips[parent]) if before == IDEAL else 1.0
        for mode in range(n_modes):
            child = hypotheses.size[0]
            if child == hypotheses.mode.shape[0] or mode == before:
                continue
            copy(hypotheses, parent, child)
            rate = eager * rates[before, mode]
            hypotheses.mode[child] = mode
            hypotheses.log_weight[child] += math.log(1.0 - math.exp(-rate * interval_s))
            hypotheses.slips[child, 0] += 1.0 if before == IDEAL else 0.0
            hypotheses.size[0] += 1
            leaving += rate
            mean, covariance = hypotheses.mean[child], hypotheses.covariance[child]
            if slips(before) and not slips(mode):
                hypotheses.log_weight[child] += end_slip(mean, covariance, work)
            switch(mean, covariance, before, mode, when_sd, calm[hypotheses.level[child]])
        hypotheses.log_weight[parent] -= leaving * interval_s
