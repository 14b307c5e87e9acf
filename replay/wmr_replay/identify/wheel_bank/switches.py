"""Switches between modes: the slip velocities that begin and end, and when a switch is hypothesised."""

import math

import numpy as np

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, copy, most_probable
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import (
    LN_SCALE,
    LN_TRACK,
    PSI,
    S_DIFF,
    S_LAT,
    S_SUM,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
    X,
    Y,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

SPLIT_LOG_WEIGHT = PRIORS.split_log_weight
RATES = np.array(WHEEL_PRIORS.rates_per_s) / 0.15
DOUBTS_PER_S = WHEEL_PRIORS.doubts_per_s
SQRT_12 = math.sqrt(12.0)


@lean
def stop(mean: F64, covariance: F64, state: int, variance: float) -> None:
    """A slip velocity that has ended: what it was tells nothing any more, and elastic slip is left."""
    mean[state] = 0.0
    for i in range(mean.shape[0]):
        covariance[state, i] = covariance[i, state] = 0.0
    covariance[state, state] = variance


@lean
def spread(mean: F64, covariance: F64, along: float, across: float, turn: float) -> None:
    """A slip that began or ended at an uncertain instant leaves the pose uncertain by these lengths."""
    cos, sin = math.cos(mean[PSI]), math.sin(mean[PSI])
    covariance[X, X] += (along * cos) ** 2 + (across * sin) ** 2
    covariance[Y, Y] += (along * sin) ** 2 + (across * cos) ** 2
    covariance[X, Y] += (along * along - across * across) * cos * sin
    covariance[Y, X] = covariance[X, Y]
    covariance[PSI, PSI] += turn * turn


@lean
def switch(mean: F64, covariance: F64, before: int, mode: int, when_sd: float, calm: float) -> None:
    """The state's jump from the mode ``before`` into ``mode``, at an instant known within ``when_sd``."""
    slipped, slips = before in (SLIPPING, SKIDDING_SLIPPING), mode in (SLIPPING, SKIDDING_SLIPPING)
    skidded, skids = before in (SKIDDING, SKIDDING_SLIPPING), mode in (SKIDDING, SKIDDING_SLIPPING)
    if slipped and not slips:
        spread(
            mean, covariance, mean[S_SUM] * when_sd, 0.0, mean[S_DIFF] * when_sd * math.exp(-mean[LN_TRACK])
        )
        stop(mean, covariance, S_SUM, calm)
        stop(mean, covariance, S_DIFF, calm)
    if skidded and not skids:
        spread(mean, covariance, 0.0, mean[S_LAT] * when_sd, 0.0)
        stop(mean, covariance, S_LAT, calm)


@lean
def doubt(hypotheses: HypothesisSet, interval_s: float, variances: F64) -> None:
    """What was learnt may be wrong: a child of the most probable hypothesis whose parameters are open again
    by ``variances`` (6,).
    """
    best, child = most_probable(hypotheses.log_weight, hypotheses.size[0]), hypotheses.size[0]
    if child < hypotheses.mode.shape[0]:
        copy(hypotheses, best, child)
        hypotheses.log_weight[child] += math.log(DOUBTS_PER_S * interval_s)
        for k in range(variances.shape[0]):
            hypotheses.covariance[child, LN_SCALE + k, LN_SCALE + k] += variances[k]
        hypotheses.size[0] += 1


@lean
def split(hypotheses: HypothesisSet, n_modes: int, interval_s: float, rate: float, calm: F64) -> None:
    """Each probable hypothesis has switched, or not, within the last ``interval_s``: one child for each other
    mode. ``calm`` (levels,) are the variances of elastic slip.
    """
    when_sd = interval_s / SQRT_12
    for parent in range(hypotheses.size[0]):
        if hypotheses.log_weight[parent] < SPLIT_LOG_WEIGHT:
            continue
        before, leaving = hypotheses.mode[parent], 0.0
        for mode in range(n_modes):
            child = hypotheses.size[0]
            if child == hypotheses.mode.shape[0] or mode == before:
                continue
            copy(hypotheses, parent, child)
            hypotheses.mode[child] = mode
            hypotheses.log_weight[child] += math.log(1.0 - math.exp(-rate * RATES[before, mode] * interval_s))
            hypotheses.size[0] += 1
            switch(
                hypotheses.mean[child],
                hypotheses.covariance[child],
                before,
                mode,
                when_sd,
                calm[hypotheses.level[child]],
            )
            leaving += rate * RATES[before, mode]
        hypotheses.log_weight[parent] -= leaving * interval_s
