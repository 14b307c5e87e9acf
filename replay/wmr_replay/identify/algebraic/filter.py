"""Bins to probabilities: all hypotheses through the regressions, bin by bin."""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.algebraic.bins import IMPULSE, N_SUMS, POSE, VARIANCES, T
from wmr_replay.identify.algebraic.branches import branch, prune_and_merge
from wmr_replay.identify.algebraic.hypotheses import (
    Hypotheses,
    copy_all,
    empty_hypotheses,
    gains_of,
    initialise,
    mean_of,
    normalise,
    release_pose,
)
from wmr_replay.identify.algebraic.priors import Priors
from wmr_replay.identify.algebraic.regression import (
    ALPHA,
    LOG_DECAY,
    MODE_STATE,
    N_MOVING,
    N_UNKNOWNS,
    ONE,
    V_LONG,
    YAW,
    YAW_GAIN,
    YAW_RATE,
    Reference,
    Step,
    measurement_update,
    process_noise,
    time_update,
    transition,
)
from wmr_replay.identify.algebraic.rules import RULES
from wmr_replay.identify.terms import Moving, Terms, extra_accelerations
from wmr_schemas.arrays import F64
from wmr_schemas.compiled import compiled

NEVER_S = -1e9
START_S, BRANCHED_S, JUMPED_S, N_CLOCKS = 0, 1, 2, 3
JUMP, WARM, N_OUTPUTS = 3, 4, 5


class Filter(NamedTuple):
    """The state that is carried from bin to bin.

    ``mean`` (9,) over the hypotheses, the next step's reference; ``last`` (11,) the last bin; ``clocks_s``
    (3,) the last restart, the last branching and the pose's last jump; ``gains`` (2, 3) mean and
    variance of α, β, ℓ; ``output`` (5,) the probabilities of ideal, skidding and slipping, 1 when the pose
    jumped within the last .5 s, and 1 once warm. The rest is scratch.
    """

    hypotheses: Hypotheses
    before: Hypotheses
    mean: F64
    last: F64
    clocks_s: F64
    gains: F64
    output: F64
    matrices: F64
    noises: F64
    work: F64


def new_filter(priors: Priors) -> Filter:
    """The state before the first bin."""
    gains = np.array(
        [
            [priors.alpha, priors.yaw_gain, priors.log_decay],
            [priors.alpha_sd**2, priors.yaw_gain_sd**2, priors.log_decay_sd**2],
        ]
    )
    return Filter(
        empty_hypotheses(),
        empty_hypotheses(),
        np.zeros(N_UNKNOWNS),
        np.full(N_SUMS, NEVER_S),
        np.zeros(N_CLOCKS),
        gains,
        np.zeros(N_OUTPUTS),
        np.zeros((3, N_MOVING, ONE + 1)),
        np.zeros((3, N_UNKNOWNS)),
        np.zeros((N_MOVING, ONE + 1)),
    )


@compiled
def update(state: Filter, bin_: F64, priors: Priors, terms: Terms) -> None:
    """Filter one bin, in place; after a gap of more than 1 s everything but the gains restarts."""
    now_s = bin_[T]
    if now_s - state.last[T] > RULES.max_gap_s:
        initialise(state.hypotheses, bin_[POSE : POSE + 3], bin_[VARIANCES:], state.gains, priors)
        state.clocks_s[:] = now_s, now_s, NEVER_S
    else:
        step = step_between(state, bin_, terms)
        advance(state, bin_, step, priors)
    state.last[:] = bin_
    state.mean[:] = mean_of(state.hypotheses, priors.log_decay)
    state.gains[:] = gains_of(state.hypotheses)
    update_output(state)


@compiled
def release_after_jump(state: Filter, priors: Priors) -> None:
    """Open the pose of every hypothesis: the rows say that it has jumped."""
    if state.hypotheses.used[0]:
        release_pose(state.hypotheses, priors)
        state.clocks_s[JUMPED_S] = state.last[T]


@compiled
def step_between(state: Filter, bin_: F64, terms: Terms) -> Step:
    """The step from the last bin to this one, with the model's further effects at the reference."""
    mean, last = state.mean, state.last
    dt_s, known = bin_[T] - last[T], bin_[IMPULSE + 2] - last[IMPULSE + 2] == 0.0
    force = (bin_[IMPULSE] - last[IMPULSE]) / dt_s if known else np.nan
    difference = (bin_[IMPULSE + 1] - last[IMPULSE + 1]) / dt_s if known else np.nan
    efforts = (force, difference) if known else (0.0, 0.0)
    at = Moving(mean[V_LONG], mean[MODE_STATE], mean[YAW], mean[YAW_RATE], efforts[0], efforts[1])
    known_of = extra_accelerations(at, mean[ALPHA], mean[YAW_GAIN] * terms.half_track_m, terms)
    return Step(dt_s, force, difference, known_of[0], known_of[1], known_of[2])


@compiled
def advance(state: Filter, bin_: F64, step: Step, priors: Priors) -> None:
    """Filter one bin with all hypotheses. They branch every .12 s, and where the bin surprises all of them.

    When no branch explains the bin either, the pose has jumped.
    """
    all_, before, now_s = state.hypotheses, state.before, bin_[T]
    due = now_s - state.clocks_s[BRANCHED_S] >= RULES.branch_s - 1e-6
    if due:
        branch_and_prune(state, now_s, step, priors)
    else:
        copy_all(all_, before)
    surprise = filter_bin(state, bin_, step, priors)
    if surprise > RULES.surprise and not due:
        copy_all(before, all_)
        branch_and_prune(state, now_s, step, priors)
        surprise = filter_bin(state, bin_, step, priors)
    if surprise > RULES.surprise:
        copy_all(before, all_)
        release_pose(all_, priors)
        state.clocks_s[JUMPED_S] = now_s
        filter_bin(state, bin_, step, priors)
    normalise(all_)


@compiled
def branch_and_prune(state: Filter, now_s: float, step: Step, priors: Priors) -> None:
    """Branch over the time since the last branching; prune and merge; ``before`` holds the same."""
    branch(state.hypotheses, now_s - state.clocks_s[BRANCHED_S], step, priors)
    prune_and_merge(state.hypotheses, state.before)
    state.clocks_s[BRANCHED_S] = now_s


@compiled
def filter_bin(state: Filter, bin_: F64, step: Step, priors: Priors) -> float:
    """Every hypothesis through its mode's regression; returns the least χ² of the bin under any of them."""
    mean, all_ = state.mean, state.hypotheses
    pose, variances = bin_[POSE : POSE + 3], bin_[VARIANCES:]
    at = Reference(
        mean[YAW] + 0.5 * step.dt_s * mean[YAW_RATE],
        mean[V_LONG],
        mean[MODE_STATE],
        mean[YAW_RATE],
        mean[ALPHA],
        mean[YAW_GAIN],
        mean[LOG_DECAY],
    )
    for mode in range(3):
        transition(mode, at, step, priors, state.matrices[mode])
        process_noise(mode, at, step, priors, state.noises[mode])
    least = np.inf
    for i in range(all_.used[0]):
        mode = all_.mode[i]
        each, covariance = all_.mean[i], all_.covariance[i]
        time_update(each, covariance, state.matrices[mode], state.noises[mode], state.work)
        gained, chi_square = measurement_update(each, covariance, pose, variances, state.work[0])
        all_.log_p[i] += gained
        least = min(least, chi_square)
    return least


@compiled
def update_output(state: Filter) -> None:
    """The posterior after this bin, held until the next one, into ``output``."""
    all_, now_s, output = state.hypotheses, state.last[T], state.output
    output[:] = 0.0
    for i in range(all_.used[0]):
        output[all_.mode[i]] += np.exp(all_.log_p[i])
    output[JUMP] = 1.0 if now_s - state.clocks_s[JUMPED_S] < RULES.jump_shows_s else 0.0
    output[WARM] = 1.0 if now_s - state.clocks_s[START_S] >= RULES.warm_up_s else 0.0
