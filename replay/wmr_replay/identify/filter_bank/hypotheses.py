"""The population of hypotheses: the improbable and the redundant are dropped."""

from typing import NamedTuple

import numpy as np

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
from wmr_schemas.compiled import compiled

LEAST_LOG_WEIGHT = -14.0
LEVEL_CHANGE = 1e-3
"""Probability, at each split, that the level of disturbance has changed to a neighbouring one."""
N_CALM = 2
LOAD_CHANGES_PER_S, LOAD_CHANGE = 1 / 3600, 0.3
"""How often a robot's load changes, and by how much: sd of the change of ln α and ln β."""
NEVER_S = -1e9
ALIKE_SD = 0.2
ALIKE_VARIANCE = 1.5
COMPARED = np.array([V_LONG, V_LAT, OMEGA, LN_ALPHA, LN_C, RHO])


class Population(NamedTuple):
    """The first ``size`` (1,) of H hypotheses live: means (H, 10), covariances (H, 10, 10), log weights (H,),
    modes (H,), levels of disturbance (H,), how often each has slipped so far, (H, 2), in the form of a
    share, and on slippery ground; and when, in s, its pose last jumped (H,).
    """

    mean: F64
    covariance: F64
    log_weight: F64
    mode: I64
    level: I64
    slips: F64
    jumped_s: F64
    size: I64


def make_population(room: int) -> Population:
    """Nobody yet."""
    return Population(
        np.zeros((room, N_STATES)),
        np.zeros((room, N_STATES, N_STATES)),
        np.zeros(room),
        np.zeros(room, np.int64),
        np.zeros(room, np.int64),
        np.zeros((room, 2)),
        np.full(room, NEVER_S),
        np.zeros(1, np.int64),
    )


@compiled
def copy(people: Population, source: int, target: int) -> None:
    """One hypothesis over another."""
    people.mean[target] = people.mean[source]
    people.covariance[target] = people.covariance[source]
    people.log_weight[target] = people.log_weight[source]
    people.mode[target] = people.mode[source]
    people.level[target] = people.level[source]
    people.slips[target] = people.slips[source]
    people.jumped_s[target] = people.jumped_s[source]


@compiled
def log_prior_of_level(level: int) -> float:
    """Levels are equally probable but for the lowest, each a tenth of the next: a log must show that it is
    so calm.
    """
    return float(min(level - N_CALM, 0) * np.log(10.0))


@compiled
def vary_level(people: Population, n_levels: int) -> None:
    """The most probable hypothesis may have met calmer or rougher ground: a child at either level beside."""
    best = int(np.argmax(people.log_weight[: people.size[0]]))
    for level in (people.level[best] - 1, people.level[best] + 1):
        child = people.size[0]
        if 0 <= level < n_levels and child < people.mode.shape[0]:
            copy(people, best, child)
            people.level[child] = level
            calmer = log_prior_of_level(level) - log_prior_of_level(people.level[best])
            people.log_weight[child] += np.log(LEVEL_CHANGE) + min(calmer, 0.0)
            people.size[0] += 1


@compiled
def change_load(people: Population, interval_s: float) -> None:
    """The robot may have been loaded or unloaded: a child of the most probable hypothesis whose α is open
    again; not while that slips, for then only the traction left is seen, α times an unknown share.
    """
    best, child = int(np.argmax(people.log_weight[: people.size[0]])), people.size[0]
    if people.mode[best] in (IDEAL, SKIDDING) and child < people.mode.shape[0]:
        copy(people, best, child)
        people.log_weight[child] += np.log(LOAD_CHANGES_PER_S * interval_s)
        for a in (LN_ALPHA, LN_BETA):
            for b in (LN_ALPHA, LN_BETA):
                people.covariance[child, a, b] += LOAD_CHANGE**2
        people.size[0] += 1


@compiled
def alike(people: Population, a: int, b: int) -> bool:
    """Whether two hypotheses of one mode, one level and the same jumps have come to say the same."""
    if people.mode[a] != people.mode[b] or people.level[a] != people.level[b]:
        return False
    if people.jumped_s[a] != people.jumped_s[b]:
        return False
    for s in COMPARED:
        variance, other = people.covariance[a, s, s], people.covariance[b, s, s]
        apart = people.mean[a, s] - people.mean[b, s]
        if apart * apart > ALIKE_SD**2 * variance + 1e-14:
            return False
        if other > ALIKE_VARIANCE * variance + 1e-14 or variance > ALIKE_VARIANCE * other + 1e-14:
            return False
    return True


@compiled
def thin(people: Population, most: int) -> None:
    """Keep the ``most`` probable; one that says the same as a more probable one gives its weight to it."""
    order = np.argsort(-people.log_weight[: people.size[0]])
    least = people.log_weight[order[0]] + LEAST_LOG_WEIGHT
    kept = np.empty(min(most, order.shape[0]), np.int64)
    n_kept = 0
    for candidate in order:
        if n_kept == most or people.log_weight[candidate] < least:
            break
        twin = -1
        for k in range(n_kept):
            if alike(people, kept[k], candidate):
                twin = kept[k]
                break
        if twin >= 0:
            people.log_weight[twin] = np.logaddexp(people.log_weight[twin], people.log_weight[candidate])
        else:
            kept[n_kept] = candidate
            n_kept += 1
    kept = np.sort(kept[:n_kept])
    for place in range(n_kept):
        if kept[place] != place:
            copy(people, kept[place], place)
    people.size[0] = n_kept


@compiled
def normalise(people: Population) -> None:
    """Weights that add up to 1."""
    n = people.size[0]
    top = np.max(people.log_weight[:n])
    people.log_weight[:n] -= top + np.log(np.sum(np.exp(people.log_weight[:n] - top)))
