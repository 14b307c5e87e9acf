"""Hypotheses about when the mode switched: their columns, their beginning, their means.

A hypothesis is a sequence of modes with its switches. Its evidence is the likelihood of the poses under the
regressions of its modes, one after the other, each with a window that starts at its switch.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.algebraic.priors import Priors
from wmr_replay.identify.algebraic.regression import (
    ALPHA,
    LOG_DECAY,
    MODE_STATE,
    N_UNKNOWNS,
    V_LONG,
    YAW,
    YAW_RATE,
    X,
    Y,
)
from wmr_replay.identify.algebraic.rules import RULES
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode

CAPACITY = 3 * RULES.n_kept + 1
"""Each may have two children, and the first one more."""


class Hypotheses(NamedTuple):
    """Columns: means (C, 9), covariances (C, 9, 9), log probabilities, modes (C,).

    ``used`` (1,) says how many are in use; the most probable comes first after a selection.
    """

    mean: F64
    covariance: F64
    log_p: F64
    mode: I64
    used: I64


def empty_hypotheses() -> Hypotheses:
    """An empty set with room for ``CAPACITY`` hypotheses."""
    return Hypotheses(
        np.zeros((CAPACITY, N_UNKNOWNS)),
        np.zeros((CAPACITY, N_UNKNOWNS, N_UNKNOWNS)),
        np.zeros(CAPACITY),
        np.zeros(CAPACITY, np.int64),
        np.zeros(1, np.int64),
    )


@compiled
def copy_row(source: Hypotheses, i: int, target: Hypotheses, k: int) -> None:
    """Row i of one becomes row k of the other."""
    for a in range(N_UNKNOWNS):
        target.mean[k, a] = source.mean[i, a]
        for b in range(N_UNKNOWNS):
            target.covariance[k, a, b] = source.covariance[i, a, b]
    target.log_p[k], target.mode[k] = source.log_p[i], source.mode[i]


@compiled
def copy_all(source: Hypotheses, target: Hypotheses) -> None:
    """Copy all hypotheses of one set into another."""
    n = source.used[0]
    target.mean[:n], target.covariance[:n] = source.mean[:n], source.covariance[:n]
    target.log_p[:n], target.mode[:n] = source.log_p[:n], source.mode[:n]
    target.used[0] = n


@compiled
def initialise(all_: Hypotheses, pose: F64, variances: F64, gains: F64, priors: Priors) -> None:
    """One hypothesis for each mode, at a pose; ``gains`` (2, 3): mean and variance of α, β and ℓ."""
    for mode in range(3):
        mean, covariance = all_.mean[mode], all_.covariance[mode]
        mean[:] = 0.0
        covariance[:] = 0.0
        mean[:3], mean[ALPHA:] = pose, gains[0]
        for c in range(3):
            covariance[c, c], covariance[ALPHA + c, ALPHA + c] = variances[c], gains[1, c]
        covariance[V_LONG, V_LONG] = priors.start_speed_mps**2
        covariance[YAW_RATE, YAW_RATE] = priors.start_yaw_rate_radps**2
        enter_mode(mean, covariance, mode, priors)
        p = priors.start_slipping if mode == ContactMode.SLIPPING else 0.5 * (1.0 - priors.start_slipping)
        if mode == ContactMode.SKIDDING:
            covariance[MODE_STATE, MODE_STATE] = priors.start_lateral_mps**2
        all_.mode[mode], all_.log_p[mode] = mode, np.log(p)
    all_.used[0] = 3


@compiled
def enter_mode(mean: F64, covariance: F64, mode: int, priors: Priors) -> None:
    """The mode's own unknown at its onset: v_lat = 0, or ρα with ρ = ``traction`` ± ``traction_sd``."""
    mean[MODE_STATE] = 0.0
    covariance[MODE_STATE] = 0.0
    covariance[:, MODE_STATE] = 0.0
    if mode == ContactMode.SLIPPING:
        mean[MODE_STATE] = priors.traction * mean[ALPHA]
        covariance[MODE_STATE] = priors.traction * covariance[ALPHA]
        covariance[:, MODE_STATE] = covariance[MODE_STATE]
        spread = (priors.traction**2 + priors.traction_sd**2) * covariance[ALPHA, ALPHA]
        covariance[MODE_STATE, MODE_STATE] = spread + (priors.traction_sd * mean[ALPHA]) ** 2


@compiled
def release_pose(all_: Hypotheses, priors: Priors) -> None:
    """Widen x, y and ψ of every hypothesis after a jump of the pose; the motion stays."""
    for i in range(all_.used[0]):
        for c, jump in ((X, priors.jump_m), (Y, priors.jump_m), (YAW, priors.jump_rad)):
            all_.covariance[i, c, c] += jump**2


@compiled
def normalise(all_: Hypotheses) -> None:
    """Scale the probabilities so that they sum to 1."""
    n = all_.used[0]
    highest = all_.log_p[:n].max()
    all_.log_p[:n] -= highest + np.log(np.exp(all_.log_p[:n] - highest).sum())


@compiled
def mean_of(all_: Hypotheses, log_decay: float) -> F64:
    """Mean of the unknowns over the hypotheses, (9,); v_lat and ℓ over those that skid.

    Without any of those, ``log_decay`` stands for ℓ.
    """
    out, skidding = np.zeros(N_UNKNOWNS), 1e-9
    out[LOG_DECAY] = skidding * log_decay
    for i in range(all_.used[0]):
        p, skids = np.exp(all_.log_p[i]), all_.mode[i] == ContactMode.SKIDDING
        skidding += p if skids else 0.0
        for c in range(N_UNKNOWNS):
            if skids or c not in (MODE_STATE, LOG_DECAY):
                out[c] += p * all_.mean[i, c]
    out[MODE_STATE] /= skidding
    out[LOG_DECAY] /= skidding
    return out


@compiled
def gains_of(all_: Hypotheses) -> F64:
    """Mean and variance of α, β and ℓ, (2, 3), over the hypotheses that hold at least 1 %."""
    total, out = 0.0, np.zeros((2, 3))
    for i in range(all_.used[0]):
        if all_.log_p[i] < RULES.min_gain_log:
            continue
        p = np.exp(all_.log_p[i])
        total += p
        for c in range(3):
            value = all_.mean[i, ALPHA + c]
            out[0, c] += p * value
            out[1, c] += p * (all_.covariance[i, ALPHA + c, ALPHA + c] + value**2)
    for c in range(3):
        out[0, c] /= total
        out[1, c] = out[1, c] / total - out[0, c] ** 2
    return out
