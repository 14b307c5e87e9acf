"""The loop of the joint bank: every bin advances, tests and weighs all hypotheses."""

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
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_replay.identify.filter_bank.steps import Rhythm
from wmr_replay.identify.joint_bank.predict import predict
from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS
from wmr_replay.identify.joint_bank.states import ALPHA
from wmr_replay.identify.joint_bank.switches import split
from wmr_replay.identify.wheel_bank.modes import count_modes
from wmr_replay.identify.wheel_bank.steps import (
    CALM,
    JUMPED,
    PARAMETERS,
    RATES,
    follow_rounding,
    moments_of_parameters,
    record_interval,
    set_wheels,
    update_all,
)
from wmr_replay.identify.wheel_bank.switches import doubt, doubt_unusual
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

EFFORT, EFFORT_TURN = 9, 10
"""Rows of the bins, behind those of wheel speeds."""
N_WORK = 13
N_ANSWERS = 25
ALPHA_ROW = 23
"""Rows of the answers: those of the wheel-speed bank, and mean and variance of α."""
TINY = 1e-12
MIN_LOG_WEIGHT = math.log(PRIORS.least_interval_weight)
STANDS_MPS = JOINT_PRIORS.stands_mps
DISTURBANCE = np.array(JOINT_PRIORS.disturbance_mps2) ** 2


@lean
def moments_of_alpha(hypotheses: HypothesisSet) -> tuple[float, float]:
    """Mean and variance of α over the hypotheses that hold at least 1 %."""
    total, first, second = 0.0, 0.0, 0.0
    for h in range(hypotheses.size[0]):
        if hypotheses.log_weight[h] >= MIN_LOG_WEIGHT:
            weight, mean = math.exp(hypotheses.log_weight[h]), hypotheses.mean[h, ALPHA]
            total += weight
            first += weight * mean
            second += weight * (hypotheses.covariance[h, ALPHA, ALPHA] + mean * mean)
    return first / total, second / total - (first / total) ** 2


@lean
def record(hypotheses: HypothesisSet, wheels: F64, shares: F64, now_s: float, row: int, smoothed: F64) -> int:
    """An interval ends, as in the wheel-speed bank, with what is known of α now; the next free column."""
    after = record_interval(hypotheses, wheels, shares, now_s, row, smoothed)
    if after > row:
        alpha, variance = moments_of_alpha(hypotheses)
        smoothed[5, row], smoothed[6, row] = math.log(max(alpha, TINY)), variance / max(alpha * alpha, TINY)
    return after


@lean
def set_efforts(values: F64, k: int, last: F64, wheels: F64, efforts: F64) -> bool:
    """Efforts between the middles of two bins, their changes, and mean and half difference of the signs of
    the wheels' speeds, into ``efforts`` (6,); whether they are known.
    """
    known = True
    right = math.tanh((wheels[0] + wheels[1]) / STANDS_MPS)
    left = math.tanh((wheels[0] - wheels[1]) / STANDS_MPS)
    efforts[4], efforts[5] = 0.5 * (right + left), 0.5 * (right - left)
    for c in range(2):
        now, before = values[EFFORT + c, k], last[7 + c]
        if math.isnan(now) or math.isnan(before):
            known = False
            efforts[c] = efforts[2 + c] = 0.0
        else:
            efforts[c], efforts[2 + c] = 0.5 * (now + before), now - before
    return known


@lean
def branch(
    hypotheses: HypothesisSet, since_s: float, rhythm: Rhythm, noise: tuple[F64, F64, F64], work: F64
) -> None:
    """The hypotheses of a split: doubts, switches, changes of level; the best are kept.

    ``noise`` as in the wheel-speed bank.
    """
    calm, doubted, rates = noise
    doubt(hypotheses, since_s, doubted[0])
    doubt_unusual(hypotheses, since_s, doubted[1:])
    split(hypotheses, rhythm.n_modes, since_s, rates, calm, work)
    vary_level(hypotheses, calm.shape[0])
    prune_and_merge(hypotheses, rhythm.most)


@lean
def filter_joint_bins(
    hypotheses: HypothesisSet,
    values: F64,
    seconds: F64,
    last: F64,
    model: tuple[F64, F64, F64, F64, tuple[float, float]],
    rhythm: Rhythm,
    work: F64,
    out: tuple[F64, F64],
) -> None:
    """Every bin through the bank into ``out``: answers (25, m) and smoothed intervals (7, m).

    ``model``: variances of elastic slip and of disturbances by level, parameters in doubt (3, 8), rates of
    change between modes, and the wheels' shares of inertia. ``work`` is scratch.
    """
    answers, smoothed = out
    calm, disturbance, doubted, rates, spinning = model
    row = 0
    wheels, shares, efforts = work[9], work[10], work[12]
    for k in range(seconds.shape[0]):
        step_s = seconds[k] - last[0]
        last[3] += step_s
        if last[3] >= rhythm.split_s - 1e-9:
            if hypotheses.past.shape[1] > 0:
                row = record(hypotheses, wheels, shares, seconds[k] - step_s, row, smoothed)
            branch(hypotheses, last[3], rhythm, (calm, doubted, rates), work[11])
            last[3] = 0.0
        follow_rounding(values, k, last, step_s)
        known = (
            set_wheels(values, k, last, rhythm.newer, step_s, wheels),
            set_efforts(values, k, last, wheels, efforts) and step_s > 0.0,
        )
        error = last[6] / (step_s * step_s) if step_s > 0.0 else 0.0
        predict(hypotheses, (wheels, efforts), known, spinning, step_s, (calm, disturbance, error), work)
        pose, variances = values[:3, k], values[3:6, k]
        if values[RELEASED, k] > 0.0:
            release_pose(hypotheses, variances, seconds[k])
        normalise(hypotheses)
        surprise = surprising(hypotheses, pose, variances)
        if surprise:
            hypothesise_jump(hypotheses, step_s, seconds[k])
        update_all(hypotheses, pose, variances, last[6], work)
        if surprise:
            prune_and_merge(hypotheses, rhythm.most)
            normalise(hypotheses)
        last[0], last[1], last[2] = seconds[k], values[FORCE, k], values[TURN, k]
        last[7], last[8] = values[EFFORT, k], values[EFFORT_TURN, k]
        count_modes(hypotheses, wheels, shares, answers[:PARAMETERS, k])
        moments_of_parameters(hypotheses, answers[PARAMETERS:JUMPED, k])
        answers[JUMPED, k] = share_that_jumped(hypotheses, seconds[k])
        answers[ALPHA_ROW, k], answers[ALPHA_ROW + 1, k] = moments_of_alpha(hypotheses)


def run_joint_bins(
    hypotheses: HypothesisSet,
    values: F64,
    seconds: F64,
    last: F64,
    rhythm: Rhythm,
    doubted: F64,
    spinning: tuple[float, float],
) -> Said:
    """Every bin through the bank.

    ``values`` (11, m) are bins with the wheels' speeds in m/s as efforts and the efforts in N·m behind them,
    ``seconds`` (m,) their times; ``last`` (9,) – as in the wheel-speed bank, and the last bin's efforts – is
    carried on in place. ``doubted`` (3, 8) are variances of parameters in doubt, and means and
    variances of usual parameters; ``spinning`` g and h.
    """
    m, intervals = len(seconds), hypotheses.past.shape[1]
    answers, smoothed = np.zeros((N_ANSWERS, m)), np.zeros((7, m if intervals else 0))
    before = int(hypotheses.n_past[0])
    work = np.zeros((N_WORK, hypotheses.mean.shape[1]))
    values, model = np.ascontiguousarray(values), (CALM, DISTURBANCE, doubted, RATES, spinning)
    filter_joint_bins(hypotheses, values, seconds, last, model, rhythm, work, (answers, smoothed))
    first, done = max(before, intervals), int(hypotheses.n_past[0])
    return Said(answers, smoothed[:, : max(done - first, 0)])
