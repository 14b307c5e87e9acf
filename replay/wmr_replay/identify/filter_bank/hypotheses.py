"""The set of hypotheses: improbable ones are pruned, similar ones are merged."""

import math
from typing import Any, NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.ordering import STACK_ROWS, order_by_weight, sort_indices
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import (
    IDEAL,
    LN_ALPHA,
    LN_BETA,
    LN_C,
    N_STATES,
    OMEGA,
    RHO,
    SKIDDING,
    V_LAT,
    V_LONG,
)
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean

LN_2 = math.log(2.0)
LEAST_LOG_WEIGHT = PRIORS.prune_log_weight
LOG_LEVEL_CHANGE, LOAD_CHANGES_PER_S = math.log(PRIORS.level_change), PRIORS.load_changes_per_s
LOAD_VARIANCE = PRIORS.load_change_sd * PRIORS.load_change_sd
N_CALM, CALM_LOG_PRIOR = PRIORS.n_calm_levels, PRIORS.calm_level_log_prior
ALIKE_VARIANCE_OF_MEAN = PRIORS.merge_sd * PRIORS.merge_sd
ALIKE_VARIANCE = PRIORS.merge_variance_ratio
TINY = 1e-14
N_MODES = 4
NEVER_S = -1e9
N_HABITS = 6
LEFT, ROLLED_S, ENDED, LOST_S, ACROSS, PRESENT_S = range(N_HABITS)
"""Habits: how often rolling has been left, for how long the robot rolled; how often what is no rolling has
ended, for how long these lasted, how many of these ends led into another mode than rolling, and for how long
a skid or slip has lasted that has not ended.
"""
N_CARRIED = 9
"""The fields of a set that hold a row for each hypothesis."""
COMPARED = (V_LONG, V_LAT, OMEGA, LN_ALPHA, LN_C, RHO)


class HypothesisSet(NamedTuple):
    """The first ``size`` (1,) of H hypotheses live.

    Each has a mean (s,), a covariance (s, s), a log weight, a mode and a level of disturbance; ``slips``
    (2,): how often it has slipped so far, in the form of a share, and on slippery ground; ``habits`` (6,):
    how often and after how long it has switched; and when, in s, its pose last jumped. ``past`` (S, 4) holds
    the probabilities of the modes that led to it, in a ring of S intervals; ``past_s`` (S,) are the ends of
    these intervals in s and ``n_past`` (1,) their number so far. A bank that does not look back has S = 0.
    ``order``, ``kept`` (H,) and ``stack`` (64, 2) are scratch.
    """

    mean: F64
    covariance: F64
    log_weight: F64
    mode: I64
    level: I64
    slips: F64
    habits: F64
    jumped_s: F64
    past: F64
    past_s: F64
    n_past: I64
    size: I64
    order: I64
    kept: I64
    stack: I64


def make_hypotheses(room: int, intervals: int = 0, n_states: int = N_STATES) -> HypothesisSet:
    """An empty set with room for so many hypotheses, each with a past of so many intervals."""
    return HypothesisSet(
        np.zeros((room, n_states)),
        np.zeros((room, n_states, n_states)),
        np.zeros(room),
        np.zeros(room, np.int64),
        np.zeros(room, np.int64),
        np.zeros((room, 2)),
        np.zeros((room, N_HABITS)),
        np.full(room, NEVER_S),
        np.zeros((room, intervals, N_MODES)),
        np.zeros(intervals),
        np.zeros(1, np.int64),
        np.zeros(1, np.int64),
        np.zeros(room, np.int64),
        np.zeros(room, np.int64),
        np.zeros((STACK_ROWS, 2), np.int64),
    )


def snapshot(hypotheses: HypothesisSet) -> list[Any]:
    """Copies of what is known of the live hypotheses, for :func:`restore`."""
    n = int(hypotheses.size[0])
    return [array[:n].copy() for array in hypotheses[:N_CARRIED]]


def restore(before: list[Any], hypotheses: HypothesisSet) -> None:
    """Put a :func:`snapshot` back."""
    hypotheses.size[0] = len(before[0])
    for array, content in zip(hypotheses[:N_CARRIED], before, strict=True):
        array[: len(content)] = content


@lean
def copy(hypotheses: HypothesisSet, source: int, target: int) -> None:
    """One hypothesis over another."""
    n_states = hypotheses.mean.shape[1]
    for i in range(n_states):
        hypotheses.mean[target, i] = hypotheses.mean[source, i]
        for j in range(n_states):
            hypotheses.covariance[target, i, j] = hypotheses.covariance[source, i, j]
    hypotheses.log_weight[target] = hypotheses.log_weight[source]
    hypotheses.mode[target] = hypotheses.mode[source]
    hypotheses.level[target] = hypotheses.level[source]
    hypotheses.slips[target, 0] = hypotheses.slips[source, 0]
    hypotheses.slips[target, 1] = hypotheses.slips[source, 1]
    for k in range(N_HABITS):
        hypotheses.habits[target, k] = hypotheses.habits[source, k]
    hypotheses.jumped_s[target] = hypotheses.jumped_s[source]
    for k in range(hypotheses.past.shape[1]):
        for m in range(N_MODES):
            hypotheses.past[target, k, m] = hypotheses.past[source, k, m]


@lean
def log_prior_of_level(level: int) -> float:
    """Log prior of a level of disturbance: equal, except that each of the lowest has a tenth of the next."""
    return float(min(level - N_CALM, 0) * CALM_LOG_PRIOR)


@lean
def most_probable(log_weight: F64, n: int) -> int:
    """The first of the n largest weights' indices; NaN counts as largest."""
    best = 0
    for h in range(1, n):
        if not log_weight[h] <= log_weight[best] and not math.isnan(log_weight[best]):
            best = h
    return best


@lean
def vary_level(hypotheses: HypothesisSet, n_levels: int) -> None:
    """The most probable hypothesis may have met calmer or rougher ground: a child at either level beside."""
    best = most_probable(hypotheses.log_weight, hypotheses.size[0])
    for level in (hypotheses.level[best] - 1, hypotheses.level[best] + 1):
        child = hypotheses.size[0]
        if 0 <= level < n_levels and child < hypotheses.mode.shape[0]:
            copy(hypotheses, best, child)
            hypotheses.level[child] = level
            calmer = log_prior_of_level(level) - log_prior_of_level(hypotheses.level[best])
            hypotheses.log_weight[child] += LOG_LEVEL_CHANGE + min(calmer, 0.0)
            hypotheses.size[0] += 1


@lean
def change_load(hypotheses: HypothesisSet, interval_s: float) -> None:
    """The robot may have been loaded or unloaded: a child of the most probable hypothesis whose α is open
    again; not while that slips, for then only the traction left is seen, α times an unknown share.
    """
    best, child = most_probable(hypotheses.log_weight, hypotheses.size[0]), hypotheses.size[0]
    if hypotheses.mode[best] in (IDEAL, SKIDDING) and child < hypotheses.mode.shape[0]:
        copy(hypotheses, best, child)
        hypotheses.log_weight[child] += math.log(LOAD_CHANGES_PER_S * interval_s)
        for a in (LN_ALPHA, LN_BETA):
            for b in (LN_ALPHA, LN_BETA):
                hypotheses.covariance[child, a, b] += LOAD_VARIANCE
        hypotheses.size[0] += 1


@lean
def are_alike(hypotheses: HypothesisSet, a: int, b: int) -> bool:
    """Whether two hypotheses of one mode, one level and the same jumps have come to agree."""
    if hypotheses.mode[a] != hypotheses.mode[b] or hypotheses.level[a] != hypotheses.level[b]:
        return False
    if hypotheses.jumped_s[a] != hypotheses.jumped_s[b]:
        return False
    for s in COMPARED:
        variance, other = hypotheses.covariance[a, s, s], hypotheses.covariance[b, s, s]
        apart = hypotheses.mean[a, s] - hypotheses.mean[b, s]
        if apart * apart > ALIKE_VARIANCE_OF_MEAN * variance + TINY:
            return False
        if other > ALIKE_VARIANCE * variance + TINY or variance > ALIKE_VARIANCE * other + TINY:
            return False
    return True


@lean
def twin_of(hypotheses: HypothesisSet, candidate: int, n_kept: int) -> int:
    """The most probable of those kept that agrees with the candidate; −1 where there is none."""
    for k in range(n_kept):
        if are_alike(hypotheses, hypotheses.kept[k], candidate):
            return int(hypotheses.kept[k])
    return -1


@lean
def merge_pasts(hypotheses: HypothesisSet, twin: int, candidate: int) -> None:
    """The past of two hypotheses that become one: the mean of their pasts by weight."""
    if hypotheses.past.shape[1] == 0:
        return
    share = 1.0 / (1.0 + math.exp(hypotheses.log_weight[twin] - hypotheses.log_weight[candidate]))
    for k in range(hypotheses.past.shape[1]):
        for m in range(N_MODES):
            own, other = hypotheses.past[twin, k, m], hypotheses.past[candidate, k, m]
            hypotheses.past[twin, k, m] = own + share * (other - own)


@lean
def merge_habits(hypotheses: HypothesisSet, twin: int, candidate: int) -> None:
    """The habits of two hypotheses that become one: what either has counted, by weight."""
    share = 1.0 / (1.0 + math.exp(hypotheses.log_weight[twin] - hypotheses.log_weight[candidate]))
    for k in range(N_HABITS):
        own, other = hypotheses.habits[twin, k], hypotheses.habits[candidate, k]
        hypotheses.habits[twin, k] = own + share * (other - own)


@lean
def log_of_sum(one: float, other: float) -> float:
    """Ln(exp(one) + exp(other)), as ``logaddexp``, which would import numba's functions of numpy: .1 s."""
    if one == other:
        return float(one + LN_2)
    more, less = (one, other) if one > other else (other, one)
    return float(more + math.log1p(math.exp(less - more)))


@lean
def prune_and_merge(hypotheses: HypothesisSet, most: int) -> None:
    """Keep the ``most`` probable; one that agrees with a more probable one gives its weight to it."""
    size, order, kept = hypotheses.size[0], hypotheses.order, hypotheses.kept
    order_by_weight(hypotheses.log_weight, size, order, hypotheses.stack)
    least = hypotheses.log_weight[order[0]] + LEAST_LOG_WEIGHT
    n_kept = 0
    for place in range(size):
        candidate = order[place]
        if n_kept == most or hypotheses.log_weight[candidate] < least:
            break
        twin = twin_of(hypotheses, candidate, n_kept)
        if twin >= 0:
            merge_pasts(hypotheses, twin, candidate)
            merge_habits(hypotheses, twin, candidate)
            hypotheses.log_weight[twin] = log_of_sum(
                hypotheses.log_weight[twin], hypotheses.log_weight[candidate]
            )
        else:
            kept[n_kept] = candidate
            n_kept += 1
    sort_indices(kept, n_kept)
    for place in range(n_kept):
        if kept[place] != place:
            copy(hypotheses, kept[place], place)
    hypotheses.size[0] = n_kept


@lean
def normalise(hypotheses: HypothesisSet) -> None:
    """Weights that add up to 1."""
    n, log_weight = hypotheses.size[0], hypotheses.log_weight
    top, total = log_weight[most_probable(log_weight, n)], 0.0
    for h in range(n):
        total += math.exp(log_weight[h] - top)
    scale = top + math.log(total)
    for h in range(n):
        log_weight[h] -= scale
