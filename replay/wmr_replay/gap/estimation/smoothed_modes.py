"""The contact modes that a model sees on a log, by the likelihood that sums over them.

An identifier knows a model's effects and no disturbance, and calls slipping what a formula has left of them.
The filter of :mod:`.unknown_modes` has the model's own disturbances. Its probabilities p_k(j) of the modes,
which know the past alone, are smoothed from the last row back:

    s_k(j) = Σ_m s_k+1(m) p_k(j) T_jm / Σ_i p_k(i) T_im

with T the chain of the switches; each row has its most probable mode. Source: Kim, Dynamic linear models with
Markov-switching, Journal of Econometrics 60 (1994).
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.relabel import with_modes
from wmr_replay.gap.estimation.unknown_modes import N_MODES, Chain, causal_pass, chain_of
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean


def with_smoothed_modes(problem: Problem, extension: Extension, noise: Diffusion) -> Problem:
    """The problem with the most probable mode of each row, given all of them."""
    return problem.relabelled(with_modes(problem.binned, smoothed_modes(problem, extension, noise)))


def smoothed_modes(problem: Problem, extension: Extension, noise: Diffusion) -> I64:
    """The most probable mode (n,) of each row, given all of them."""
    unlabelled = replace(problem, train=np.zeros(len(problem.binned), bool))
    weights = causal_pass(unlabelled, extension, noise).weights
    switches = switches_of(chain_of(unlabelled), problem.binned.step_s)
    smooth(weights, switches, np.zeros(N_MODES))
    return np.asarray(np.argmax(weights, axis=1))


def switches_of(chain: Chain, step_s: F64) -> F64:
    """The probabilities (n, 4, 4) of the modes at each row, by the mode at the row before."""
    leaves = 1.0 - np.exp(-chain.rates_per_s * step_s[:, None])
    return np.asarray((1.0 - leaves)[:, :, None] * np.eye(N_MODES) + leaves[:, :, None] * chain.shares)


@lean
def smooth(weights: F64, switches: F64, ahead: F64) -> None:
    """Weights (n, 4) given the past ← given all rows; ``ahead`` (4,) is memory."""
    for k in range(len(weights) - 2, -1, -1):
        for m in range(len(ahead)):
            ahead[m] = 0.0
            for j in range(len(ahead)):
                ahead[m] += weights[k, j] * switches[k + 1, j, m]
        for j in range(len(ahead)):
            share = 0.0
            for m in range(len(ahead)):
                if ahead[m] > 0.0:
                    share += weights[k + 1, m] * switches[k + 1, j, m] / ahead[m]
            weights[k, j] *= share
