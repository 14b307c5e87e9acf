"""Switches between modes: what a switch does to a hypothesis, and when one is hypothesised."""

import math

from wmr_replay.identify.filter_bank.hypotheses import (
    ACROSS,
    ENDED,
    LEFT,
    LOST_S,
    PRESENT_S,
    ROLLED_S,
    HypothesisSet,
    copy,
)
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import (
    CAPPED,
    IDEAL,
    N_STATES,
    OMEGA,
    PSI,
    RHO,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
    V_LAT,
    V_LONG,
    Prior,
)
from wmr_replay.identify.filter_bank.traction import LEAST_DEMAND_MPS2, largest_demand, traction
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

SPLIT_LOG_WEIGHT, KIND_PRIOR = PRIORS.split_log_weight, PRIORS.kind_prior
CAP_MEAN = PRIORS.cap_below_demand_mean
CAP_VARIANCE = PRIORS.cap_below_demand_sd * PRIORS.cap_below_demand_sd
SQRT_12 = math.sqrt(12.0)


@lean
def forget(covariance: F64, state: int) -> None:
    """A state that is known exactly: its row and column vanish."""
    for i in range(N_STATES):
        covariance[state, i] = covariance[i, state] = 0.0


@lean
def stop_skidding(mean: F64, covariance: F64) -> None:
    """The state jump into a mode without lateral velocity, and the start of a skid: v_lat = 0 exactly."""
    mean[V_LAT] = 0.0
    forget(covariance, V_LAT)


@lean
def spread_sideways(mean: F64, covariance: F64, when_sd: float) -> None:
    """A skid that ended at an uncertain instant leaves the position uncertain by v_lat · that time."""
    across = (-math.sin(mean[PSI]), math.cos(mean[PSI]))
    for a in range(2):
        for b in range(2):
            covariance[a, b] += across[a] * across[b] * (mean[V_LAT] * when_sd) ** 2


@lean
def enter(mean: F64, covariance: F64, before: int, mode: int, demand: float, prior: Prior) -> None:
    """The mode's own parameter where it changes its meaning: ρ, or the cap, which a present slip exceeds."""
    if (before == CAPPED) == (mode == CAPPED):
        return
    forget(covariance, RHO)
    if mode == CAPPED:
        mean[RHO], covariance[RHO, RHO] = math.log(demand) + CAP_MEAN, CAP_VARIANCE
    else:
        mean[RHO], covariance[RHO, RHO] = prior.rho, prior.rho_sd**2


@lean
def switch(
    mean: F64,
    covariance: F64,
    modes: tuple[int, int],
    when_sd: float,
    inputs: tuple[float, float],
    prior: Prior,
) -> None:
    """The state's jump from one of the ``modes`` into the other, at an instant known within ``when_sd``."""
    before, mode = modes
    skidded, skids = before in (SKIDDING, SKIDDING_SLIPPING), mode in (SKIDDING, SKIDDING_SLIPPING)
    if skidded and not skids:
        spread_sideways(mean, covariance, when_sd)
    if not (skidded and skids):
        stop_skidding(mean, covariance)
    if skids and not skidded:
        covariance[V_LAT, V_LAT] += (mean[V_LONG] * mean[OMEGA] * when_sd) ** 2
    was = traction(mean, before, inputs[0], inputs[1], prior)
    enter(mean, covariance, before, mode, largest_demand(mean, inputs[0], inputs[1]), prior)
    now = traction(mean, mode, inputs[0], inputs[1], prior)
    covariance[V_LONG, V_LONG] += ((now.ahead - was.ahead) * when_sd) ** 2
    covariance[OMEGA, OMEGA] += ((now.turning - was.turning) * when_sd) ** 2


@lean
def log_share_of_kind(slips: F64, capped: bool) -> float:
    """How probable a slip of this kind is, after n_k of it among n: (n_k + a)/(n + 2a).

    A robot's slips are mostly of one kind, and which is not known before.
    """
    return float(
        math.log((slips[1 if capped else 0] + KIND_PRIOR) / (slips[0] + slips[1] + 2.0 * KIND_PRIOR))
    )


@lean
def may_follow(before: int, mode: int, n_modes: int, can_cap: bool) -> bool:
    """Whether a switch is worth a hypothesis: not from one kind of slipping into the other."""
    if mode == CAPPED:
        return can_cap
    if mode == SKIDDING_SLIPPING and n_modes < 4:
        return False
    return mode != before and not (mode == SLIPPING and before == CAPPED)


@lean
def chances_of_switch(
    habits: F64, before: int, n_modes: int, interval_s: float
) -> tuple[float, float, float]:
    """How probable a switch within ``interval_s`` is: any, into rolling, into each other mode. The time is
    counted. A rate that nobody knows is (switches + a)/(time + b), a and b what it was before the log.

    A skid or slip counts once it has ended: one that lasts does not make its own end less probable, or
    rolling that looks like slipping never ends.
    """
    if before == IDEAL:
        habits[ROLLED_S] += interval_s
        switched = 1.0 - math.exp(-habits[LEFT] / habits[ROLLED_S] * interval_s)
        return switched, 0.0, switched / (n_modes - 1)
    habits[PRESENT_S] += interval_s
    switched = 1.0 - math.exp(-habits[ENDED] / habits[LOST_S] * interval_s)
    across = switched * habits[ACROSS] / habits[ENDED]
    return switched, switched - across, across / (n_modes - 2)


@lean
def count_switch(habits: F64, before: int, mode: int) -> None:
    """A hypothesis that has switched takes it up."""
    if before == IDEAL:
        habits[LEFT] += 1.0
    else:
        habits[ENDED] += 1.0
        habits[LOST_S] += habits[PRESENT_S]
        habits[PRESENT_S] = 0.0
        if mode != IDEAL:
            habits[ACROSS] += 1.0


@lean
def split(
    hypotheses: HypothesisSet,
    n_modes: int,
    interval_s: float,
    inputs: tuple[float, float],
    prior: Prior,
) -> None:
    """Each probable hypothesis has switched, or not, within the last ``interval_s``: one child for each other
    mode.

    The switch may lie anywhere in the interval: the velocity that the modes would have gained apart in a
    uniformly distributed time goes into the child's covariance. A slip may be of either kind, where the
    torques are large enough to tell.
    """
    when_sd = interval_s / SQRT_12
    for parent in range(hypotheses.size[0]):
        if hypotheses.log_weight[parent] < SPLIT_LOG_WEIGHT:
            continue
        before = hypotheses.mode[parent]
        switched, back, across = chances_of_switch(hypotheses.habits[parent], before, n_modes, interval_s)
        demand = largest_demand(hypotheses.mean[parent], inputs[0], inputs[1])
        can_cap = before in (IDEAL, SKIDDING) and demand > LEAST_DEMAND_MPS2
        for mode in (IDEAL, SKIDDING, SLIPPING, SKIDDING_SLIPPING, CAPPED):
            child = hypotheses.size[0]
            if child == hypotheses.mode.shape[0] or not may_follow(before, mode, n_modes, can_cap):
                continue
            copy(hypotheses, parent, child)
            hypotheses.mode[child] = mode
            if can_cap and mode in (SLIPPING, CAPPED):
                hypotheses.log_weight[child] += log_share_of_kind(hypotheses.slips[child], mode == CAPPED)
            if mode in (SLIPPING, CAPPED):
                hypotheses.slips[child, 1 if mode == CAPPED else 0] += 1.0
            hypotheses.log_weight[child] += math.log(back if mode == IDEAL else across)
            count_switch(hypotheses.habits[child], before, mode)
            hypotheses.size[0] += 1
            switch(
                hypotheses.mean[child], hypotheses.covariance[child], (before, mode), when_sd, inputs, prior
            )
        hypotheses.log_weight[parent] += math.log1p(-switched)
