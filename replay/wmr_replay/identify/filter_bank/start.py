"""Initial hypotheses: a quadratic through the first bins, in every mode and level of disturbance.

Plain Python, since a start calls it once: to compile takes a thousand times as long.
"""

import math
from itertools import product

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, TURN, Bins
from wmr_replay.identify.filter_bank.hypotheses import CALM_LOG_PRIOR, N_CALM, HypothesisSet
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import (
    AHEAD,
    AROUND,
    IDEAL,
    LN_ALPHA,
    LN_BETA,
    LN_C,
    N_STATES,
    OMEGA,
    PSI,
    RHO,
    SKIDDING,
    SKIDDING_SLIPPING,
    V_LAT,
    V_LONG,
    Prior,
    X,
    Y,
)
from wmr_schemas.arrays import F64, I64

LEAST_SPEED_SD_MPS = PRIORS.least_start_speed_sd_mps


def start_hypotheses(
    hypotheses: HypothesisSet, bins: Bins, prior: Prior, n_modes: int, disturbances_mps2: F64
) -> None:
    """Fill the set with one hypothesis for each mode, level and centre of α, at the last of the bins."""
    mean, covariance = first_state(bins.values, bins.stamps, prior)
    half_track_m = max(prior.half_track_m, PRIORS.least_half_track_m)
    each = product(centres_of(prior), range(n_modes), range(len(disturbances_mps2)))
    n = 0
    for (off, likely), mode, level in each:
        hypotheses.mean[n], hypotheses.covariance[n] = mean, covariance
        hypotheses.mean[n, LN_ALPHA] += off
        hypotheses.mean[n, LN_BETA] += off
        hypotheses.mode[n], hypotheses.level[n] = mode, level
        variance = disturbances_mps2[level] ** 2
        hypotheses.covariance[n, AHEAD, AHEAD] = variance
        hypotheses.covariance[n, AROUND, AROUND] = variance / half_track_m**2
        starts = PRIORS.starts_rolling if mode == IDEAL else (1 - PRIORS.starts_rolling) / (n_modes - 1)
        hypotheses.log_weight[n] = min(level - N_CALM, 0) * CALM_LOG_PRIOR + math.log(likely * starts)
        if mode not in (SKIDDING, SKIDDING_SLIPPING):
            hypotheses.mean[n, V_LAT] = 0.0
            hypotheses.covariance[n, V_LAT] = hypotheses.covariance[n, :, V_LAT] = 0.0
        n += 1
    hypotheses.size[0] = n
    hypotheses.log_weight[:n] -= log_sum(hypotheses.log_weight[:n])


def centres_of(prior: Prior) -> list[tuple[float, float]]:
    """Where α may lie about, as ln of a factor, and the share of the prior; a learned α lies where it is."""
    if prior.ln_alpha_sd < PRIORS.ln_alpha_sd:
        return [(0.0, 1.0)]
    far, share = PRIORS.far_ln_alpha, PRIORS.far_share
    return [(0.0, 1 - 2 * share), (-far, share), (far, share)]


def log_sum(log_weight: F64) -> float:
    """Logarithm of Σ exp(weight), summed in the order and rounding of :func:`.hypotheses.normalise`."""
    top, total = float(log_weight.max()), 0.0
    for weight in log_weight:
        total += math.exp(weight - top)
    return top + math.log(total)


def first_state(values: F64, stamps: I64, prior: Prior) -> tuple[F64, F64]:
    """Pose and velocity at the last bin by least squares of degree 2, with the parameters' prior."""
    ages = (stamps - stamps[-1]) * 1e-9
    design = np.stack([np.ones_like(ages), ages, ages**2], axis=1)
    factor = np.linalg.inv(design.T @ design)
    fit = factor @ design.T @ values[:3].T
    position, yaw = float(values[3].mean()), float(values[5].mean())
    g00, g01, g11 = factor[0, 0], factor[0, 1], factor[1, 1]
    cos, sin = np.cos(fit[0, 2]), np.sin(fit[0, 2])
    v_long, v_lat = fit[1, 0] * cos + fit[1, 1] * sin, fit[1, 1] * cos - fit[1, 0] * sin
    mean, covariance = np.zeros(N_STATES), np.zeros((N_STATES, N_STATES))
    mean[[X, Y, PSI]], mean[V_LONG], mean[V_LAT], mean[OMEGA] = fit[0], v_long, v_lat, fit[1, 2]
    to_body = np.zeros((3, N_STATES))
    for axis, (along, across) in enumerate(((cos, -sin), (sin, cos))):
        to_body[:] = 0.0
        to_body[0, axis], to_body[1, V_LONG], to_body[1, V_LAT] = 1.0, along, across
        covariance += position * to_body[:2].T @ factor[:2, :2] @ to_body[:2]
    turn = np.zeros((2, N_STATES))
    turn[0, PSI], turn[0, V_LAT], turn[0, V_LONG], turn[1, OMEGA] = 1.0, -v_long, v_lat, 1.0
    covariance += yaw * turn.T @ np.array([[g00, g01], [g01, g11]]) @ turn
    covariance[[V_LONG, V_LAT, OMEGA], [V_LONG, V_LAT, OMEGA]] += LEAST_SPEED_SD_MPS**2
    covariance += spread_of_jerk(values, float(ages[-1] - ages[0]), fit[0, 2], prior)
    set_parameters(mean, covariance, prior)
    return mean, covariance


def spread_of_jerk(values: F64, span_s: float, heading_rad: float, prior: Prior) -> F64:
    """Covariance (s, s) of what a quadratic over ``span_s`` T does not follow, an acceleration that changes.

    Where the acceleration changes by Δ within T, evenly, least squares of degree 2 end Δ T²/120 off the path
    and Δ T/10 off the speed. Δ is the range of what the wheels are asked for.
    """
    found = np.zeros((N_STATES, N_STATES))
    for row, ln_gain, places in (
        (FORCE, prior.ln_alpha, {X: np.cos(heading_rad), Y: np.sin(heading_rad)}),
        (TURN, prior.ln_beta, {PSI: 1.0}),
    ):
        asked = np.exp(ln_gain) * values[row]
        change = float(np.nan_to_num(asked.max() - asked.min()))
        off = np.zeros(N_STATES)
        for place, share in places.items():
            off[place] = share * change * span_s**2 / 120
        off[V_LONG if row == FORCE else OMEGA] = change * span_s / 10
        found += np.outer(off, off)
    return found


def set_parameters(mean: F64, covariance: F64, prior: Prior) -> None:
    """The prior of ln α, ln β, ln c and ρ; ln β moves with ln α."""
    mean[[LN_ALPHA, LN_BETA, LN_C, RHO]] = (
        prior.ln_alpha,
        np.nan_to_num(prior.ln_beta),
        prior.ln_c,
        prior.rho,
    )
    common = prior.ln_alpha_sd**2
    covariance[LN_ALPHA, LN_ALPHA] = covariance[LN_ALPHA, LN_BETA] = covariance[LN_BETA, LN_ALPHA] = common
    covariance[LN_BETA, LN_BETA] = common + prior.ln_beta_given_alpha_sd**2
    covariance[LN_C, LN_C], covariance[RHO, RHO] = prior.ln_c_sd**2, prior.rho_sd**2
