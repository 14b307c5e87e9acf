"""The measurement update of a hypothesis by a pose."""

import math

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

OUTLIER_SD = PRIORS.outlier_sd


@lean
def update(mean: F64, covariance: F64, pose: F64, variances: F64, gain: F64) -> float:
    """Kalman update by x, y, ψ in turn; returns the log likelihood. ``gain`` (s,) is scratch.

    An innovation beyond 5 sd counts as one of 5 sd with a larger variance. The influence of an outlier is
    bounded. Whole rows of the covariance are updated, as processors do at once, of which the upper triangle
    counts; the lower one is its copy.
    """
    log_likelihood, n_states = 0.0, mean.shape[0]
    for c in range(3):
        error = pose[c] - mean[c]
        variance = max(covariance[c, c] + variances[c], (error / OUTLIER_SD) ** 2)
        log_likelihood -= 0.5 * (error * error / variance + math.log(variance))
        for i in range(n_states):
            gain[i] = covariance[min(i, c), max(i, c)]
        for i in range(n_states):
            share = gain[i] / variance
            mean[i] += share * error
            for j in range(n_states):
                covariance[i, j] -= share * gain[j]
    for i in range(n_states):
        for j in range(i):
            covariance[i, j] = covariance[j, i]
    return log_likelihood
