"""Posterior of the mode by a two-filter smoother over mode histories, for a linear model by mode.

Forward: Kalman filters over histories up to a bin, the causal answer. Backward: likelihoods
exp(−½ xᵀY x + yᵀx + c) of what follows, over histories to come. Their products, mode by mode, are the answer
in hindsight; with N of each it weighs N²/3 whole histories at every bin. Of both, the best are kept, each
mode with a third of the places; forward histories that have become alike are merged.
"""

import math

import numpy as np
from numba import njit

from wmr_schemas.arrays import F64
from worlds.mode_model import N_MODES, SKIDDING, SLIPPING, Linear, Q, V, W, X, Y

LOWEST = -25.0
ALIKE_SD, ALIKE_RATIO = 0.1, 1.2


@njit(cache=True)
def add_switch(covariance, by, before, mode):
    """What an unknown instant within the bin adds where the mode changes."""
    if before == SKIDDING:
        covariance[X, X] += by[0] * by[0]
        covariance[Y, Y] += by[1] * by[1]
        covariance[X, Y] += by[0] * by[1]
        covariance[Y, X] += by[0] * by[1]
    if mode == SKIDDING:
        covariance[W, W] += by[3] * by[3]
    if SLIPPING in (mode, before):
        covariance[V, V] += by[2] * by[2]
        covariance[Q, Q] += by[4] * by[4]


@njit(cache=True)
def measured(d, wobbles):
    """The measurement's matrix (3, d)."""
    out = np.zeros((3, d))
    for k in range(3):
        out[k, k] = 1.0
        if wobbles:
            out[k, d - 3 + k] = 1.0
    return out


@njit(cache=True)
def alike(mean, other, covariance, other_covariance):
    """Whether two Gaussians agree in v, w, q and what follows."""
    for s in range(V, mean.shape[0]):
        a, b = covariance[s, s] + 1e-14, other_covariance[s, s] + 1e-14
        if (mean[s] - other[s]) ** 2 > ALIKE_SD**2 * a or a > ALIKE_RATIO * b or b > ALIKE_RATIO * a:
            return False
    return True


@njit(cache=True)
def best_of(weight, mode, n, most):
    """Indices of the best ``most`` of n; each mode may fill a third, and what others leave."""
    order = np.argsort(-weight[:n])
    kept, taken, count = np.empty(most, np.int64), np.zeros(n, np.bool_), np.zeros(N_MODES, np.int64)
    m = 0
    for only_thirds in (True, False):
        for h in order:
            if m == most:
                break
            if taken[h] or weight[h] < weight[order[0]] + (2 * LOWEST if only_thirds else LOWEST):
                continue
            if only_thirds and count[mode[h]] >= most // N_MODES:
                continue
            kept[m], taken[h] = h, True
            count[mode[h]] += 1
            m += 1
    return kept[:m]


@njit(cache=True)
def forward(  # noqa: C901, PLR0913, PLR0917 – one compiled pass
    flow, offset, noise, at_switch, pose, variances, start, switches, first, most, wobbles
):
    """Filtered weights, modes, means and covariances at each bin, and how many there are."""
    n, d = pose.shape[0], start.shape[0]
    h_matrix, room = measured(d, wobbles), most * N_MODES
    weights, modes = np.full((n, most), -1e9), np.zeros((n, most), np.int64)
    means, covariances = np.zeros((n, most, d)), np.zeros((n, most, d, d))
    sizes = np.zeros(n, np.int64)
    w, m = np.zeros(room), np.zeros(room, np.int64)
    x, p = np.zeros((room, d)), np.zeros((room, d, d))
    for mode in range(N_MODES):
        w[mode], m[mode], p[mode] = math.log(first[mode]), mode, start
    alive, noise_r = N_MODES, np.diag(variances)
    for k in range(n):
        if k:
            size = sizes[k - 1]
            alive = 0
            for h in range(size):
                for mode in range(N_MODES):
                    before = modes[k - 1, h]
                    w[alive] = weights[k - 1, h] + switches[before, mode]
                    m[alive] = mode
                    f = flow[k - 1, mode]
                    x[alive] = f @ means[k - 1, h] + offset[k - 1, mode]
                    p[alive] = f @ covariances[k - 1, h] @ f.T + noise[k - 1]
                    if mode != before:
                        add_switch(p[alive], at_switch[k - 1], before, mode)
                    alive += 1
        for h in range(alive):
            across = p[h] @ h_matrix.T
            spread = h_matrix @ across + noise_r
            error = pose[k] - h_matrix @ x[h]
            inverse = np.linalg.inv(spread)
            w[h] -= 0.5 * (error @ inverse @ error + math.log(np.linalg.det(spread)))
            gain = across @ inverse
            x[h] += gain @ error
            p[h] -= gain @ across.T
            p[h] = 0.5 * (p[h] + p[h].T)
        order = best_of(w, m, alive, most)
        size = 0
        for h in order:
            twin = -1
            for g in range(size):
                if modes[k, g] == m[h] and alike(means[k, g], x[h], covariances[k, g], p[h]):
                    twin = g
                    break
            if twin >= 0:
                weights[k, twin] = np.logaddexp(weights[k, twin], w[h])
            else:
                weights[k, size], modes[k, size] = w[h], m[h]
                means[k, size], covariances[k, size] = x[h], p[h]
                size += 1
        sizes[k] = size
        top = np.max(weights[k, :size])
        weights[k, :size] -= top + math.log(np.sum(np.exp(weights[k, :size] - top)))
    return weights, modes, means, covariances, sizes


@njit(cache=True)
def inner(information, vector, constant, mean, covariance):
    """Logarithm of ∫ N(x; mean, covariance) exp(−½ xᵀY x + yᵀx + c) dx."""
    d = len(mean)
    whole = np.eye(d) + information @ covariance
    left = np.linalg.solve(whole, np.stack((information @ mean, vector), axis=1))
    pull = covariance @ vector
    return (
        constant
        - 0.5 * math.log(abs(np.linalg.det(whole)))
        - 0.5 * mean @ left[:, 0]
        + mean @ left[:, 1]
        + 0.5 * pull @ left[:, 1]
    )


@njit(cache=True)
def references(weights, modes, means, covariances, size):
    """For each mode one Gaussian with the moments of its forward histories; of all, where it has none."""
    d = means.shape[1]
    centre, spread = np.zeros((N_MODES, d)), np.zeros((N_MODES, d, d))
    for mode in range(N_MODES):
        any_of = False
        for h in range(size):
            any_of = any_of or modes[h] == mode
        total = 0.0
        for h in range(size):
            if modes[h] == mode or not any_of:
                share = math.exp(max(weights[h], -300.0))
                total += share
                centre[mode] += share * means[h]
        centre[mode] /= total
        for h in range(size):
            if modes[h] == mode or not any_of:
                share = math.exp(max(weights[h], -300.0)) / total
                off = means[h] - centre[mode]
                spread[mode] += share * (covariances[h] + np.outer(off, off))
    return centre, spread


@njit(cache=True)
def backward(  # noqa: C901, PLR0912, PLR0913, PLR0915, PLR0917 – one compiled pass
    flow, offset, noise, at_switch, pose, variances, switches, ahead, most, pairs, wobbles
):
    """Smoothed log posterior by mode, (n, 3)."""
    weights, modes, means, covariances, sizes = ahead
    n, d = pose.shape[0], means.shape[2]
    h_matrix, room = measured(d, wobbles), most * N_MODES
    precision = h_matrix.T @ np.diag(1 / variances)
    inform, vec = np.zeros((room, d, d)), np.zeros((room, d))
    const, label, score = np.zeros(room), np.zeros(room, np.int64), np.zeros(room)
    alive = N_MODES
    for mode in range(N_MODES):
        label[mode] = mode
    posterior = np.full((n, N_MODES), -1e9)
    kept_inform, kept_vec = inform[:most].copy(), vec[:most].copy()
    kept_const, kept_label = const[:most].copy(), label[:most].copy()
    kept_score, size = np.zeros(most), N_MODES
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            alive = 0
            for g in range(size):
                mode = kept_label[g]
                full = kept_inform[g] + precision @ h_matrix
                pull = kept_vec[g] + precision @ pose[k + 1]
                error = pose[k + 1]
                base = kept_const[g] - 0.5 * np.sum(error * error / variances)
                f, o = flow[k, mode], offset[k, mode]
                for before in range(N_MODES):
                    spread = noise[k].copy()
                    if before != mode:
                        add_switch(spread, at_switch[k], before, mode)
                    whole = np.eye(d) + full @ spread
                    some = np.empty((d, d + 1))
                    some[:, :d], some[:, d] = full, pull
                    some = np.linalg.solve(whole, some)
                    info, v = some[:, :d].copy(), some[:, d].copy()
                    info = 0.5 * (info + info.T)
                    c = base - 0.5 * math.log(abs(np.linalg.det(whole))) + 0.5 * (spread @ pull) @ v
                    inform[alive] = f.T @ info @ f
                    vec[alive] = f.T @ (v - info @ o)
                    const[alive] = c - 0.5 * o @ info @ o + v @ o + switches[before, mode]
                    label[alive] = before
                    alive += 1
        centre, around = references(weights[k], modes[k], means[k], covariances[k], sizes[k])
        for g in range(alive):
            score[g] = inner(inform[g], vec[g], const[g], centre[label[g]], around[label[g]])
        order = best_of(score, label, alive, most)
        top = np.max(score[order])
        size = len(order)
        for place in range(size):
            g = order[place]
            kept_inform[place], kept_vec[place] = inform[g], vec[g]
            kept_const[place], kept_label[place], kept_score[place] = const[g] - top, label[g], score[g] - top
        for h in range(sizes[k]):
            if weights[k, h] < LOWEST:
                continue
            mode, done = modes[k, h], 0
            for g in range(size):
                if kept_label[g] != mode or kept_score[g] < LOWEST:
                    continue
                together = weights[k, h] + inner(
                    kept_inform[g], kept_vec[g], kept_const[g], means[k, h], covariances[k, h]
                )
                posterior[k, mode] = np.logaddexp(posterior[k, mode], together)
                done += 1
                if done == pairs:
                    break
    return posterior


def told_posteriors(model: Linear, switch_rates: F64, most: int) -> tuple[F64, F64]:
    """Causal and smoothed posterior (3, n) of the bins; ``switch_rates`` (3, 3) in 1/s from row to column."""
    seconds = 0.01 * model.rows
    stay = switch_rates.sum(axis=1)
    chances = (1 - np.exp(-seconds * stay))[:, None] * switch_rates / stay[:, None]
    switches = np.log(chances + np.diag(1 - chances.sum(axis=1)))
    first = np.array([0.98, 0.01, 0.01])
    parts = (model.flow, model.offset, model.noise, model.at_switch, model.pose, model.variances)
    ahead = forward(*parts, model.start, switches, first, most, model.wobbles)
    smoothed = backward(*parts, switches, ahead, most, most, model.wobbles)
    weights, modes = ahead[0], ahead[1]
    causal = np.stack([np.where(modes == k, np.exp(weights), 0.0).sum(axis=1) for k in range(N_MODES)])
    smoothed = np.exp(smoothed - smoothed.max(axis=1, keepdims=True))
    return causal / causal.sum(axis=0), (smoothed / smoothed.sum(axis=1, keepdims=True)).T
