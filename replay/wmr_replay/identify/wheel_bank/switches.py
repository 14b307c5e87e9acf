"""Switches between modes: the slip velocities that begin and end, and when a switch is hypothesised."""

import math

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet, copy, most_probable
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import (
    IDEAL,
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
DOUBTS_PER_S = WHEEL_PRIORS.doubts_per_s
MEMORY_S = WHEEL_PRIORS.memory_s
FIRST_SLIPS, FIRST_S = WHEEL_PRIORS.first_slips, WHEEL_PRIORS.first_s
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
def doubt_unusual(hypotheses: HypothesisSet, interval_s: float, usual: F64) -> None:
    """An unusual centre of rotation may be a skid that was taken for it: a child of the most probable
    hypothesis whose parameters are the ``usual`` ones (2, 6), means and variances, where that variance is
    not 0.
    """
    best, child = most_probable(hypotheses.log_weight, hypotheses.size[0]), hypotheses.size[0]
    if child < hypotheses.mode.shape[0]:
        copy(hypotheses, best, child)
        hypotheses.log_weight[child] += math.log(DOUBTS_PER_S * interval_s)
        for k in range(usual.shape[1]):
            if usual[1, k] > 0.0:
                stop(hypotheses.mean[child], hypotheses.covariance[child], LN_SCALE + k, usual[1, k])
                hypotheses.mean[child, LN_SCALE + k] = usual[0, k]
        hypotheses.size[0] += 1


@lean
def remember_slips(hypotheses: HypothesisSet, interval_s: float) -> None:
    """Time passes for what each hypothesis remembers of its slips: their number, and the time they took."""
    left = math.exp(-interval_s / MEMORY_S)
    for h in range(hypotheses.size[0]):
        hypotheses.slips[h, 0] *= left
        hypotheses.slips[h, 1] = left * hypotheses.slips[h, 1] + interval_s


@lean
def eagerness(slips: F64) -> float:
    """The rate at which ideal rolling ends, over the prior's: a log that slipped often slips again soon."""
    return float((1.0 + slips[0] / FIRST_SLIPS) / (1.0 + slips[1] / FIRST_S))


@lean
def split(hypotheses: HypothesisSet, n_modes: int, interval_s: float, rates: F64, calm: F64) -> None:
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
            switch(
                hypotheses.mean[child],
                hypotheses.covariance[child],
                before,
                mode,
                when_sd,
                calm[hypotheses.level[child]],
            )
        hypotheses.log_weight[parent] -= leaving * interval_s
