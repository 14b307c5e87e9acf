"""From a posterior over the modes to a mode, a mode set and a reason."""

import numpy as np

from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.verdict import (
    NO_TORQUE,
    OK,
    Evidence,
    Verdict,
)
from wmr_schemas.arrays import F64, I8, U8

NOT_EXCLUDED = 0.05
"""A mode is excluded when its posterior is below this."""


def decide(
    paper: Verdict,
    evidence: Evidence,
    posterior: F64,
    fitted: tuple[F64, F64],
    min_confidence: float,
    n_modes: int,
) -> Verdict:
    """Verdicts from a posterior (4, n), NaN where the identifier has not started, and α with its sd.

    ``mode`` is the most probable mode where it reaches ``min_confidence``, else −1. Where the pose is not
    independent no mode is named and none excluded. The constraints and their thresholds are taken over from
    ``paper``, and its whole verdict where the identifier has not started (a robot whose α is not known yet).
    """
    started = ~np.isnan(posterior[0])
    known = started & (evidence.independence != NOT_INDEPENDENT)
    sure = posterior.max(axis=0) >= min_confidence
    mode = np.where(known, np.where(sure, posterior.argmax(axis=0), -1), paper.mode).astype(np.int8)
    mode_set = np.where(known, sets(posterior), paper.mode_set).astype(np.uint8)
    outcome = np.where(known, reasons(mode, paper, evidence), paper.outcome).astype(np.int8)
    alpha = np.where(started, fitted[0], paper.alpha)
    alpha_sd = np.where(started, fitted[1], paper.alpha_sd)
    shown = np.where(known, posterior, np.nan)
    if n_modes == 3:
        shown[3] = np.nan
    return paper._replace(
        posterior=shown, alpha=alpha, alpha_sd=alpha_sd, mode=mode, mode_set=mode_set, outcome=outcome
    )


def sets(posterior: F64) -> U8:
    """Bit k for each mode k whose posterior is .05 or more."""
    bits = np.array([1, 2, 4, 8], np.uint8)[:, None]
    return np.asarray(np.sum((np.nan_to_num(posterior) >= NOT_EXCLUDED) * bits, axis=0).astype(np.uint8))


def reasons(mode: I8, paper: Verdict, evidence: Evidence) -> I8:
    """Why a row is undecided: no torque, too small torques, too little turning; OK where a mode is named."""
    outcome = np.full(len(mode), OK, np.int8)
    undecided = mode < 0
    why = np.where(np.isnan(evidence.force), NO_TORQUE, paper.outcome)
    outcome[undecided] = why[undecided]
    return outcome
