"""The population of hypotheses: switches are hypothesised, the improbable and the redundant are dropped."""

from typing import NamedTuple

import numpy as np
from numba import njit

from wmr_replay.identify.bank.states import (
    BOTH,
    LN_ALPHA,
    LN_BETA,
    LN_C,
    N_STATES,
    OMEGA,
    PSI,
    RHO,
    SKIDDING,
    SLIPPING,
    V_LAT,
    V_LONG,
    Prior,
)
from wmr_schemas.arrays import F64, I64

LEAST_LOG_WEIGHT = -14.0
SPLIT_LOG_WEIGHT = -9.0
LEVEL_CHANGE = 1e-3
"""Probability, at each split, that the level of disturbance has changed to a neighbouring one."""
ALIKE_SD = 0.2
ALIKE_VARIANCE = 1.5
COMPARED = np.array([V_LONG, V_LAT, OMEGA, LN_ALPHA, LN_C, RHO])


class Population(NamedTuple):
    """The first ``size`` (1,) of H hypotheses live: means (H, 10), covariances (H, 10, 10), log weights (H,),
    modes (H,), and levels of disturbance (H,).
    """

    mean: F64
    covariance: F64
    log_weight: F64
    mode: I64
    level: I64
    size: I64


def make_population(room: int) -> Population:
    """Nobody yet."""
    return Population(
        np.zeros((room, N_STATES)),
        np.zeros((room, N_STATES, N_STATES)),
        np.zeros(room),
        np.zeros(room, np.int64),
        np.zeros(room, np.int64),
        np.zeros(1, np.int64),
    )


@njit(cache=True)
def copy(people: Population, source: int, target: int) -> None:
    """One hypothesis over another."""
    people.mean[target] = people.mean[source]
    people.covariance[target] = people.covariance[source]
    people.log_weight[target] = people.log_weight[source]
    people.mode[target] = people.mode[source]
    people.level[target] = people.level[source]


@njit(cache=True)
def vary_level(people: Population, n_levels: int) -> None:
    """The most probable hypothesis may have met calmer or rougher ground: a child at either level beside."""
    best = int(np.argmax(people.log_weight[: people.size[0]]))
    for level in (people.level[best] - 1, people.level[best] + 1):
        child = people.size[0]
        if 0 <= level < n_levels and child < people.mode.shape[0]:
            copy(people, best, child)
            people.level[child] = level
            people.log_weight[child] += np.log(LEVEL_CHANGE)
            people.size[0] += 1


@njit(cache=True)
def stop_skidding(mean: F64, covariance: F64) -> None:
    """The state jump into a mode without lateral velocity, and the start of a skid: v_lat = 0 exactly."""
    mean[V_LAT] = 0.0
    covariance[V_LAT, :] = 0.0
    covariance[:, V_LAT] = 0.0


@njit(cache=True)
def spread_sideways(mean: F64, covariance: F64, when_sd: float) -> None:
    """A skid that ended at an uncertain instant leaves the position uncertain by v_lat · that time."""
    across = (-np.sin(mean[PSI]), np.cos(mean[PSI]))
    for a in range(2):
        for b in range(2):
            covariance[a, b] += across[a] * across[b] * (mean[V_LAT] * when_sd) ** 2


@njit(cache=True)
def split(
    people: Population,
    n_modes: int,
    interval_s: float,
    rate: float,
    inputs: tuple[float, float],
    prior: Prior,
) -> None:
    """Each probable hypothesis has switched, or not, within the last ``interval_s``: one child for each other
    mode.

    The switch may lie anywhere in the interval: the velocity that the modes would have gained apart in a
    uniformly distributed time goes into the child's covariance.
    """
    switched = 1.0 - np.exp(-rate * interval_s)
    when_sd = interval_s / np.sqrt(12.0)
    for parent in range(people.size[0]):
        if people.log_weight[parent] < SPLIT_LOG_WEIGHT:
            continue
        before = people.mode[parent]
        for mode in range(n_modes):
            child = people.size[0]
            if mode == before or child == people.mode.shape[0]:
                continue
            copy(people, parent, child)
            people.mode[child] = mode
            people.log_weight[child] += np.log(switched / (n_modes - 1))
            people.size[0] += 1
            mean, covariance = people.mean[child], people.covariance[child]
            skidded, skids = before in (SKIDDING, BOTH), mode in (SKIDDING, BOTH)
            if skidded and not skids:
                spread_sideways(mean, covariance, when_sd)
            if not (skidded and skids):
                stop_skidding(mean, covariance)
            if skids and not skidded:
                covariance[V_LAT, V_LAT] += (mean[V_LONG] * mean[OMEGA] * when_sd) ** 2
            if (before in (SLIPPING, BOTH)) != (mode in (SLIPPING, BOTH)):
                lost, yaw_lost = 1.0 - mean[RHO], 1.0 - prior.yaw_slip_ratio * mean[RHO]
                drive, spin = np.exp(mean[LN_ALPHA]) * inputs[0], np.exp(mean[LN_BETA]) * inputs[1]
                covariance[V_LONG, V_LONG] += (lost * drive * when_sd) ** 2
                covariance[OMEGA, OMEGA] += (yaw_lost * spin * when_sd) ** 2
        people.log_weight[parent] += np.log1p(-switched)


@njit(cache=True)
def alike(people: Population, a: int, b: int) -> bool:
    """Whether two hypotheses of one mode and one level have come to say the same."""
    if people.mode[a] != people.mode[b] or people.level[a] != people.level[b]:
        return False
    for s in COMPARED:
        variance, other = people.covariance[a, s, s], people.covariance[b, s, s]
        apart = people.mean[a, s] - people.mean[b, s]
        if apart * apart > ALIKE_SD**2 * variance + 1e-14:
            return False
        if other > ALIKE_VARIANCE * variance + 1e-14 or variance > ALIKE_VARIANCE * other + 1e-14:
            return False
    return True


@njit(cache=True)
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


@njit(cache=True)
def normalise(people: Population) -> None:
    """Weights that add up to 1."""
    n = people.size[0]
    top = np.max(people.log_weight[:n])
    people.log_weight[:n] -= top + np.log(np.sum(np.exp(people.log_weight[:n] - top)))
