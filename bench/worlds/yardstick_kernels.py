"""The yardstick's two passes over histories of modes: a filter forward, draws of whole histories backward.

Forward, every hypothesis is a mode since a bin, with a Kalman filter. Each bin it goes on, and it may change
into the other modes; those that change from one mode into the same other mode in one bin are merged (first
and second moments), so that hypotheses differ in when the last mode began. The best ``most`` stay, and take
up the others: each goes into the one of its mode that began next to it. In the bin of a change the new mode
has the share ``mixing`` of the prediction, a half where the change lies anywhere in the bin; the difference
of both modes' predictions, uniform over the bin, widens the covariance.

Backward, histories are drawn from the joint posterior of modes and states (forward filtering, backward
simulation; Lindsten and Schön 2013, algorithm 6): at each bin a hypothesis in proportion to its weight times
the density of the state that was drawn behind it. The posterior of a mode is the mean of these weights, not
the count of the draws.
"""

import math

import numpy as np
from numba import njit

N_MODES, POSE, FIRST_WOBBLE = 3, 3, 9
HOPELESS = 16.0
"""A hypothesis whose weight is e⁻¹⁶ changes its mode no more."""

NO_VARIANCE = 1e-15


@njit(cache=True, error_model="numpy")
def predicted(mean, covariance, mode, last, k, flow, offset, process, mixing):  # noqa: PLR0913, PLR0917
    """Mean and covariance of a hypothesis one bin later under ``mode``, which follows ``last``."""
    F = flow[k, mode]
    ahead = F @ mean + offset[k, mode]
    wide = F @ covariance @ F.T + process
    if mode != last:
        other = flow[k, last] @ mean + offset[k, last]
        for a in range(len(mean)):
            for b in range(len(mean)):
                wide[a, b] += (ahead[a] - other[a]) * (ahead[b] - other[b]) / 12
        ahead = other + mixing[last, mode] * (ahead - other)
    return ahead, wide


@njit(cache=True, error_model="numpy")
def updated(mean, covariance, measured, variance):
    """Measurement update in place, one coordinate of the pose after the other; the log-likelihood."""
    d, likelihood = len(mean), 0.0
    wobbles = d > FIRST_WOBBLE
    along = np.empty(d)
    for c in range(POSE):
        for a in range(d):
            along[a] = covariance[a, c] + (covariance[a, FIRST_WOBBLE + c] if wobbles else 0.0)
        spread = along[c] + (along[FIRST_WOBBLE + c] if wobbles else 0.0) + variance[c]
        error = measured[c] - mean[c] - (mean[FIRST_WOBBLE + c] if wobbles else 0.0)
        likelihood -= 0.5 * (error * error / spread + math.log(spread))
        for a in range(d):
            mean[a] += along[a] / spread * error
            for b in range(d):
                covariance[a, b] -= along[a] * along[b] / spread
    return likelihood


@njit(cache=True, error_model="numpy")
def merged_switch(  # noqa: PLR0913, PLR0917 – the filter's arrays, as they are
    modes, weights, means, covariances, last, mode, k, flow, offset, process, mixing
):
    """Weight, mean and covariance of all hypotheses of mode ``last`` that change into ``mode`` in bin k."""
    d = means.shape[1]
    total, mean, wide = 0.0, np.zeros(d), np.zeros((d, d))
    for h in range(len(modes)):
        if modes[h] != last or weights[h] < -HOPELESS:
            continue
        share = math.exp(weights[h])
        ahead, spread = predicted(means[h], covariances[h], mode, last, k, flow, offset, process, mixing)
        total += share
        for a in range(d):
            mean[a] += share * ahead[a]
            for b in range(d):
                wide[a, b] += share * (spread[a, b] + ahead[a] * ahead[b])
    if total > 0.0:
        mean /= total
        wide /= total
        for a in range(d):
            for b in range(d):
                wide[a, b] -= mean[a] * mean[b]
    return total, mean, wide


@njit(cache=True, error_model="numpy")
def merge_into_next(kept, lost, modes, born, weights, means, covariances):
    """Hypothesis ``lost`` into the kept one of its mode that began next to it; dropped without one."""
    into, least = -1, 0
    for h in kept:
        apart = abs(born[h] - born[lost])
        if modes[h] == modes[lost] and (into < 0 or apart < least):
            into, least = h, apart
    if into < 0:
        return
    ratio = math.exp(weights[lost] - weights[into])
    share = ratio / (1 + ratio)
    d = means.shape[1]
    apart_mean = means[lost] - means[into]
    for a in range(d):
        means[into, a] += share * apart_mean[a]
        for b in range(d):
            spread = (1 - share) * covariances[into, a, b] + share * covariances[lost, a, b]
            covariances[into, a, b] = spread + share * (1 - share) * apart_mean[a] * apart_mean[b]
    weights[into] += math.log1p(ratio)


@njit(cache=True, error_model="numpy")
def forward(  # noqa: PLR0913, PLR0917 – the model's arrays, as they are
    flow, offset, process, mixing, measured, variance, start, switching, most
):
    """Hypotheses behind each bin: how many, modes, log weights, means, covariances; posterior (n, 3)."""
    n, d = len(flow), flow.shape[2]
    count = np.zeros(n, np.int64)
    modes, weights = np.zeros((n, most), np.int64), np.full((n, most), -np.inf)
    means, covariances = np.zeros((n, most, d)), np.zeros((n, most, d, d))
    posterior = np.zeros((n, N_MODES))
    room = most + N_MODES * N_MODES
    new_modes, new_weights, new_born = np.zeros(room, np.int64), np.zeros(room), np.zeros(room, np.int64)
    new_means, new_covariances = np.zeros((room, d)), np.zeros((room, d, d))
    old_modes, old_weights, old_born = np.zeros(1, np.int64), np.zeros(1), np.zeros(1, np.int64)
    old_means, old_covariances = np.zeros((1, d)), start.copy().reshape(1, d, d)
    for k in range(n):
        found = 0
        for h in range(len(old_weights)):
            mode = old_modes[h]
            new_modes[found], new_born[found] = mode, old_born[h]
            new_weights[found] = old_weights[h] + math.log(switching[mode, mode])
            new_means[found], new_covariances[found] = predicted(
                old_means[h], old_covariances[h], mode, mode, k, flow, offset, process, mixing
            )
            found += 1
        for last in range(N_MODES):
            for mode in range(N_MODES):
                if mode == last:
                    continue
                weight, mean, wide = merged_switch(
                    old_modes,
                    old_weights,
                    old_means,
                    old_covariances,
                    last,
                    mode,
                    k,
                    flow,
                    offset,
                    process,
                    mixing,
                )
                if weight > 0.0:
                    new_modes[found], new_born[found] = mode, k
                    new_weights[found] = math.log(weight) + math.log(switching[last, mode])
                    new_means[found], new_covariances[found] = mean, wide
                    found += 1
        for h in range(found):
            new_weights[h] += updated(new_means[h], new_covariances[h], measured[k], variance[k])
        best = np.argsort(-new_weights[:found])
        kept = min(found, most)
        for j in range(kept, found):
            merge_into_next(
                best[:kept], best[j], new_modes, new_born, new_weights, new_means, new_covariances
            )
        best = best[:kept]
        top = new_weights[best[0]]
        total = top + math.log(np.sum(np.exp(new_weights[best] - top)))
        count[k] = kept
        old_born = new_born[best]
        for j in range(kept):
            h = best[j]
            modes[k, j], weights[k, j] = new_modes[h], new_weights[h] - total
            means[k, j], covariances[k, j] = new_means[h], new_covariances[h]
            posterior[k, new_modes[h]] += math.exp(weights[k, j])
        old_modes, old_weights = modes[k, :kept], weights[k, :kept]
        old_means, old_covariances = means[k, :kept], covariances[k, :kept]
    return count, modes, weights, means, covariances, posterior


@njit(cache=True, error_model="numpy")
def root_of(matrix):
    """Lower Cholesky factor; a direction without variance gets none."""
    d = len(matrix)
    root = np.zeros((d, d))
    for a in range(d):
        for b in range(a + 1):
            total = matrix[a, b]
            for c in range(b):
                total -= root[a, c] * root[b, c]
            if a == b:
                root[a, a] = math.sqrt(total) if total > NO_VARIANCE else 0.0
            elif root[b, b] > 0.0:
                root[a, b] = total / root[b, b]
    return root


@njit(cache=True, error_model="numpy")
def log_density(root, error, work):
    """Log of the normal density up to a constant, by forward substitution."""
    total = 0.0
    for a in range(len(error)):
        value = error[a]
        for b in range(a):
            value -= root[a, b] * work[b]
        work[a] = value / root[a, a]
        total -= 0.5 * work[a] * work[a] + math.log(root[a, a])
    return total


@njit(cache=True, error_model="numpy")
def drawn_index(weights, uniform):
    """Index of a draw in proportion to the weights, which add up to 1."""
    total = 0.0
    for i in range(len(weights)):
        total += weights[i]
        if uniform < total:
            return i
    return len(weights) - 1


@njit(cache=True, error_model="numpy")
def backward(  # noqa: PLR0913, PLR0917 – the filter's arrays, as they are
    flow, offset, process, mixing, switching, count, modes, weights, means, covariances, draws, seed
):
    """Posterior (n, 3) of the mode given all data, from ``draws`` histories."""
    np.random.seed(seed)  # noqa: NPY002 – numba's own generator
    n, d, most = len(flow), flow.shape[2], modes.shape[1]
    posterior = np.zeros((n, N_MODES))
    states, behind = np.zeros((draws, d)), np.zeros(draws, np.int64)
    ahead, roots = np.zeros((most, N_MODES, d)), np.zeros((most, N_MODES, d, d))
    gains, inner = np.zeros((most, N_MODES, d, d)), np.zeros((most, N_MODES, d, d))
    ready, known = np.zeros((most, N_MODES), np.bool_), np.zeros((most, N_MODES), np.bool_)
    work, share = np.zeros(d), np.zeros(most)
    for s in range(draws):
        kept = count[n - 1]
        i = drawn_index(np.exp(weights[n - 1, :kept]), np.random.random())  # noqa: NPY002
        states[s] = means[n - 1, i] + root_of(covariances[n - 1, i]) @ np.random.standard_normal(d)  # noqa: NPY002
        behind[s] = modes[n - 1, i]
    for i in range(count[n - 1]):
        posterior[n - 1, modes[n - 1, i]] += math.exp(weights[n - 1, i])
    for k in range(n - 2, -1, -1):
        kept = count[k]
        ready[:], known[:] = False, False
        for s in range(draws):
            mode, top = behind[s], -np.inf
            for i in range(kept):
                if not ready[i, mode]:
                    mean, wide = predicted(
                        means[k, i],
                        covariances[k, i],
                        mode,
                        modes[k, i],
                        k + 1,
                        flow,
                        offset,
                        process,
                        mixing,
                    )
                    ahead[i, mode], roots[i, mode] = mean, root_of(wide)
                    ready[i, mode] = True
                share[i] = weights[k, i] + math.log(switching[modes[k, i], mode])
                share[i] += log_density(roots[i, mode], states[s] - ahead[i, mode], work)
                top = max(top, share[i])
            total = 0.0
            for i in range(kept):
                share[i] = math.exp(share[i] - top)
                total += share[i]
            for i in range(kept):
                share[i] /= total
                posterior[k, modes[k, i]] += share[i] / draws
            i = drawn_index(share[:kept], np.random.random())  # noqa: NPY002
            if not known[i, mode]:
                F = flow[k + 1, mode]
                wide = roots[i, mode] @ roots[i, mode].T
                gains[i, mode] = np.linalg.solve(wide, F @ covariances[k, i]).T
                inner[i, mode] = root_of(covariances[k, i] - gains[i, mode] @ F @ covariances[k, i])
                known[i, mode] = True
            error = states[s] - ahead[i, mode]
            states[s] = means[k, i] + gains[i, mode] @ error
            states[s] += inner[i, mode] @ np.random.standard_normal(d)  # noqa: NPY002
            behind[s] = modes[k, i]
    return posterior
