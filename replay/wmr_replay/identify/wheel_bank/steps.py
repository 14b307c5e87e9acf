"""The loop of the wheel-speed bank: every bin advances, tests and weighs all hypotheses."""

import math

import numpy as np

from wmr_replay.identify.filter_bank.bins import FORCE, RELEASED, TURN
from wmr_replay.identify.filter_bank.hypotheses import (
    HypothesisSet,
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
from wmr_replay.identify.filter_bank.model import Said
from wmr_replay.identify.filter_bank.steps import LONGEST_HOLE_S, Rhythm
from wmr_replay.identify.filter_bank.update import update
from wmr_replay.identify.wheel_bank.modes import count_modes, shares_of_modes
from wmr_replay.identify.wheel_bank.predict import fade_slips, predict_pose, spread_pose
from wmr_replay.identify.wheel_bank.priors import WHEEL_PRIORS
from wmr_replay.identify.wheel_bank.states import LN_SCALE, LN_TRACK, N_STATES, PSI, X, Y
from wmr_replay.identify.wheel_bank.switches import doubt, doubt_unusual, split
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

LONGEST_STEP_S = 0.05
N_PARAMETERS = 6
N_WORK = 12
CALM = np.array(WHEEL_PRIORS.calm_mps) ** 2
"""Variances of elastic slip by level, (m/s)²."""
RATES = np.array(WHEEL_PRIORS.rates_per_s)
RARE_SD = WHEEL_PRIORS.rare_sd
ROUNDING_TIME_S = WHEEL_PRIORS.rounding_time_s
POSTERIOR, SLIPS, PARAMETERS, JUMPED = 0, 4, 10, 22
N_ANSWERS = 23
"""Rows of the answers: posterior by mode (4), means of s_L, s_R, s_lat and their second moments (6), means of
the parameters and their second moments (12), and the probability that the pose has just jumped."""


@lean
def moments_of_parameters(hypotheses: HypothesisSet, out: F64) -> None:
    """Means and second moments of the parameters over all hypotheses, added to ``out`` (12,)."""
    for h in range(hypotheses.size[0]):
        weight = math.exp(hypotheses.log_weight[h])
        for k in range(N_PARAMETERS):
            mean = hypotheses.mean[h, LN_SCALE + k]
            out[k] += weight * mean
            out[N_PARAMETERS + k] += weight * (
                mean * mean + hypotheses.covariance[h, LN_SCALE + k, LN_SCALE + k]
            )


@lean
def record_interval(
    hypotheses: HypothesisSet, wheels: F64, shares: F64, now_s: float, row: int, smoothed: F64
) -> int:
    """An interval ends: it enters the ring with what each hypothesis says of its mode; the one in whose place
    it comes goes to column ``row`` of ``smoothed``; the next free column.
    """
    room, n = hypotheses.past.shape[1], hypotheses.n_past[0]
    k = n % room
    if n >= room:
        smoothed[0, row] = hypotheses.past_s[k]
        for h in range(hypotheses.size[0]):
            weight = math.exp(hypotheses.log_weight[h])
            for m in range(4):
                smoothed[1 + m, row] += weight * hypotheses.past[h, k, m]
        smoothed[5, row] = smoothed[6, row] = math.nan
        row += 1
    hypotheses.past_s[k] = now_s
    for h in range(hypotheses.size[0]):
        shares_of_modes(hypotheses.mean[h], hypotheses.covariance[h], hypotheses.mode[h], wheels, shares)
        for m in range(4):
            hypotheses.past[h, k, m] = shares[m]
    hypotheses.n_past[0] = n + 1
    return row


@lean
def predict(hypotheses: HypothesisSet, wheels: F64, known: bool, step_s: float, calm: F64, work: F64) -> None:
    """All hypotheses forward by ``step_s``; without wheel speeds the robot may move in any way."""
    step_s = min(step_s, LONGEST_HOLE_S)
    pieces = max(1, math.ceil(step_s / LONGEST_STEP_S))
    dt = step_s / pieces
    for h in range(hypotheses.size[0]):
        mean, covariance, mode = hypotheses.mean[h], hypotheses.covariance[h], hypotheses.mode[h]
        for _ in range(pieces):
            predict_pose(mean, covariance, wheels, dt, work)
            fade_slips(mean, covariance, mode, calm[hypotheses.level[h]], known, dt)
        spread_pose(mean, covariance)


@lean
def update_all(hypotheses: HypothesisSet, pose: F64, variances: F64, rounding: float, work: F64) -> None:
    """Measurement update of every hypothesis by a pose; their weights take the likelihoods.

    ``rounding`` in m² is the variance of a wheel's rounded path about the true one. The state follows the
    rounded paths, which stay beside the true ones: their difference counts as noise of the pose.
    """
    wider, gain = work[8], work[11]
    for h in range(hypotheses.size[0]):
        mean = hypotheses.mean[h]
        wider[X], wider[Y] = variances[X] + 0.5 * rounding, variances[Y] + 0.5 * rounding
        wider[PSI] = variances[PSI] + 0.5 * rounding * math.exp(-2.0 * mean[LN_TRACK])
        for c in range(3):
            unlikely = ((pose[c] - mean[c]) / RARE_SD) ** 2 - hypotheses.covariance[h, c, c]
            wider[c] = max(wider[c], unlikely)
        hypotheses.log_weight[h] += update(mean, hypotheses.covariance[h], pose, wider, gain)
    normalise(hypotheses)


@lean
def follow_rounding(values: F64, k: int, last: F64, step_s: float) -> None:
    """The variance of a wheel's rounded path, in m², from second differences of the paths: ``last[6]``.

    Those of white errors of variance s² have 6 s². A wheel that stands shows nothing.
    """
    now, before = values[FORCE : TURN + 1, k], last[1:3]
    if math.isnan(now[0]) or math.isnan(before[0]) or (now[0] == before[0] and now[1] == before[1]):
        return
    second = ((now[0] - before[0]) ** 2 + (now[1] - before[1]) ** 2) * step_s * step_s / 24.0
    last[5] += step_s
    share = step_s / min(last[5], ROUNDING_TIME_S)
    last[6] += min(share, 1.0) * (second - last[6])


@lean
def set_wheels(values: F64, k: int, last: F64, newer: float, step_s: float, wheels: F64) -> bool:
    """Wheel speeds over the step to bin k and their rates, into ``wheels`` (4,); whether they are known.

    ``last`` (7,): see :func:`run_wheel_bins`.
    """
    known = True
    for c in range(2):
        now, before = values[FORCE + c, k], last[1 + c]
        if math.isnan(now) or math.isnan(before):
            known = False
            wheels[c] = wheels[2 + c] = 0.0
        else:
            wheels[c] = 0.5 * (now if newer == 1.0 else newer * now + (1.0 - newer) * before)
            wheels[2 + c] = 0.5 * (now - before) / step_s if step_s > 0.0 else 0.0
    return known


@lean
def filter_wheel_bins(
    hypotheses: HypothesisSet,
    values: F64,
    seconds: F64,
    last: F64,
    noise: tuple[F64, F64, F64],
    rhythm: Rhythm,
    work: F64,
    out: tuple[F64, F64],
) -> None:
    """Every bin through the bank into ``out``: answers (23, m) and smoothed intervals (7, m).

    ``noise``: variances of elastic slip by level, parameters in doubt (3, 6), rates of change between modes.
    ``work`` is scratch.
    """
    answers, smoothed = out
    calm, doubted, rates = noise
    row = 0
    wheels, shares = work[9], work[10]
    for k in range(seconds.shape[0]):
        step_s = seconds[k] - last[0]
        last[3] += step_s
        if last[3] >= rhythm.split_s - 1e-9:
            if hypotheses.past.shape[1] > 0:
                row = record_interval(hypotheses, wheels, shares, seconds[k] - step_s, row, smoothed)
            doubt(hypotheses, last[3], doubted[0])
            doubt_unusual(hypotheses, last[3], doubted[1:])
            split(hypotheses, rhythm.n_modes, last[3], rates, calm)
            vary_level(hypotheses, calm.shape[0])
            prune_and_merge(hypotheses, rhythm.most)
            last[3] = 0.0
        follow_rounding(values, k, last, step_s)
        known = set_wheels(values, k, last, rhythm.newer, step_s, wheels)
        predict(hypotheses, wheels, known, step_s, calm, work)
        pose, variances = values[:3, k], values[3:6, k]
        if values[RELEASED, k] > 0.0:
            release_pose(hypotheses, variances, seconds[k])
        surprise = surprising(hypotheses, pose, variances)
        if surprise:
            hypothesise_jump(hypotheses, step_s, seconds[k])
        update_all(hypotheses, pose, variances, last[6], work)
        if surprise:
            prune_and_merge(hypotheses, rhythm.most)
            normalise(hypotheses)
        last[0], last[1], last[2] = seconds[k], values[FORCE, k], values[TURN, k]
        count_modes(hypotheses, wheels, shares, answers[:PARAMETERS, k])
        moments_of_parameters(hypotheses, answers[PARAMETERS:JUMPED, k])
        answers[JUMPED, k] = share_that_jumped(hypotheses, seconds[k])


def run_wheel_bins(
    hypotheses: HypothesisSet, values: F64, seconds: F64, last: F64, rhythm: Rhythm, doubted: F64
) -> Said:
    """Every bin through the bank.

    ``values`` (9, m) are bins with the wheels' speeds in m/s as efforts, ``seconds`` (m,) their times;
    ``last`` (7,) – time of the last bin in s, its sum and difference, time since the last split, nothing,
    time over which rounding was seen, its variance – is carried on in place. ``doubted`` (3, 6) are
    variances of parameters in doubt, and means and variances of usual parameters.
    """
    m, intervals = len(seconds), hypotheses.past.shape[1]
    answers, smoothed = np.zeros((N_ANSWERS, m)), np.zeros((7, m if intervals else 0))
    before = int(hypotheses.n_past[0])
    work = np.zeros((N_WORK, N_STATES))
    values = np.ascontiguousarray(values)
    noise, out = (CALM, doubted, RATES), (answers, smoothed)
    filter_wheel_bins(hypotheses, values, seconds, last, noise, rhythm, work, out)
    first, done = max(before, intervals), int(hypotheses.n_past[0])
    return Said(answers, smoothed[:, : max(done - first, 0)])
