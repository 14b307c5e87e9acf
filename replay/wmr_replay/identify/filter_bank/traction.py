"""Traction by mode: the full torque, a share of it, or at most what friction carries."""

import math
from typing import NamedTuple

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import (
    CAPPED,
    LN_ALPHA,
    LN_BETA,
    RHO,
    SKIDDING_SLIPPING,
    SLIPPING,
    Prior,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

LEAST_DEMAND_MPS2 = PRIORS.least_demand_mps2
LEAST_CAP_VARIANCE = PRIORS.least_cap_sd * PRIORS.least_cap_sd
SQRT_2 = math.sqrt(2.0)


class Traction(NamedTuple):
    """dv_long/dt and dω/dt by the torques, and their derivatives by ln α, ln β and the mode's own
    parameter.
    """

    ahead: float
    turning: float
    ahead_by_alpha: float
    turning_by_beta: float
    ahead_by_own: float
    turning_by_own: float


@lean
def traction(mean: F64, mode: int, force: float, turn: float, prior: Prior) -> Traction:
    """Rolling: α Σeffort and β Δeffort. Slipping: the share ρ of it, and ρ times a ratio in yaw. Capped: each
    wheel's α·effort within ± cap, its logarithm in the place of ρ; a capped wheel does not observe α.
    """
    alpha, beta = math.exp(mean[LN_ALPHA]), math.exp(mean[LN_BETA])
    drive, spin = alpha * force, beta * turn
    if mode in (SLIPPING, SKIDDING_SLIPPING):
        share, yaw_share = mean[RHO], mean[RHO] * prior.yaw_slip_ratio
        ahead, turning = share * drive, yaw_share * spin
        return Traction(ahead, turning, ahead, turning, drive, prior.yaw_slip_ratio * spin)
    if mode != CAPPED:
        return Traction(drive, spin, drive, spin, 0.0, 0.0)
    cap = math.exp(mean[RHO])
    free_ahead, free_turning, held_ahead, held_turning = 0.0, 0.0, 0.0, 0.0
    for side in (1.0, -1.0):
        effort = 0.5 * (force + side * turn)
        share = cap / max(alpha * abs(effort), cap)
        if share < 1.0:
            held_ahead += share * alpha * effort
            held_turning += side * share * beta * effort
        else:
            free_ahead += alpha * effort
            free_turning += side * beta * effort
    ahead, turning = free_ahead + held_ahead, free_turning + held_turning
    return Traction(ahead, turning, free_ahead, free_turning, held_ahead, held_turning)


@lean
def largest_demand(mean: F64, force: float, turn: float) -> float:
    """What the harder driven wheel would contribute to dv_long/dt, α |effort|."""
    return float(0.5 * math.exp(mean[LN_ALPHA]) * (abs(force) + abs(turn)))


@lean
def slipping_share(mean: F64, covariance: F64, force: float, turn: float) -> float:
    """How probable it is that the harder driven wheel demands more than the cap; 0 without a known torque.

    A demand about as large as the cap moves the robot as rolling does, and rolling needs less to be so:
    slipping is named where the demand is beyond the cap by a standard deviation of it.
    """
    if math.isnan(force) or math.isnan(turn):
        return 0.0
    over = math.log(max(largest_demand(mean, force, turn), LEAST_DEMAND_MPS2)) - mean[RHO]
    sd = math.sqrt(max(covariance[RHO, RHO], LEAST_CAP_VARIANCE))
    return 0.5 * (1.0 + math.erf((over / sd - 1.0) / SQRT_2))
