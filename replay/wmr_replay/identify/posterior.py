"""From a posterior over the modes to a mode, a mode set and a status."""

import math
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.independence import NOT_INDEPENDENT
from wmr_replay.identify.interface import Evidence, Verdict
from wmr_schemas.arrays import F64, I8, I64, Bool
from wmr_schemas.compiled.lean import lean
from wmr_schemas.modes import ContactMode
from wmr_schemas.status import Status

NOT_EXCLUDED = 0.05
"""A mode is excluded when its posterior is below this, as at the usual level of a test."""


class BinEstimates(NamedTuple):
    """Estimates of an identifier after each of m bins, and the bin that each of n rows takes.

    ``posterior`` (4, m), NaN before the identifier has started; ``alpha`` and ``alpha_sd`` (m,); ``jumped``
    (m,): the pose has just jumped; ``at`` (n,): index of the last bin that is complete at a row. ``coasts``
    (m,): no wheel is driven, so that rolling and slipping are the same motion; None where that is no matter.
    """

    posterior: F64
    alpha: F64
    alpha_sd: F64
    jumped: Bool
    at: I64
    coasts: Bool | None = None


def decide(
    paper: Verdict, evidence: Evidence, estimates: BinEstimates, min_confidence: float, n_modes: int
) -> Verdict:
    """Verdicts (n,) from the latest estimates at each row.

    ``mode`` is the most probable mode where it reaches ``min_confidence``, else −1. Where the robot coasts,
    the mode's :func:`twin <open_slip>` has to be excluded, too. Where the pose is not
    independent no mode is named and none excluded. The constraints and their thresholds are those of
    ``paper``; before the identifier has started (a robot whose α is not known yet) the whole verdict is.
    """
    values = np.concatenate([np.empty((4, len(estimates.at))), [paper.alpha, paper.alpha_sd]])
    verdicts = np.stack([paper.mode, paper.mode_set.view(np.int8), paper.outcome])
    bins = np.concatenate([estimates.posterior, [estimates.alpha, estimates.alpha_sd]])
    decided = decided_modes(estimates.posterior, min_confidence)
    if estimates.coasts is not None:
        decided[0, estimates.coasts & open_slip(decided)] = ContactMode.UNDECIDED
    modes = np.concatenate([decided, [estimates.jumped]], axis=0)
    decide_rows(estimates.at, bins, modes, evidence.independence, evidence.force, values, verdicts)
    if n_modes == 3:
        values[3] = np.nan
    mode, mode_set, outcome = verdicts
    return paper._replace(
        posterior=values[:4],
        alpha=values[4],
        alpha_sd=values[5],
        mode=mode,
        mode_set=mode_set.view(np.uint8),
        outcome=outcome,
    )


def decided_modes(posterior: F64, min_confidence: float) -> I8:
    """Mode and mode set by bin, (2, m). The set has bit k for each mode k whose posterior is .05 or more."""
    best = np.argmax(posterior, axis=0)
    sure = np.max(posterior, axis=0) >= min_confidence
    left = (posterior >= NOT_EXCLUDED).T @ (1 << np.arange(len(posterior)))
    return np.stack([np.where(sure, best, ContactMode.UNDECIDED), left]).astype(np.int8)


def open_slip(decided: I8) -> Bool:
    """Whether a mode is named (m,) while its twin, the same with or without slipping, is not excluded.

    Without traction both are the same motion: how often a robot slips, and nothing else, tells them apart.
    """
    mode, left = decided
    twin = np.where(mode >= 0, mode ^ ContactMode.SLIPPING, 0)
    return np.asarray((mode >= 0) & ((left >> twin) & 1 == 1))


@lean
def decide_rows(
    at: I64, bins: F64, modes: I8, independence: F64, force: F64, values: F64, verdicts: I8
) -> None:
    """The rows of :func:`decide`, in place of the paper's verdict.

    ``bins`` (6, m) and ``values`` (6, n): posterior, α and its standard deviation; ``modes`` (3, m): mode,
    mode set and whether the pose jumped; ``verdicts`` (3, n): mode, mode set and outcome. An undecided row
    keeps the paper's reason (torques too small, too little turning), or has no torque.
    """
    for i in range(len(at)):
        m = at[i]
        started = not math.isnan(bins[0, m])
        if started:
            values[4, i], values[5, i] = bins[4, m], bins[5, m]
        named = started and independence[i] != NOT_INDEPENDENT
        for k in range(4):
            values[k, i] = bins[k, m] if named else math.nan
        if not named:
            continue
        verdicts[0, i], verdicts[1, i] = modes[0, m], modes[1, m]
        if modes[2, m]:
            verdicts[2, i] = Status.POSE_JUMP
        elif modes[0, m] >= 0:
            verdicts[2, i] = Status.OK
        elif math.isnan(force[i]):
            verdicts[2, i] = Status.NO_TORQUE
