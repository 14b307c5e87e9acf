"""The bank's loop: every bin advances, tests and weighs all hypotheses."""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, RELEASED, TURN
from wmr_replay.identify.filter_bank.hypotheses import (
    HypothesisSet,
    change_load,
    normalise,
    prune_and_merge,
    vary_level,
)
from wmr_replay.identify.filter_bank.jumps import (
    hypothesise_jump,
    release_pose,
    share_that_jumped,
    surprising,
)
from wmr_replay.identify.filter_bank.predict import (
    Efforts,
    let_disturbances_fade,
    predict_covariance,
    predict_mean,
)
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.states import (
    CAPPED,
    IDEAL,
    LN_ALPHA,
    LN_BETA,
    N_MOVING,
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
    X,
    Y,
)
from wmr_replay.identify.filter_bank.switches import split
from wmr_replay.identify.filter_bank.traction import slipping_share
from wmr_replay.identify.filter_bank.update import update
from wmr_replay.identify.terms import Terms
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

LONGEST_STEP_S, LONGEST_HOLE_S = PRIORS.longest_step_s, PRIORS.longest_hole_s
LEAST_HALF_TRACK_M = PRIORS.least_half_track_m
MIN_LOG_WEIGHT = math.log(PRIORS.least_interval_weight)
ELASTIC_S, ELASTIC_LASTS_S = PRIORS.elastic_sideslip_s, PRIORS.elastic_lasts_s
COMPENSATED = PRIORS.compensated_sd * PRIORS.compensated_sd
UNKNOWN_ACCELERATION_DIFFUSION = PRIORS.unknown_acceleration_diffusion


class Drift(NamedTuple):
    """By level of disturbance: diffusion per second of the velocities, and the standard deviation in m/s² of
    a coloured disturbance of dv_long/dt. Diffusion of ln α as a share of the velocities', of ρ, and of the
    logarithm of a cap.
    """

    velocity: F64
    disturbance: F64
    alpha_share: float
    rho: float
    cap: float


@lean
def told(effort: float, gain: float, variance: float) -> float:
    """The part of an effort that tells modes apart: effort x⁴/(1 + x⁴), x = demand/(3 sd of the disturbance).

    A speed controller compensates disturbances, and sees them better than a pose does. Its efforts of their
    size are therefore no independent input: without this factor rolling at constant speed would look like
    slipping, since such efforts are not followed by accelerations.
    """
    x = effort * effort * gain * gain / (COMPENSATED * variance)
    return effort * x * x / (1.0 + x * x)


@lean
def rest(effort: float, told_effort: float, gain: float) -> float:
    """The acceleration by the part of an effort that tells nothing: as in rolling, the same in every mode."""
    return 0.0 if math.isnan(effort) else gain * (effort - told_effort)


@lean
def creep_sideways(mean: F64, covariance: F64, dt: float) -> None:
    """Tyres that grip give way a little in a curve. How much is not known: the position becomes uncertain."""
    creep = ELASTIC_S * mean[V_LONG] * mean[OMEGA]
    variance = 2.0 * ELASTIC_LASTS_S * creep * creep * dt
    sin, cos = math.sin(mean[PSI]), math.cos(mean[PSI])
    covariance[X, X] += variance * sin * sin
    covariance[Y, Y] += variance * cos * cos
    covariance[X, Y] -= variance * sin * cos
    covariance[Y, X] = covariance[X, Y]


@lean
def predict(
    hypotheses: HypothesisSet,
    force: float,
    turn: float,
    step_s: float,
    prior: Prior,
    terms: Terms | None,
    drift: Drift,
    work: F64,
) -> None:
    """All hypotheses forward by ``step_s``; unknown efforts (NaN) leave the velocities free.

    ``work`` (12, 12 at least) is scratch.
    """
    step_s = min(step_s, LONGEST_HOLE_S)
    pieces = max(1, math.ceil(step_s / LONGEST_STEP_S))
    dt = step_s / pieces
    free_v, free_omega = math.isnan(force), math.isnan(turn) or math.isnan(prior.ln_beta)
    half_track = max(prior.half_track_m, LEAST_HALF_TRACK_M)
    around = 1.0 / half_track**2
    for h in range(hypotheses.size[0]):
        mean, covariance, mode = hypotheses.mean[h], hypotheses.covariance[h], hypotheses.mode[h]
        diffusion = drift.velocity[hypotheses.level[h]]
        disturbance = drift.disturbance[hypotheses.level[h]] ** 2
        alpha, beta = math.exp(mean[LN_ALPHA]), math.exp(mean[LN_BETA])
        told_force = 0.0 if free_v else told(force, alpha, disturbance)
        told_turn = 0.0 if free_omega else told(turn, beta * half_track, disturbance)
        turning = 0.0 if free_omega else rest(turn, told_turn, beta)
        efforts = Efforts(told_force, told_turn, rest(force, told_force, alpha), turning)
        for _ in range(pieces):
            predict_mean(mean, mode, efforts, dt, prior, terms, work[:N_MOVING])
            predict_covariance(covariance, work[:N_MOVING], work[N_MOVING : 2 * N_MOVING])
            let_disturbances_fade(mean, covariance, disturbance, around, dt)
            covariance[V_LONG, V_LONG] += (UNKNOWN_ACCELERATION_DIFFUSION if free_v else diffusion) * dt
            covariance[OMEGA, OMEGA] += (UNKNOWN_ACCELERATION_DIFFUSION if free_omega else diffusion) * dt
            if mode in (SKIDDING, SKIDDING_SLIPPING):
                covariance[V_LAT, V_LAT] += diffusion * dt
            else:
                creep_sideways(mean, covariance, dt)
            for a in (LN_ALPHA, LN_BETA):
                for b in (LN_ALPHA, LN_BETA):
                    covariance[a, b] += drift.alpha_share * diffusion * dt
            covariance[RHO, RHO] += (drift.cap if mode == CAPPED else drift.rho) * dt


@lean
def blend(newer: float, older: float, share: float) -> float:
    """The mean input of a step with ``share`` of its time in the newer bin: all of it with one row a bin."""
    return newer if share == 1.0 else share * newer + (1.0 - share) * older


@lean
def count_modes(hypotheses: HypothesisSet, force: float, turn: float, out: F64) -> None:
    """The weights of the modes, (4,); slippery ground counts as slipping as far as a wheel's demand exceeds
    its cap.
    """
    for h in range(hypotheses.size[0]):
        weight, mode = math.exp(hypotheses.log_weight[h]), hypotheses.mode[h]
        if mode == CAPPED:
            slipping = slipping_share(hypotheses.mean[h], hypotheses.covariance[h], force, turn)
            out[IDEAL] += weight * (1.0 - slipping)
            out[SLIPPING] += weight * slipping
        else:
            out[mode] += weight


@lean
def moments_of_ln_alpha(hypotheses: HypothesisSet) -> tuple[float, float]:
    """Mean and variance over the hypotheses that hold at least 1 %: an interval speaks of the bulk, and not
    of a change of load that is supposed at every moment.
    """
    total, first, second = 0.0, 0.0, 0.0
    for h in range(hypotheses.size[0]):
        if hypotheses.log_weight[h] >= MIN_LOG_WEIGHT:
            weight, mean = math.exp(hypotheses.log_weight[h]), hypotheses.mean[h, LN_ALPHA]
            total += weight
            first += weight * mean
            second += weight * (hypotheses.covariance[h, LN_ALPHA, LN_ALPHA] + mean * mean)
    return first / total, second / total - (first / total) ** 2


class Rhythm(NamedTuple):
    """Number of modes, hypotheses at most, split interval, switch rate, and the share of a step that lies in
    the newer of its two bins.
    """

    n_modes: int
    most: int
    split_s: float
    switch_rate_per_s: float
    newer: float


class Outputs(NamedTuple):
    """After each bin: posterior by mode (4, m), mean and variance of ln α (2, m), and the probability that
    the pose has just jumped (1, m). ``smoothed`` (7, i): for each interval that leaves the ring, its end
    in s, the posterior by mode, and mean and variance of ln α.
    """

    posterior: F64
    ln_alpha: F64
    jumped: F64
    smoothed: F64


def run_bins(
    hypotheses: HypothesisSet,
    values: F64,
    seconds: F64,
    last: F64,
    prior: Prior,
    terms: Terms,
    drift: Drift,
    rhythm: Rhythm,
) -> Outputs:
    """Every bin through the bank.

    ``values`` (9, m) and ``seconds`` (m,) are the bins and their times; ``last`` (4,) – time of the last bin
    in s, its effort sum and difference, time since the last split – is carried on in place.
    """
    m = len(seconds)
    intervals = m if hypotheses.past.shape[1] else 0
    outputs = Outputs(np.zeros((4, m)), np.zeros((2, m)), np.zeros((1, m)), np.zeros((7, intervals)))
    before = int(hypotheses.n_past[0])
    work = np.empty((2 * N_MOVING + 1, N_STATES))
    values = np.ascontiguousarray(values)
    model = (prior, terms if terms.any else None, drift)
    filter_bins(hypotheses, values, seconds, last, model, rhythm, work, outputs)
    first, done = max(before, hypotheses.past.shape[1]), int(hypotheses.n_past[0])
    return outputs._replace(smoothed=outputs.smoothed[:, : max(done - first, 0)])


@lean
def branch(
    hypotheses: HypothesisSet,
    inputs: tuple[float, float],
    since_s: float,
    prior: Prior,
    levels: int,
    r: Rhythm,
) -> None:
    """The hypotheses of a split: changes of load, switches of mode, changes of level; the best are kept."""
    change_load(hypotheses, since_s)
    split(hypotheses, r.n_modes, since_s, inputs, prior)
    vary_level(hypotheses, levels)
    prune_and_merge(hypotheses, r.most)


@lean
def look_back(hypotheses: HypothesisSet, k: int, out: F64) -> None:
    """The end in s of the interval at place ``k`` of the ring, its posterior by mode as it is known now, and
    mean and variance of ln α now.
    """
    out[0] = hypotheses.past_s[k]
    out[5], out[6] = moments_of_ln_alpha(hypotheses)
    for h in range(hypotheses.size[0]):
        weight = math.exp(hypotheses.log_weight[h])
        for m in range(4):
            out[1 + m] += weight * hypotheses.past[h, k, m]


@lean
def record_interval(
    hypotheses: HypothesisSet, inputs: tuple[float, float], now_s: float, row: int, smoothed: F64
) -> int:
    """An interval ends at ``now_s``: it enters the ring with each hypothesis's mode, and the one in whose
    place it comes goes to column ``row`` of ``smoothed``; the next free column.
    """
    room, n = hypotheses.past.shape[1], hypotheses.n_past[0]
    k = n % room
    if n >= room:
        look_back(hypotheses, k, smoothed[:, row])
        row += 1
    hypotheses.past_s[k] = now_s
    for h in range(hypotheses.size[0]):
        mode = hypotheses.mode[h]
        for m in range(4):
            hypotheses.past[h, k, m] = 1.0 if m == mode else 0.0
        if mode == CAPPED:
            slipping = slipping_share(hypotheses.mean[h], hypotheses.covariance[h], inputs[0], inputs[1])
            hypotheses.past[h, k, IDEAL], hypotheses.past[h, k, SLIPPING] = 1.0 - slipping, slipping
    hypotheses.n_past[0] = n + 1
    return row


@lean
def update_all(hypotheses: HypothesisSet, pose: F64, variances: F64, gain: F64) -> None:
    """Measurement update of every hypothesis; their weights take the likelihoods."""
    for h in range(hypotheses.size[0]):
        hypotheses.log_weight[h] += update(
            hypotheses.mean[h], hypotheses.covariance[h], pose, variances, gain
        )
    normalise(hypotheses)


@lean
def filter_bins(
    hypotheses: HypothesisSet,
    values: F64,
    seconds: F64,
    last: F64,
    model: tuple[Prior, Terms | None, Drift],
    rhythm: Rhythm,
    work: F64,
    outputs: Outputs,
) -> None:
    """:func:`run_bins` into ``outputs``; ``work`` (13, 12) is scratch."""
    prior, terms, drift = model
    row = 0
    for k in range(seconds.shape[0]):
        step_s = seconds[k] - last[0]
        force = blend(values[FORCE, k], last[1], rhythm.newer)
        turn = blend(values[TURN, k], last[2], rhythm.newer)
        last[3] += step_s
        if last[3] >= rhythm.split_s - 1e-9:
            inputs = (0.0 if math.isnan(force) else force, 0.0 if math.isnan(turn) else turn)
            if hypotheses.past.shape[1] > 0:
                row = record_interval(hypotheses, inputs, seconds[k] - step_s, row, outputs.smoothed)
            branch(hypotheses, inputs, last[3], prior, drift.velocity.shape[0], rhythm)
            last[3] = 0.0
        predict(hypotheses, force, turn, step_s, prior, terms, drift, work)
        pose, variances = values[:3, k], values[3:6, k]
        if values[RELEASED, k] > 0.0:
            release_pose(hypotheses, variances, seconds[k])
        surprise = surprising(hypotheses, pose, variances)
        if surprise:
            hypothesise_jump(hypotheses, step_s, seconds[k])
        update_all(hypotheses, pose, variances, work[2 * N_MOVING])
        if surprise:
            prune_and_merge(hypotheses, rhythm.most)
            normalise(hypotheses)
        last[0], last[1], last[2] = seconds[k], values[FORCE, k], values[TURN, k]
        count_modes(hypotheses, force, turn, outputs.posterior[:, k])
        outputs.ln_alpha[0, k], outputs.ln_alpha[1, k] = moments_of_ln_alpha(hypotheses)
        outputs.jumped[0, k] = share_that_jumped(hypotheses, seconds[k])
