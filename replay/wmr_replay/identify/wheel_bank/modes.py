"""From slip velocities to contact modes: how probable it is that they exceed what counts as slip."""

import math

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet
from wmr_replay.identify.wheel_bank.predict import body_motion
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import (
    IDEAL,
    S_DIFF,
    S_LAT,
    S_SUM,
    SKIDDING,
    SKIDDING_SLIPPING,
    SLIPPING,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

SLIP_MPS, SLIP_SHARE, SKID_MPS = WHEEL_PRIORS.slip_mps, WHEEL_PRIORS.slip_share, WHEEL_PRIORS.skid_mps
SQRT_HALF = math.sqrt(0.5)
N_SLIPS = 6
"""Means of s_L, s_R and s_lat, then their second moments."""


@lean
def within(mean: float, variance: float, limit: float) -> float:
    """P(|x| < limit) for a Gaussian x."""
    scale = SQRT_HALF / math.sqrt(max(variance, 1e-18))
    return 0.5 * (math.erf((limit - mean) * scale) + math.erf((limit + mean) * scale))


@lean
def shares_of_modes(mean: F64, covariance: F64, mode: int, wheels: F64, out: F64) -> None:
    """``out`` (4,): the probabilities of the modes in one hypothesis. A wheel slips where |s| exceeds
    max(5 cm/s, 3 % of |v|), the robot skids where |s_lat| exceeds 3 cm/s.
    """
    v, _, _ = body_motion(mean, wheels)
    limit = max(SLIP_MPS, SLIP_SHARE * abs(v))
    both = covariance[S_SUM, S_SUM] + covariance[S_DIFF, S_DIFF]
    cross = 2.0 * covariance[S_SUM, S_DIFF]
    right = within(mean[S_SUM] + mean[S_DIFF], both + cross, limit)
    left = within(mean[S_SUM] - mean[S_DIFF], both - cross, limit)
    rolls = min(right, left) * max(right, left) ** 0.5
    stays = within(mean[S_LAT], covariance[S_LAT, S_LAT], SKID_MPS)
    out[IDEAL], out[SKIDDING] = rolls * stays, rolls * (1.0 - stays)
    out[SLIPPING], out[SKIDDING_SLIPPING] = (1.0 - rolls) * stays, (1.0 - rolls) * (1.0 - stays)


@lean
def count_modes(hypotheses: HypothesisSet, wheels: F64, shares: F64, out: F64) -> None:
    """The posterior (4,) over the modes, and moments of the slip velocities (6,), into ``out`` (10,)."""
    for h in range(hypotheses.size[0]):
        weight = math.exp(hypotheses.log_weight[h])
        mean, covariance = hypotheses.mean[h], hypotheses.covariance[h]
        shares_of_modes(mean, covariance, hypotheses.mode[h], wheels, shares)
        for m in range(4):
            out[m] += weight * shares[m]
        both = covariance[S_SUM, S_SUM] + covariance[S_DIFF, S_DIFF]
        cross = 2.0 * covariance[S_SUM, S_DIFF]
        left, right = mean[S_SUM] - mean[S_DIFF], mean[S_SUM] + mean[S_DIFF]
        out[4] += weight * left
        out[5] += weight * right
        out[6] += weight * mean[S_LAT]
        out[7] += weight * (left * left + both - cross)
        out[8] += weight * (right * right + both + cross)
        out[9] += weight * (mean[S_LAT] * mean[S_LAT] + covariance[S_LAT, S_LAT])
