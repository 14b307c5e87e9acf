"""−2 log likelihood of held-out rows whose contact modes are not known, marginalised causally.

On fitted rows the filter of :mod:`.filter` runs with the identifier's modes. On held-out rows a filter runs
for every pair of modes (before, now). After each pose the pairs with one mode now are merged into a Gaussian
of their mean and covariance (GPB2):

    −2 ln p(y_k | y_1..k−1) = −2 ln Σ_jm p_k−1(j) T_jm exp(−D_jm/2)
    p_k(m) = c Σ_j p_k−1(j) T_jm exp(−D_jm/2), c such that their sum is 1

with D_jm the −2 log likelihood of the pose in the pair's filter, and T the chain of the identifier's
switches. A smoothed mode knows what follows it, and takes for slip or skid what a model lacks; this score
knows the past alone. Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and
Navigation (2001), ch. 11.6.
"""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.estimation.filter import (
    LOG_TWO_PI,
    copy,
    correct,
    gain_of,
    predict_covariance,
    update_covariance,
)
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import (
    Diffusion,
    add_noise,
    decay_disturbances,
    decays,
    first_covariance,
)
from wmr_replay.gap.model.dynamics import (
    N_MOTION,
    N_ROW,
    N_STATE,
    YAW,
    Base,
    Row,
    W,
    halfway,
    heading,
    is_slipping,
    measured,
    responses,
    skids,
    step_from,
)
from wmr_replay.gap.model.extension import LOOSE_MPS, Extension
from wmr_replay.gap.model.jacobians import jacobian, slopes_of_measurement
from wmr_replay.gap.settings.filter import FilterSettings
from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.compiled.lean import inlined, lean
from wmr_schemas.modes import MODES, ContactMode

N_MODES, UNDECIDED = len(MODES), int(ContactMode.UNDECIDED)


class Chain(NamedTuple):
    """The switches of the mode: rates of leaving each mode (4,) in 1/s, shares of the modes that follow
    (4, 4), and the probabilities of the modes at a log's first row (4,).
    """

    rates_per_s: F64
    shares: F64
    first: F64


class Rows(NamedTuple):
    """Input rows (n, 16) with the modes known, all gripping, and all slipping; poses and variances (n, 3);
    which rows are held out (n,).
    """

    labelled: F64
    gripping: F64
    slipping: F64
    poses: F64
    variances: F64
    held_out: Bool


class MotionModel(NamedTuple):
    """An extended model as compiled code takes it: θ, the base model's numbers, diffusion, settings."""

    theta: F64
    base: Base
    noise: Diffusion
    settings: FilterSettings


class Workspace(NamedTuple):
    """Memory of a step: states half-way and after it (9,), its Jacobian (9, 9), products (6, 9), a pose (3,),
    its slopes (3, 3), P hᵀ and gains (3, 9) of its components, and an input row (16,).
    """

    middle: F64
    moved: F64
    F: F64
    ahead: F64
    at: F64
    H: F64
    crossed: F64
    gains: F64
    row: F64


class Mixture(NamedTuple):
    """A Gaussian for each mode: weights (4,), states (4, 9), covariances (4, 9, 9). The same for each pair of
    modes before and now; ``cost`` (4, 4) is −2 log of a pair's prior and likelihood, infinite where it is
    left out.
    """

    weight: F64
    z: F64
    P: F64
    pair_weight: F64
    pair_z: F64
    pair_covariance: F64
    cost: F64


class Pass(NamedTuple):
    """−2 log likelihood (n,) of each row, and probabilities (n, 4) of the modes of each held-out row; both of
    what no row after it says.
    """

    deviance: F64
    weights: F64


def workspace() -> Workspace:
    """Memory for one pass."""
    zeros = np.zeros
    return Workspace(
        middle=zeros(N_STATE),
        moved=zeros(N_STATE),
        F=zeros((N_STATE, N_STATE)),
        ahead=zeros((N_MOTION, N_STATE)),
        at=zeros(3),
        H=zeros((3, 3)),
        crossed=zeros((3, N_STATE)),
        gains=zeros((3, N_STATE)),
        row=zeros(N_ROW),
    )


def mixture() -> Mixture:
    """Memory for the Gaussians of one pass."""
    m, zeros = N_MODES, np.zeros
    return Mixture(
        weight=zeros(m),
        z=zeros((m, N_STATE)),
        P=zeros((m, N_STATE, N_STATE)),
        pair_weight=zeros((m, m)),
        pair_z=zeros((m, m, N_STATE)),
        pair_covariance=zeros((m, m, N_STATE, N_STATE)),
        cost=zeros((m, m)),
    )


def causal_deviance(problem: Problem, extension: Extension, noise: Diffusion) -> F64:
    """−2 log likelihood (n,) of each row given those before it: of a fitted one with its mode, of a held-out
    one whatever its mode.
    """
    return causal_pass(problem, extension, noise).deviance


def causal_pass(problem: Problem, extension: Extension, noise: Diffusion) -> Pass:
    """:func:`causal_deviance`, and the probabilities of the modes."""
    binned, first, settings = problem.binned, problem.first.copy(), problem.settings.filter
    problem.worked(problem.settings.work.of_unknown_modes)
    first[W] *= extension.base.half_track_m
    everywhere = np.ones(len(binned))
    rows = Rows(
        extension.rows(binned, known_modes(problem)),
        extension.rows(binned, ContactMode.IDEAL * everywhere),
        extension.rows(binned, ContactMode.SLIPPING * everywhere),
        extension.poses(binned),
        problem.variances,
        ~problem.train,
    )
    model = MotionModel(extension.theta(), extension.base, noise, settings)
    covariance, chain = first_covariance(noise, settings.first_variance), chain_of(problem)
    seen = Pass(np.zeros(len(binned)), np.zeros((len(binned), N_MODES)))
    score_rows(rows, chain, model, first, covariance, mixture(), workspace(), seen)
    return seen


def known_modes(problem: Problem) -> F64:
    """The modes (n,) of the fitted rows; a held-out row has that of the last fitted one."""
    last = np.maximum.accumulate(np.where(problem.train, np.arange(len(problem.train)), -1))
    return np.asarray(problem.binned.mode[np.where(last < 0, np.argmax(problem.train), last)])


def chain_of(problem: Problem) -> Chain:
    """The identifier's switches: (switches + a)/(time + b), counted on the fitted rows, with its a and b.

    Rolling is left for a skid or slip alike. Both at once is never entered: the identifier has no such
    hypothesis, but a label may say so.
    """
    mode, spent_s = problem.binned.mode, problem.binned.step_s[1:]
    before, now = mode[:-1], mode[1:]
    fitted, rolled = problem.train[1:] & problem.train[:-1], before == ContactMode.IDEAL
    left, ended = fitted & rolled & (now != before), fitted & ~rolled & (now != before)
    n_ended = PRIORS.ends_seen + np.sum(ended)
    n_left, seen_s = PRIORS.rolls_seen + np.sum(left), PRIORS.rolls_seen * PRIORS.rolled_s
    leaves = n_left / (seen_s + np.sum(spent_s[fitted & rolled]))
    ends = n_ended / (PRIORS.ends_seen * PRIORS.lost_s + np.sum(spent_s[fitted & ~rolled]))
    n_across = PRIORS.across * PRIORS.ends_seen + np.sum(ended & (now != ContactMode.IDEAL))
    across, lost = n_across / n_ended, (1 - PRIORS.starts_rolling) / 2
    home = 1 - across
    shares = [[0, 0.5, 0.5, 0], [home, 0, across, 0], [home, across, 0, 0], [home, across / 2, across / 2, 0]]
    first = np.array([PRIORS.starts_rolling, lost, lost, 0.0])
    return Chain(np.array([leaves, ends, ends, ends]), np.array(shares, np.float64), first)


@inlined
def predict(z: F64, P: F64, row: F64, mode_before: float, model: MotionModel, work: Workspace) -> None:
    """Time update of ``z`` (9,) and ``P`` (9, 9) by one row."""
    theta, base, noise = model.theta, model.base, model.noise
    acts, kept = responses(row, theta, base), decays(row[Row.DT], noise)
    halfway(z, acts, row, theta, base, work.middle)
    towards = heading(work.middle)
    step_from(work.middle, towards, z, acts, row, theta, base, work.moved)
    jacobian(z, acts, row, theta, base, work.moved, work.middle, towards, work.F)
    decay_disturbances(work.F, work.moved, kept)
    copy(z, work.moved)
    predict_covariance(work.F, P, work.ahead)
    add_noise(P, row, mode_before, noise, kept, model.settings)


@inlined
def update(z: F64, P: F64, row: F64, rows: Rows, k: int, model: MotionModel, work: Workspace) -> float:
    """Measurement update of ``z`` (9,) and ``P`` (9, 9) by pose ``k``; −2 log likelihood of that pose."""
    deviance, most = 0.0, model.settings.outlier_sd**2
    slopes_of_measurement(z, model.theta, work.H)
    for c in range(3):
        measured(z, row, model.theta, work.at)
        error = rows.poses[k, c] - work.at[c]
        slope = work.H[c, YAW] if c < YAW else 0.0
        s = gain_of(c, P, slope, rows.variances[k, c], work.crossed, work.gains)
        correct(z, error, work.gains[c])
        deviance += math.log(s) + LOG_TWO_PI + min(error * error / s, most)
    update_covariance(P, work.crossed, work.gains)
    return deviance


@inlined
def copy_state(z: F64, P: F64, z_from: F64, P_from: F64) -> None:
    """``z`` (9,), ``P`` (9, 9) ← another state and covariance."""
    copy(z, z_from)
    for i in range(N_STATE):
        copy(P[i], P_from[i])


@inlined
def follow(
    j: int, m: int, rows: Rows, k: int, model: MotionModel, mixture: Mixture, work: Workspace
) -> float:
    """The pair of modes (``j``, ``m``) through row ``k``; −2 log likelihood of its pose."""
    z, P, row = mixture.pair_z[j, m], mixture.pair_covariance[j, m], work.row
    copy_state(z, P, mixture.z[j], mixture.P[j])
    of_mode = rows.slipping[k] if is_slipping(m) else rows.gripping[k]
    for i in range(N_ROW):
        row[i] = of_mode[i]
    row[Row.MODE] = m
    row[Row.LOOSE] = LOOSE_MPS if skids(j, model.theta) != skids(m, model.theta) else 0.0
    if k > 0:
        predict(z, P, row, j, model, work)
    return update(z, P, row, rows, k, model, work)


@inlined
def score_pairs(
    rows: Rows, k: int, chain: Chain, model: MotionModel, mixture: Mixture, work: Workspace
) -> float:
    """The held-out row ``k`` in every probable pair, merged by the mode now; −2 log likelihood of it."""
    least, dt = np.inf, rows.labelled[k, Row.DT]
    for j in range(N_MODES):
        leaves = 1.0 - math.exp(-chain.rates_per_s[j] * dt) if k > 0 else 0.0
        for m in range(N_MODES):
            prior = mixture.weight[j] * (1.0 - leaves if j == m else leaves * chain.shares[j, m])
            mixture.cost[j, m] = np.inf
            if prior >= model.settings.least_pair:
                deviance = follow(j, m, rows, k, model, mixture, work)
                mixture.cost[j, m] = deviance - 2.0 * math.log(prior)
            least = min(least, mixture.cost[j, m])
    return least - 2.0 * math.log(merge(mixture, least))


@inlined
def merge(mixture: Mixture, least: float) -> float:
    """The Gaussian of each mode now ← that of the pairs that end in it. Returns Σ exp((least − cost)/2)."""
    total = 0.0
    for j in range(N_MODES):
        for m in range(N_MODES):
            mixture.pair_weight[j, m] = math.exp((least - mixture.cost[j, m]) / 2.0)
            total += mixture.pair_weight[j, m]
    for m in range(N_MODES):
        mixture.weight[m] = 0.0
        for j in range(N_MODES):
            mixture.pair_weight[j, m] /= total
            mixture.weight[m] += mixture.pair_weight[j, m]
        pairs = mixture.pair_weight[:, m], mixture.pair_z[:, m], mixture.pair_covariance[:, m]
        blend(*pairs, mixture.weight[m], mixture.z[m], mixture.P[m])
    return total


@inlined
def blend(weight: F64, zs: F64, covariances: F64, total: float, z: F64, P: F64) -> None:
    """``z`` (9,), ``P`` (9, 9) ← mean and covariance of Gaussians of these weights, of sum ``total``."""
    for i in range(N_STATE):
        z[i] = 0.0
        for l in range(N_STATE):
            P[i, l] = 0.0
    for j in range(len(weight)):
        if weight[j] > 0.0:
            for i in range(N_STATE):
                z[i] += weight[j] / total * zs[j, i]
    for j in range(len(weight)):
        if weight[j] > 0.0:
            for i in range(N_STATE):
                for l in range(N_STATE):
                    spread = (zs[j, i] - z[i]) * (zs[j, l] - z[l])
                    P[i, l] += weight[j] / total * (covariances[j, i, l] + spread)


@lean
def open_mixture(mixture: Mixture, z: F64, P: F64, mode: int, first: F64) -> None:
    """One Gaussian for every mode; all weight to ``mode``, or as ``first`` (4,) where it is undecided."""
    for m in range(N_MODES):
        known = 1.0 if m == mode else 0.0
        mixture.weight[m] = first[m] if mode == UNDECIDED else known
        copy_state(mixture.z[m], mixture.P[m], z, P)


@lean
def most_probable(weight: F64) -> int:
    """The place of the largest weight."""
    best = 0
    for m in range(len(weight)):
        best = m if weight[m] > weight[best] else best
    return best


@lean
def score_rows(
    rows: Rows,
    chain: Chain,
    model: MotionModel,
    z: F64,
    P: F64,
    mixture: Mixture,
    work: Workspace,
    seen: Pass,
) -> None:
    """Fill what is ``seen`` by :func:`causal_pass`; ``z`` (9,) and ``P`` (9, 9) are of row 0."""
    mode, was_held_out = UNDECIDED, False
    for k in range(len(seen.deviance)):
        if rows.held_out[k]:
            if not was_held_out:
                open_mixture(mixture, z, P, mode, chain.first)
            seen.deviance[k] = score_pairs(rows, k, chain, model, mixture, work)
            for m in range(N_MODES):
                seen.weights[k, m] = mixture.weight[m]
        else:
            if was_held_out:
                blend(mixture.weight, mixture.z, mixture.P, 1.0, z, P)
                mode = most_probable(mixture.weight)
            row = rows.labelled[k]
            if k > 0:
                predict(z, P, row, mode, model, work)
            seen.deviance[k] = update(z, P, row, rows, k, model, work)
            mode = int(row[Row.MODE])
        was_held_out = rows.held_out[k]
