"""From a posterior over the modes to a mode, a mode set and a status."""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_schemas.arrays import F64, I8, I64, U8, Bool
from wmr_schemas.compiled.lean import lean
from wmr_schemas.modes import ContactMode
from wmr_schemas.status import Status

NOT_EXCLUDED = 0.05
"""A mode is excluded when its posterior is below this, as at the usual level of a test."""


class BinEstimates(NamedTuple):
    """Estimates of an identifier after each of m bins, and the bin that each of n rows takes.

    ``posterior`` (4, m), NaN before the identifier has started; ``alpha`` and ``alpha_sd`` (m,); ``jumped``
    (m,): the pose has just jumped; ``at`` (n,): index of the last bin that is complete at a row.
    """

    posterior: F64
    alpha: F64
    alpha_sd: F64
    jumped: Bool
    at: I64


class Decision(NamedTuple):
    """Columns of a verdict that the posterior decides, (4, n) and (n,)."""

    posterior: F64
    alpha: F64
    alpha_sd: F64
    mode: I8
    mode_set: U8
    outcome: I8


def decide(
    paper: Verdict, evidence: Evidence, estimates: BinEstimates, min_confidence: float, n_modes: int
) -> Verdict:
    """Verdicts (n,) from the latest estimates at each row.

    ``mode`` is the most probable mode where it reaches ``min_confidence``, else −1. Where the pose is not
    independent no mode is named and none excluded. The constraints and their thresholds are those of
    ``paper``; before the identifier has started (a robot whose α is not known yet) the whole verdict is.
    """
    n, modes = len(estimates.at), decided_modes(estimates.posterior, min_confidence)
    decision = Decision(
        np.empty((4, n)),
        paper.alpha.copy(),
        paper.alpha_sd.copy(),
        paper.mode.copy(),
        paper.mode_set.copy(),
        paper.outcome.copy(),
    )
    decide_rows(estimates, modes, evidence.independence, evidence.force, decision)
    if n_modes == 3:
        decision.posterior[3] = np.nan
    return paper._replace(**decision._asdict())


def decided_modes(posterior: F64, min_confidence: float) -> I8:
    """Mode and mode set by bin, (2, m). The set has bit k for each mode k whose posterior is .05 or more."""
    best = np.argmax(posterior, axis=0)
    sure = np.max(posterior, axis=0) >= min_confidence
    left = (posterior >= NOT_EXCLUDED).T @ (1 << np.arange(len(posterior)))
    return np.stack([np.where(sure, best, ContactMode.UNDECIDED), left]).astype(np.int8)


@lean
def decide_rows(
    estimates: BinEstimates, modes: I8, independence: F64, force: F64, decision: Decision
) -> None:
    """The rows of :func:`decide`, in place of those in ``decision``, which holds the paper's verdict.

    An undecided row keeps the paper's reason (torques too small, too little turning), or has no torque.
    """
    at, bin_posterior, bin_alpha, bin_sd = (
        estimates.at,
        estimates.posterior,
        estimates.alpha,
        estimates.alpha_sd,
    )
    posterior, alpha, alpha_sd = decision.posterior, decision.alpha, decision.alpha_sd
    mode, mode_set, outcome, jumped = decision.mode, decision.mode_set, decision.outcome, estimates.jumped
    for i in range(len(at)):
        m = at[i]
        started = not math.isnan(bin_posterior[0, m])
        if started:
            alpha[i], alpha_sd[i] = bin_alpha[m], bin_sd[m]
        if not started or independence[i] == NOT_INDEPENDENT:
            for k in range(4):
                posterior[k, i] = math.nan
            continue
        for k in range(4):
            posterior[k, i] = bin_posterior[k, m]
        mode[i], mode_set[i] = modes[0, m], modes[1, m]
        if jumped[m]:
            outcome[i] = Status.POSE_JUMP
        elif modes[0, m] >= 0:
            outcome[i] = Status.OK
        elif math.isnan(force[i]):
            outcome[i] = Status.NO_TORQUE
