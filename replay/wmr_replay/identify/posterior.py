"""From a posterior over the modes to a mode, a mode set and a reason."""

from typing import NamedTuple

import numpy as np
from numba import njit

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
    mode, mode_set, outcome = np.empty((3, posterior.shape[1]), np.int8)
    shown, (alpha, alpha_sd) = np.empty_like(posterior), np.empty((2, posterior.shape[1]))
    said = Decision(shown, alpha, alpha_sd, mode, mode_set.view(np.uint8), outcome)
    decide_rows(posterior, fitted, paper, evidence.independence, evidence.force, min_confidence, said)
    if n_modes == 3:
        shown[3] = np.nan
    return paper._replace(**said._asdict())


class Decision(NamedTuple):
    """Columns of a verdict that are filled in, (n,) and (4, n)."""

    posterior: F64
    alpha: F64
    alpha_sd: F64
    mode: I8
    mode_set: U8
    outcome: I8


@njit(cache=True)
def decide_rows(
    posterior: F64,
    fitted: tuple[F64, F64],
    paper: Verdict,
    independence: F64,
    force: F64,
    min_confidence: float,
    said: Decision,
) -> None:
    """The rows of :func:`decide`. ``mode_set`` has bit k for each mode k whose posterior is .05 or more; an
    undecided row has a reason: no torque, too small torques, too little turning.
    """
    for i in range(posterior.shape[1]):
        started = not np.isnan(posterior[0, i])
        said.alpha[i] = fitted[0][i] if started else paper.alpha[i]
        said.alpha_sd[i] = fitted[1][i] if started else paper.alpha_sd[i]
        said.mode[i], said.mode_set[i], said.outcome[i] = paper.mode[i], paper.mode_set[i], paper.outcome[i]
        said.posterior[:, i] = np.nan
        if not started or independence[i] == NOT_INDEPENDENT:
            continue
        best, left = 0, 0
        for k in range(4):
            said.posterior[k, i] = posterior[k, i]
            best = k if posterior[k, i] > posterior[best, i] else best
            left += 1 << k if posterior[k, i] >= NOT_EXCLUDED else 0
        sure = posterior[best, i] >= min_confidence
        said.mode[i], said.mode_set[i] = best if sure else -1, left
        if sure:
            said.outcome[i] = OK
        elif np.isnan(force[i]):
            said.outcome[i] = NO_TORQUE
