"""From a posterior over the modes to a mode, a mode set and a reason."""

from typing import NamedTuple

import numpy as np

from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_schemas.arrays import F64, I8, I64, U8, Bool
from wmr_schemas.compiled import compiled
from wmr_schemas.modes import ContactMode
from wmr_schemas.status import Status

NOT_EXCLUDED = 0.05
"""A mode is excluded when its posterior is below this."""


class Said(NamedTuple):
    """What an identifier has said so far, after each of m bins: ``posterior`` (4, m), NaN where it had not
    started, α and its sd (m,), whether the pose had just ``jumped`` (m,); which of these each row goes by,
    ``at`` (n,).
    """

    posterior: F64
    alpha: F64
    alpha_sd: F64
    jumped: Bool
    at: I64


def decide(paper: Verdict, evidence: Evidence, said: Said, min_confidence: float, n_modes: int) -> Verdict:
    """Verdicts from what was said last at each row.

    ``mode`` is the most probable mode where it reaches ``min_confidence``, else −1. Where the pose is not
    independent no mode is named and none excluded. The constraints and their thresholds are taken over from
    ``paper``, and its whole verdict where the identifier has not started (a robot whose α is not known yet).
    """
    n, modes = len(said.at), decided_modes(said.posterior, min_confidence)
    shown = Decision(
        np.empty((4, n)),
        paper.alpha.copy(),
        paper.alpha_sd.copy(),
        paper.mode.copy(),
        paper.mode_set.copy(),
        paper.outcome.copy(),
    )
    decide_rows(said, modes, evidence.independence, evidence.force, shown)
    if n_modes == 3:
        shown.posterior[3] = np.nan
    return paper._replace(**shown._asdict())


class Decision(NamedTuple):
    """Columns of a verdict that are filled in, (n,) and (4, n)."""

    posterior: F64
    alpha: F64
    alpha_sd: F64
    mode: I8
    mode_set: U8
    outcome: I8


@compiled
def decided_modes(posterior: F64, min_confidence: float) -> I8:
    """Mode and mode set by bin, (2, m). The set has bit k for each mode k whose posterior is .05 or more."""
    out = np.empty((2, posterior.shape[1]), np.int8)
    for i in range(posterior.shape[1]):
        best, left = 0, 0
        for k in range(4):
            best = k if posterior[k, i] > posterior[best, i] else best
            left += 1 << k if posterior[k, i] >= NOT_EXCLUDED else 0
        out[0, i], out[1, i] = best if posterior[best, i] >= min_confidence else ContactMode.UNDECIDED, left
    return out


@compiled
def decide_rows(said: Said, modes: I8, independence: F64, force: F64, shown: Decision) -> None:
    """The rows of :func:`decide`, over what ``paper`` says. An undecided row has a reason: no torque, too
    small torques, too little turning.
    """
    at, said_posterior, said_alpha, said_sd = said.at, said.posterior, said.alpha, said.alpha_sd
    posterior, alpha, alpha_sd = shown.posterior, shown.alpha, shown.alpha_sd
    mode, mode_set, outcome, jumped = shown.mode, shown.mode_set, shown.outcome, said.jumped
    for i in range(len(at)):
        m = at[i]
        started = not np.isnan(said_posterior[0, m])
        if started:
            alpha[i], alpha_sd[i] = said_alpha[m], said_sd[m]
        if not started or independence[i] == NOT_INDEPENDENT:
            for k in range(4):
                posterior[k, i] = np.nan
            continue
        for k in range(4):
            posterior[k, i] = said_posterior[k, m]
        mode[i], mode_set[i] = modes[0, m], modes[1, m]
        if jumped[m]:
            outcome[i] = Status.POSE_JUMP
        elif modes[0, m] >= 0:
            outcome[i] = Status.OK
        elif np.isnan(force[i]):
            outcome[i] = Status.NO_TORQUE
