"""The bank's loop: every bin advances, tests and weighs all hypotheses."""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, RELEASED, TURN
from wmr_replay.identify.filter_bank.hypotheses import Population, change_load, normalise, thin, vary_level
from wmr_replay.identify.filter_bank.jumps import release_pose, share_that_jumped, suppose_jump, surprising
from wmr_replay.identify.filter_bank.predict import move, spread
from wmr_replay.identify.filter_bank.states import (
    BOTH,
    CAPPED,
    IDEAL,
    LN_ALPHA,
    LN_BETA,
    N_MOVING,
    N_STATES,
    OMEGA,
    RHO,
    SKIDDING,
    SLIPPING,
    V_LAT,
    V_LONG,
    Prior,
)
from wmr_replay.identify.filter_bank.switches import split
from wmr_replay.identify.filter_bank.traction import slipping_share
from wmr_replay.identify.filter_bank.update import absorb
from wmr_replay.identify.terms import Terms
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

LONGEST_STEP_S = 0.05
MIN_LOG_WEIGHT = float(np.log(0.01))
UNKNOWN_ACCELERATION_DIFFUSION = 0.5
"""(m/s²)²·s: what the velocities may do where no torque is known."""


class Drift(NamedTuple):
    """Diffusion per second: of the velocities by level of disturbance, of ln α as a share of it, of ρ, and of
    the logarithm of a cap.
    """

    velocity: F64
    alpha_share: float
    rho: float
    cap: float


@compiled
def advance(
    people: Population,
    force: float,
    turn: float,
    step_s: float,
    prior: Prior,
    terms: Terms,
    drift: Drift,
    work: F64,
) -> None:
    """All hypotheses forward by ``step_s``; unknown efforts (NaN) leave the velocities free.

    ``work`` (12, 10) is scratch.
    """
    pieces = max(1, int(np.ceil(step_s / LONGEST_STEP_S)))
    dt = step_s / pieces
    free_v, free_omega = np.isnan(force), np.isnan(turn) or np.isnan(prior.ln_beta)
    for h in range(people.size[0]):
        mean, covariance, mode = people.mean[h], people.covariance[h], people.mode[h]
        diffusion = drift.velocity[people.level[h]]
        for _ in range(pieces):
            move(
                mean,
                mode,
                0.0 if free_v else force,
                0.0 if free_omega else turn,
                dt,
                prior,
                terms,
                work[:N_MOVING],
            )
            spread(covariance, work[:N_MOVING], work[N_MOVING : 2 * N_MOVING])
            covariance[V_LONG, V_LONG] += (UNKNOWN_ACCELERATION_DIFFUSION if free_v else diffusion) * dt
            covariance[OMEGA, OMEGA] += (UNKNOWN_ACCELERATION_DIFFUSION if free_omega else diffusion) * dt
            if mode in (SKIDDING, BOTH):
                covariance[V_LAT, V_LAT] += diffusion * dt
            for a in (LN_ALPHA, LN_BETA):
                for b in (LN_ALPHA, LN_BETA):
                    covariance[a, b] += drift.alpha_share * diffusion * dt
            covariance[RHO, RHO] += (drift.cap if mode == CAPPED else drift.rho) * dt


@compiled
def blend(newer: float, older: float, share: float) -> float:
    """The mean input of a step with ``share`` of its time in the newer bin: all of it with one row a bin."""
    return newer if share == 1.0 else share * newer + (1.0 - share) * older


@compiled
def count_modes(people: Population, force: float, turn: float, out: F64) -> None:
    """The weights of the modes, (4,); slippery ground counts as slipping as far as a wheel's demand exceeds
    its cap.
    """
    for h in range(people.size[0]):
        weight, mode = np.exp(people.log_weight[h]), people.mode[h]
        if mode == CAPPED:
            slipping = slipping_share(people.mean[h], people.covariance[h], force, turn)
            out[IDEAL] += weight * (1.0 - slipping)
            out[SLIPPING] += weight * slipping
        else:
            out[mode] += weight


@compiled
def moments_of_ln_alpha(people: Population) -> tuple[float, float]:
    """Mean and variance over the hypotheses that hold at least 1 %: an interval speaks of the bulk, and not
    of a change of load that is supposed at every moment.
    """
    total, first, second = 0.0, 0.0, 0.0
    for h in range(people.size[0]):
        if people.log_weight[h] >= MIN_LOG_WEIGHT:
            weight, mean = np.exp(people.log_weight[h]), people.mean[h, LN_ALPHA]
            total += weight
            first += weight * mean
            second += weight * (people.covariance[h, LN_ALPHA, LN_ALPHA] + mean * mean)
    return first / total, second / total - (first / total) ** 2


@compiled
def run_bins(
    people: Population,
    values: F64,
    seconds: F64,
    last: F64,
    prior: Prior,
    terms: Terms,
    drift: Drift,
    rhythm: tuple[int, int, float, float, float],
) -> tuple[F64, F64, F64]:
    """Every bin through the bank: posterior by mode (4, m), mean and variance of ln α (2, m), and the
    probability that the pose has just jumped (1, m).

    ``last`` (4,) – time of the last bin in s, its effort sum and difference, time since the last split – is
    carried on in place. ``rhythm``: modes, hypotheses at most, split interval, switch rate, and the share of
    a step that lies in the newer of its two bins.
    """
    n_modes, most, split_s, rate, newer = rhythm
    m = seconds.shape[0]
    posterior, ln_alpha, jumped = np.zeros((4, m)), np.zeros((2, m)), np.zeros((1, m))
    work = np.empty((2 * N_MOVING, N_STATES))
    gain = np.empty(N_STATES)
    for k in range(m):
        step_s = seconds[k] - last[0]
        force, turn = blend(values[FORCE, k], last[1], newer), blend(values[TURN, k], last[2], newer)
        last[3] += step_s
        if last[3] >= split_s - 1e-9:
            inputs = (0.0 if np.isnan(force) else force, 0.0 if np.isnan(turn) else turn)
            change_load(people, last[3])
            split(people, n_modes, last[3], rate, inputs, prior)
            vary_level(people, drift.velocity.shape[0])
            thin(people, most)
            last[3] = 0.0
        advance(people, force, turn, step_s, prior, terms, drift, work)
        if values[RELEASED, k] > 0.0:
            release_pose(people, values[3:6, k], seconds[k])
        surprise = surprising(people, values[:3, k], values[3:6, k])
        if surprise:
            suppose_jump(people, step_s, seconds[k])
        for h in range(people.size[0]):
            people.log_weight[h] += absorb(
                people.mean[h], people.covariance[h], values[:3, k], values[3:6, k], gain
            )
        normalise(people)
        if surprise:
            thin(people, most)
            normalise(people)
        last[0], last[1], last[2] = seconds[k], values[FORCE, k], values[TURN, k]
        count_modes(people, force, turn, posterior[:, k])
        ln_alpha[0, k], ln_alpha[1, k] = moments_of_ln_alpha(people)
        jumped[0, k] = share_that_jumped(people, seconds[k])
    return posterior, ln_alpha, jumped
