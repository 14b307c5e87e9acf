"""Bins to probabilities: all hypotheses through the regressions, bin by bin."""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.algebraic.beliefs import Beliefs
from wmr_replay.identify.algebraic.bins import IMPULSE, N_SUMS, POSE, VARIANCES, T
from wmr_replay.identify.algebraic.branches import branch, select
from wmr_replay.identify.algebraic.hypotheses import (
    Hypotheses,
    begin,
    copy_all,
    gains_of,
    mean_of,
    no_hypotheses,
    normalise,
    release_pose,
)
from wmr_replay.identify.algebraic.regression import (
    ALPHA,
    LOG_DECAY,
    N_MOVING,
    N_UNKNOWNS,
    ONE,
    OWN,
    V_LONG,
    YAW,
    YAW_GAIN,
    YAW_RATE,
    Reference,
    Step,
    correct,
    disturbance,
    predict,
    transition,
)
from wmr_replay.identify.terms import Moving, Terms, extra_accelerations
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

BRANCH_S = 0.12
"""Switches are supposed this far apart, or wherever a bin surprises every hypothesis."""
SURPRISE = 25.0
"""χ² of three degrees of freedom: a chance of 1.5e-5."""
MAX_GAP_S = 1.0
NEVER_S = -1e9
WARM_UP_S = 1.0
JUMP_SHOWS_S = 0.5
START_S, BRANCHED_S, JUMPED_S, N_CLOCKS = 0, 1, 2, 3
JUMP, WARM, N_SAID = 3, 4, 5


class Filter(NamedTuple):
    """All that is carried from bin to bin.

    ``mean`` (9,) over the hypotheses, the next step's reference; ``last`` (11,) the last bin; ``clocks_s``
    (3,) when this run began, hypotheses last branched and the pose last jumped; ``gains`` (2, 3) mean and
    variance of α, β, ℓ; ``said`` (5,) the probabilities of ideal, skidding and slipping, 1 when the pose
    jumped within the last .5 s, and 1 once warm. The rest is scratch.
    """

    hypotheses: Hypotheses
    before: Hypotheses
    mean: F64
    last: F64
    clocks_s: F64
    gains: F64
    said: F64
    matrices: F64
    noises: F64
    work: F64


def new_filter(beliefs: Beliefs) -> Filter:
    """Nothing seen yet."""
    gains = np.array(
        [
            [beliefs.alpha, beliefs.yaw_gain, beliefs.log_decay],
            [beliefs.alpha_sd**2, beliefs.yaw_gain_sd**2, beliefs.log_decay_sd**2],
        ]
    )
    return Filter(
        no_hypotheses(),
        no_hypotheses(),
        np.zeros(N_UNKNOWNS),
        np.full(N_SUMS, NEVER_S),
        np.zeros(N_CLOCKS),
        gains,
        np.zeros(N_SAID),
        np.zeros((3, N_MOVING, ONE + 1)),
        np.zeros((3, N_UNKNOWNS)),
        np.zeros((N_MOVING, ONE + 1)),
    )


@compiled
def take_up(state: Filter, bin_: F64, beliefs: Beliefs, terms: Terms) -> None:
    """One more bin; after a gap of more than 1 s everything but the gains begins anew."""
    now_s = bin_[T]
    if now_s - state.last[T] > MAX_GAP_S:
        begin(state.hypotheses, bin_[POSE : POSE + 3], bin_[VARIANCES:], state.gains, beliefs)
        state.clocks_s[:] = now_s, now_s, NEVER_S
    else:
        step = step_between(state, bin_, terms)
        advance(state, bin_, step, beliefs)
    state.last[:] = bin_
    state.mean[:] = mean_of(state.hypotheses, beliefs.log_decay)
    state.gains[:] = gains_of(state.hypotheses)
    conclude(state)


@compiled
def jumped(state: Filter, beliefs: Beliefs) -> None:
    """The pose is known to have jumped."""
    if state.hypotheses.used[0]:
        release_pose(state.hypotheses, beliefs)
        state.clocks_s[JUMPED_S] = state.last[T]


@compiled
def step_between(state: Filter, bin_: F64, terms: Terms) -> Step:
    """The step from the last bin to this one, with the model's further effects at the reference."""
    mean, last = state.mean, state.last
    dt_s, known = bin_[T] - last[T], bin_[IMPULSE + 2] - last[IMPULSE + 2] == 0.0
    force = (bin_[IMPULSE] - last[IMPULSE]) / dt_s if known else np.nan
    difference = (bin_[IMPULSE + 1] - last[IMPULSE + 1]) / dt_s if known else np.nan
    efforts = (force, difference) if known else (0.0, 0.0)
    at = Moving(mean[V_LONG], mean[OWN], mean[YAW], mean[YAW_RATE], efforts[0], efforts[1])
    known_of = extra_accelerations(at, mean[ALPHA], mean[YAW_GAIN] * terms.half_track_m, terms)
    return Step(dt_s, force, difference, known_of[0], known_of[1], known_of[2])


@compiled
def advance(state: Filter, bin_: F64, step: Step, beliefs: Beliefs) -> None:
    """A step of all hypotheses. They branch when it is time, or when none of them foresaw the bin.

    When no branch explains it either, the pose has jumped.
    """
    all_, before, now_s = state.hypotheses, state.before, bin_[T]
    due = now_s - state.clocks_s[BRANCHED_S] >= BRANCH_S - 1e-6
    if due:
        divide(state, now_s, step, beliefs)
    else:
        copy_all(all_, before)
    surprise = regress(state, bin_, step, beliefs)
    if surprise > SURPRISE and not due:
        copy_all(before, all_)
        divide(state, now_s, step, beliefs)
        surprise = regress(state, bin_, step, beliefs)
    if surprise > SURPRISE:
        copy_all(before, all_)
        release_pose(all_, beliefs)
        state.clocks_s[JUMPED_S] = now_s
        regress(state, bin_, step, beliefs)
    normalise(all_)


@compiled
def divide(state: Filter, now_s: float, step: Step, beliefs: Beliefs) -> None:
    """Branch over the time since the last branching, and keep the best, in ``before`` too."""
    branch(state.hypotheses, now_s - state.clocks_s[BRANCHED_S], step, beliefs)
    select(state.hypotheses, state.before)
    state.clocks_s[BRANCHED_S] = now_s


@compiled
def regress(state: Filter, bin_: F64, step: Step, beliefs: Beliefs) -> float:
    """Every hypothesis through its mode's regression; returns the least χ² of the bin under any of them."""
    mean, all_ = state.mean, state.hypotheses
    pose, variances = bin_[POSE : POSE + 3], bin_[VARIANCES:]
    at = Reference(
        mean[YAW] + 0.5 * step.dt_s * mean[YAW_RATE],
        mean[V_LONG],
        mean[OWN],
        mean[YAW_RATE],
        mean[ALPHA],
        mean[YAW_GAIN],
        mean[LOG_DECAY],
    )
    for mode in range(3):
        transition(mode, at, step, beliefs, state.matrices[mode])
        disturbance(mode, at, step, beliefs, state.noises[mode])
    least = np.inf
    for i in range(all_.used[0]):
        mode = all_.mode[i]
        each, covariance = all_.mean[i], all_.covariance[i]
        predict(each, covariance, state.matrices[mode], state.noises[mode], state.work)
        gained, chi_square = correct(each, covariance, pose, variances, state.work[0])
        all_.log_p[i] += gained
        least = min(least, chi_square)
    return least


@compiled
def conclude(state: Filter) -> None:
    """What is said until the next bin."""
    all_, now_s, said = state.hypotheses, state.last[T], state.said
    said[:] = 0.0
    for i in range(all_.used[0]):
        said[all_.mode[i]] += np.exp(all_.log_p[i])
    said[JUMP] = 1.0 if now_s - state.clocks_s[JUMPED_S] < JUMP_SHOWS_S else 0.0
    said[WARM] = 1.0 if now_s - state.clocks_s[START_S] >= WARM_UP_S else 0.0
