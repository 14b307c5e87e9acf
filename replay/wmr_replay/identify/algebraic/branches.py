"""Branching of the hypotheses, pruning and merging."""

import numpy as np

from wmr_replay.identify.algebraic.hypotheses import CAPACITY, Hypotheses, copy_all, copy_row, enter_mode
from wmr_replay.identify.algebraic.priors import Priors
from wmr_replay.identify.algebraic.regression import (
    ALPHA,
    MODE_STATE,
    V_LONG,
    YAW_GAIN,
    YAW_RATE,
    Step,
)
from wmr_replay.identify.algebraic.rules import RULES
from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode

N_MODES = 3
"""Ideal, skidding, slipping, by their values in ``ContactMode``."""


@compiled
def branch(all_: Hypotheses, elapsed_s: float, step: Step, priors: Priors) -> None:
    """Add children for what may have happened in the last ``elapsed_s``: a switch, or a change of load."""
    switched = 1.0 - np.exp(-priors.switch_rate_hz * elapsed_s)
    log_each, log_stayed, onset_sd_s = (
        np.log(0.5 * switched),
        np.log(1.0 - switched),
        elapsed_s / np.sqrt(12.0),
    )
    n = all_.used[0]
    change_load(all_, elapsed_s, priors)
    for parent in range(n):
        if all_.log_p[parent] < RULES.min_parent_log:
            continue
        before = all_.mode[parent]
        for mode in range(N_MODES):
            child = add_child(all_, parent, mode, log_each) if mode != before else -1
            if child >= 0:
                mean, covariance = all_.mean[child], all_.covariance[child]
                enter_mode(mean, covariance, mode, priors)
                blur_onset(mean, covariance, before, mode, step, onset_sd_s)
        all_.log_p[parent] += log_stayed


@compiled
def change_load(all_: Hypotheses, elapsed_s: float, priors: Priors) -> None:
    """A child of the most probable, unless that slips, whose α and β may have changed."""
    if all_.mode[0] == ContactMode.SLIPPING:
        return
    child = add_child(all_, 0, all_.mode[0], np.log(priors.load_change_rate_hz * elapsed_s))
    if child >= 0:
        for gain in (ALPHA, YAW_GAIN):
            all_.covariance[child, gain, gain] += (priors.load_change * all_.mean[child, gain]) ** 2


@compiled
def add_child(all_: Hypotheses, parent: int, mode: int, log_share: float) -> int:
    """A child, a copy of its parent but for mode and probability; its row, or −1 when there is no room."""
    child = int(all_.used[0])
    if child >= CAPACITY:
        return -1
    copy_row(all_, parent, all_, child)
    all_.mode[child] = mode
    all_.log_p[child] += log_share
    all_.used[0] = child + 1
    return child


@compiled
def blur_onset(mean: F64, covariance: F64, before: int, mode: int, step: Step, onset_sd_s: float) -> None:
    """Widen the covariance for the unknown instant of the switch, ± ``onset_sd_s``."""
    if (before == ContactMode.SLIPPING) != (mode == ContactMode.SLIPPING) and not np.isnan(step.force):
        covariance[V_LONG, V_LONG] += (mean[ALPHA] * step.force * onset_sd_s) ** 2
        covariance[YAW_RATE, YAW_RATE] += (mean[YAW_GAIN] * step.difference * onset_sd_s) ** 2
    if mode == ContactMode.SKIDDING:
        covariance[MODE_STATE, MODE_STATE] += (mean[V_LONG] * mean[YAW_RATE] * onset_sd_s) ** 2 + 1e-6


@compiled
def has_negative_alpha(all_: Hypotheses, i: int) -> bool:
    """Whether a hypothesis needs an α below 0, by two standard deviations."""
    alpha = all_.mean[i, ALPHA]
    return bool(alpha < 0.0 and alpha**2 > 4.0 * all_.covariance[i, ALPHA, ALPHA])


@compiled
def alike(mean: F64, covariance: F64, mode: I64, i: int, k: int) -> bool:
    """Whether two hypotheses agree in mode, means and variances, so that their futures agree as well."""
    if mode[i] != mode[k]:
        return False
    for c in (V_LONG, YAW_RATE, ALPHA, MODE_STATE):
        one, other = covariance[i, c, c], covariance[k, c, c]
        difference = mean[i, c] - mean[k, c]
        if difference**2 > RULES.same_mean * one + 1e-12:
            return False
        if max(one, other) > RULES.same_variance * min(one, other) + 1e-12:
            return False
    return True


@compiled
def prune_and_merge(all_: Hypotheses, spare: Hypotheses) -> None:
    """Keep the ``RULES.n_kept`` most probable, in that order; merge those that are alike."""
    log_p, mean, covariance, mode = all_.log_p, all_.mean, all_.covariance, all_.mode
    order = np.argsort(-log_p[: all_.used[0]])
    kept = np.empty(RULES.n_kept, np.int64)
    best, n = log_p[order[0]], 0
    for i in order:
        if n >= RULES.n_kept or log_p[i] < best + RULES.min_kept_log:
            break
        if n > 0 and has_negative_alpha(all_, i):
            continue
        twin = -1
        for k in range(n):
            if alike(mean, covariance, mode, kept[k], i):
                twin = kept[k]
                break
        if twin < 0:
            kept[n] = i
            n += 1
        else:
            log_p[twin] += np.log1p(np.exp(log_p[i] - log_p[twin]))
    for k in range(n):
        copy_row(all_, kept[k], spare, k)
    spare.used[0] = n
    copy_all(spare, all_)
